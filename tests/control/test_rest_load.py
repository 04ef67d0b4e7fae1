"""The load at rest against numbers worked out by hand; the sessions with a button are in `test_button`."""

from __future__ import annotations

import math

import pytest

from idtool.control.rest_load import RestLoad, Uncertainty, gravity_error
from idtool.parameters import Parameter

SURE = Uncertainty(gravity=0.0, payload=0.0, per_payload=0.0, friction=0.0, noise=0.008)
#: Of 0.4 kg, N m.
WEIGHT = 0.18


def rest(most: float | None = None) -> RestLoad:
    return RestLoad(10, 0.07, SURE, most)


def heard(load: RestLoad, left: float, *, button: bool = True, weight: float = WEIGHT) -> bool:
    for _ in range(10):
        load.listen(left)
    return load.judge(0.4, weight, 0.05, button=button)


def test_every_uncertainty_counts_and_that_of_a_kilogram_by_the_payload() -> None:
    assert Uncertainty(3.0, 4.0, 0.0, 12.0, 99.0).of(1.0) == pytest.approx(13.0)
    assert Uncertainty(0.0, 3.0, 2.0, 0.0, 99.0).of(2.0) == pytest.approx(5.0)
    assert gravity_error({"base": Parameter(1.0, 0.3), "per_payload": Parameter(1.0, 9.0)}) == 0.3
    assert gravity_error({"sin": Parameter(1.0, 0.3), "cos": Parameter(1.0, 0.4)}) == pytest.approx(0.5)
    assert gravity_error({"base": Parameter(1.0)}) == 0.0


def test_a_file_that_does_not_know_its_gravity_explains_no_more_than_friction_and_noise_do() -> None:
    for vague in (Uncertainty(1e6, 3.0, 0.0, 2.0, 5.0), Uncertainty(0.0, 3.0, 1e6, 2.0, 5.0)):
        assert vague.of(2.0) == vague.most == pytest.approx(math.sqrt(9.0 + 4.0 + 4.0 + 25.0))


def test_two_standard_deviations_are_no_disagreement() -> None:
    load = RestLoad(10, 0.07, Uncertainty(0.03, 0.04, 0.0, 0.0, 0.04), None)
    heard(load, 0.169)
    assert (load.allowed, load.excess) == (pytest.approx(0.17), 0.0)
    heard(load, 0.171)
    assert load.excess == pytest.approx(0.171)


@pytest.mark.parametrize("left", [0.0, 0.069, -0.069])
def test_what_friction_can_hold_is_no_load(left: float) -> None:
    load = rest()
    assert not heard(load, left)
    assert (load.offset, load.excess, load.missing, load.allowed) == (0.0, 0.0, False, 0.07)


@pytest.mark.parametrize("left", [0.071, -0.071, 0.5])
def test_more_than_that_is_in_excess(left: float) -> None:
    load = rest()
    assert not heard(load, left)
    assert load.excess == pytest.approx(left)
    assert (load.offset, load.missing) == (0.0, False)


def test_a_payload_that_is_not_there_lets_the_axis_rise_with_a_button_only() -> None:
    load = rest()
    assert not heard(load, -WEIGHT, button=False)
    assert load.excess == pytest.approx(-WEIGHT)
    load = rest()
    assert not heard(load, -WEIGHT, weight=0.0)
    assert load.excess == pytest.approx(-WEIGHT)
    load = rest()
    assert heard(load, -WEIGHT)  # listen anew
    assert (load.offset, load.excess, load.missing) == (-WEIGHT, 0.0, True)
    assert not heard(load, -WEIGHT)  # and that is all
    assert load.missing


def test_once_it_hangs_it_is_no_longer_missing() -> None:
    load = rest()
    heard(load, -WEIGHT)
    for _ in range(10):
        load.watch(-WEIGHT)
    assert any(load.watch(0.0) for _ in range(40))
    assert load.changed == pytest.approx(WEIGHT)
    assert heard(load, 0.0)
    assert (load.offset, load.missing, load.excess) == (pytest.approx(0.0), False, 0.0)


def test_an_allowance_that_is_given_replaces_that_of_friction() -> None:
    load = rest(0.02)
    heard(load, 0.03, button=False)
    assert (load.allowed, load.excess) == (0.02, pytest.approx(0.03))
    load = rest(math.inf)
    heard(load, 99.0, button=False)
    assert load.excess == 0.0


@pytest.mark.parametrize(("change", "taken"), [(0.0239, False), (0.0241, True), (-0.0241, True)])
def test_three_noises_that_stay_for_three_windows_are_a_load(change: float, taken: bool) -> None:
    load = rest()
    assert load.least_change == pytest.approx(0.024)
    for _ in range(10):
        load.watch(0.01)
    windows = [[load.watch(0.01 + change) for _ in range(10)] for _ in range(5)]
    # the first differs from the one before it, three more are like it
    assert [any(window) for window in windows] == [False, False, False, taken, False]
    assert load.changed == pytest.approx(change if taken else 0.0)


def test_a_listening_knows_nothing_of_the_one_before() -> None:
    load = rest()
    heard(load, 0.5)
    assert not heard(load, 0.0)
    assert load.excess == 0.0
    load.watch(0.3)
    load.reset()
    assert (load.offset, load.changed, load.missing, load.excess, load.allowed) == (0.0, 0.0, False, 0.0, 0.0)
    for _ in range(9):
        assert not load.watch(0.0)
