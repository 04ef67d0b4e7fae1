"""The load at rest against numbers worked out by hand; the sessions with a button are in `test_button`."""

from __future__ import annotations

import math

import numpy as np
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
    return load.judge(0.4, weight, 0.05, 0.0, button=button)


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
        load.watch(-WEIGHT, 0.0)
    assert any(load.watch(0.0, 0.0) for _ in range(40))
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
        load.watch(0.01, 0.0)
    windows = [[load.watch(0.01 + change, 0.0) for _ in range(10)] for _ in range(5)]
    # the first differs from the one before it, three more are like it
    assert [any(window) for window in windows] == [False, False, False, taken, False]
    assert load.changed == pytest.approx(change if taken else 0.0)


def test_a_listening_knows_nothing_of_the_one_before() -> None:
    load = rest()
    heard(load, 0.5)
    assert not heard(load, 0.0)
    assert load.excess == 0.0
    load.watch(0.3, 0.0)
    load.reset()
    assert (load.offset, load.changed, load.missing, load.excess, load.allowed) == (0.0, 0.0, False, 0.0, 0.0)
    for _ in range(9):
        assert not load.watch(0.0, 0.0)


def noisy(size: float, seed: int, level: float = 0.0, rows: int = 60) -> list[float]:
    return (level + size * np.random.default_rng(seed).standard_normal(rows)).tolist()


def quiet(seed: int = 0) -> RestLoad:
    """One that has heard how loud the current is with hands off: 4 mN m."""
    load = RestLoad(20, 0.07, SURE, None)
    for left in noisy(0.004, seed, rows=20):
        load.listen(left)
    load.judge(0.4, WEIGHT, 0.05, 0.0, button=True)
    return load


def test_a_load_is_as_quiet_as_the_current_with_hands_off_and_a_hand_is_not() -> None:
    """A load that was hung on, and a hand that trembles by twice the noise, of each forty."""
    for size, wanted in ((0.004, True), (0.009, False)):
        taken = []
        for k in range(40):
            load = quiet(k)
            taken.append(any(load.watch(left, 0.0) for left in noisy(size, 100 + k, 0.2, 120)))
        assert np.mean(taken) > 0.9 if wanted else np.mean(taken) < 0.1


def test_what_is_hung_on_right_after_a_listening_counts_against_it() -> None:
    load = quiet()
    assert any(load.watch(left, 0.0) for left in noisy(0.004, 1, 0.2, 100))
    assert load.changed == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(("size", "wanted"), [(0.004, True), (0.02, False)], ids=["hands off", "a hand"])
def test_a_zero_of_before_a_motion_is_taken_anew_once_hands_are_off(size: float, wanted: bool) -> None:
    load = quiet()
    load.forget()
    assert any(load.watch(left, 0.0, stale=True) for left in noisy(size, 2, 0.05, 100)) is wanted
    assert (load.changed, load.taken) == (0.0, 0.0)


def taken_in(seed: int = 0) -> RestLoad:
    load = quiet(seed)
    assert any(load.watch(left, 0.0) for left in noisy(0.004, 3, 0.2, 100))
    load.offset = load.changed
    load.forget()
    return load


@pytest.mark.parametrize(
    ("felt", "size", "left"),
    [(0.2, 0.004, True), (0.25, 0.004, True), (0.15, 0.004, True), (0.28, 0.004, False), (0.2, 0.02, False)],
    ids=["all of it", "a quarter more", "a quarter less", "too much", "it trembles"],
)
def test_what_is_felt_is_the_load_that_was_taken_in_if_it_is_as_much_and_as_quiet(
    felt: float, size: float, left: bool
) -> None:
    load = taken_in()
    for sample in noisy(size, 4, felt, 20):
        load.listen(sample)
    assert load.has_left() is left


def test_what_left_may_come_back_once() -> None:
    load = taken_in()
    much = load.taken
    load.undo()
    assert (load.changed, load.offset, load.taken, load.away) == (0.0, 0.0, -much, True)
    load.undo()
    assert (load.changed, load.offset, load.taken, load.away) == (
        pytest.approx(much),
        pytest.approx(much),
        0.0,
        False,
    )


def test_what_seemed_to_leave_and_is_still_carried_is_a_load() -> None:
    load = taken_in()
    load.undo()
    for left in noisy(0.004, 5, 0.2, 20):
        load.listen(left)
    assert load.judge(0.4, WEIGHT, 0.05, 0.0, button=True)  # listen anew
    assert load.changed == load.offset == pytest.approx(0.2, abs=0.01)
    assert load.excess == load.taken == 0.0


def test_once_a_hand_moved_the_axis_it_is_a_load() -> None:
    load = taken_in()
    load.settle()
    for left in noisy(0.004, 6, 0.2, 20):
        load.listen(left)
    assert load.taken == 0.0
    assert not load.has_left()
