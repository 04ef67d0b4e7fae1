"""The compiled admittance law: how it guides, brakes, listens and tares, against numbers worked by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from idtool.control.admittance import kernel
from idtool.control.admittance.motion import brake, follow, guide
from idtool.control.admittance.record import NOT_EXPLAINED, OTHER_LOAD, TOUCHED, USED
from idtool.control.admittance.rest import listen
from idtool.control.admittance.states import (
    GONE,
    GUIDING,
    MAY_HOLD,
    RESTING,
    SEEMS_GONE,
    STARTING,
    STOPPING,
    TARING,
)
from idtool.control.admittance.tare import tare

from .kernel_law import AXIS, law


def guided(**numbers: float) -> tuple[Any, Any]:
    return law(
        GUIDING, **{"hand": 0.1, "raw": 0.1, "way": 1.0, "position": 0.2, "x": 0.2, "w": 0.1} | numbers
    )


def test_the_axis_yields_to_what_is_certain() -> None:
    c, s = guided()
    place = guide(c, s, 0.1)
    w = 0.1 + (1.0 - math.exp(-0.01 / 0.15)) * (8.0 * 0.082 - 0.1)
    assert s["w"] == pytest.approx(w)
    assert s["x"] == pytest.approx(0.2 + 0.01 * w)
    assert place == pytest.approx(s["x"] + s["lead"] * w)
    assert (s["state"], s["limited"]) == (GUIDING, 0)


def test_no_hand_is_given_more_than_the_speed_limit() -> None:
    for way in (1.0, -1.0):
        c, s = guided(hand=way, raw=way, way=way, w=way)
        guide(c, s, way)
        assert s["w"] == pytest.approx(way)
        assert s["limited"] == 1


def test_it_stops_as_soon_as_nothing_certain_pushes_its_way() -> None:
    for hand, way, goes in ((0.019, 1.0, True), (0.017, 1.0, False), (-0.1, 1.0, False), (-0.1, -1.0, True)):
        c, s = guided(hand=hand, raw=0.1, way=way, since=9, moved=9)
        guide(c, s, 0.1)
        assert s["state"] == (GUIDING if goes else STOPPING)
        if not goes:
            assert (s["w"], s["since"], s["moved"]) == (0.0, 1, 0)


def test_it_never_turns_round_without_a_rest() -> None:
    c, s = guided(raw=-0.5, w=0.01)
    guide(c, s, 0.1)
    assert s["w"] == 0.0


def test_a_hand_that_seems_to_leave_goes_on_only_if_it_would_start() -> None:
    """Beyond root(0.02^2 + 0.01^2) + 0.014 = 0.0364, for three samples."""
    c, s = guided(raw=0.036, grip=SEEMS_GONE)
    guide(c, s, 0.1)
    assert s["state"] == STOPPING
    c, s = guided(raw=0.037, grip=SEEMS_GONE)
    for k in range(3):
        assert s["grip"] == SEEMS_GONE
        guide(c, s, 0.1)
        assert (s["state"], s["pushed"]) == (GUIDING, k + 1)
    assert s["grip"] == MAY_HOLD
    c, s = guided(raw=0.045, grip=SEEMS_GONE, dead=0.032)
    guide(c, s, 0.1)
    assert s["state"] == STOPPING


def test_a_steady_torque_in_motion_is_bias_up_to_one_noise() -> None:
    c, s = guided(raw=0.05)
    guide(c, s, 0.1)
    assert s["bias"] == pytest.approx(-0.05 * 0.01 / 2.5)
    for raw, bias in ((99.0, -0.01), (-99.0, 0.01)):
        c, s = guided(raw=raw)
        guide(c, s, 0.1)
        assert s["bias"] == pytest.approx(bias)


def test_the_end_of_the_range_winds_nothing_up() -> None:
    for way, end in ((1.0, 1.0), (-1.0, -1.0)):
        c, s = guided(hand=way, raw=way, way=way, w=way, position=0.999 * end, x=0.999 * end)
        assert guide(c, s, way) == end
        assert (s["w"], s["x"]) == (0.0, end)
        c, s = guided(hand=-way, raw=-way, way=-way, w=-way, position=end, x=end)  # back inside is free
        assert abs(guide(c, s, -way)) < 1.0


def test_the_command_is_never_far_ahead_of_the_axis() -> None:
    for behind in (1.0, -1.0):
        c, s = guided(w=0.2, x=0.2 + behind)
        follow(c, s)
        assert s["x"] == pytest.approx(0.2 + behind * (0.15 * 0.2 + 4.0 * 0.0015))


def test_the_servo_s_lag_is_trimmed_in_motion_and_within_a_factor_of_four() -> None:
    c, s = guided(w=0.2, x=0.2 + 0.005 - 0.002)  # 5 ms of 50 ms late
    follow(c, s)
    assert (s["lead"], s["turn"]) == (0.05, 1)  # at every other sample, for both
    s["x"] = 0.2 + 0.005 - 0.002
    follow(c, s)
    assert s["lead"] == pytest.approx(0.05 * (1.0 + 2.0 * 3.0 * 0.01 * 0.005 / 0.01))
    c, s = guided(w=0.09, x=0.21, turn=1)  # too slow to say
    follow(c, s)
    assert s["lead"] == 0.05
    for lead, x, most in ((0.2, 0.3, 0.2), (0.0125, 0.1, 0.0125)):
        c, s = guided(w=0.2, lead=lead, x=x, turn=1)
        follow(c, s)
        assert s["lead"] == pytest.approx(most)


def test_a_braked_axis_is_asked_to_rest_where_it_comes_to_rest() -> None:
    c, s = law(STOPPING, position=0.2, anchor=0.5)
    assert brake(c, s, 0.3) == pytest.approx(0.2 + 0.006 * 0.3)
    assert (s["anchor"], s["since"], s["moved"], s["fast"]) == (0.2, 1, 0, 0.3)
    assert brake(c, s, 0.15) == pytest.approx(0.2 + 0.006 * 0.15 / 2)  # at half the speed a quarter
    assert brake(c, s, -0.4) == pytest.approx(0.2 - 0.006 * 0.4)
    c, s = law(STOPPING, position=0.2, anchor=0.2, since=4, x=0.7, fast=0.21)
    assert brake(c, s, 0.19) == 0.7  # slow, and late: one place
    c, s = law(STOPPING, position=0.2, anchor=0.2, since=4, x=0.7, fast=0.21)
    assert brake(c, s, -0.21) == pytest.approx(0.2 - 0.006 * 0.21)  # still fast
    c, s = law(STOPPING, position=0.2, anchor=0.2, since=3, x=0.7, fast=0.21)
    assert brake(c, s, 0.0) == 0.2


def test_an_axis_stands_that_kept_its_count() -> None:
    c, s = law(STOPPING, position=0.2, anchor=0.2014, since=9, moved=5, hand=0.3, zero=0.01, pushed=1)
    brake(c, s, 0.0)
    assert (s["state"], s["since"], s["moved"]) == (STOPPING, 10, 5)
    assert brake(c, s, 0.0) == 0.2
    assert (s["state"], s["hand"], s["pushed"], s["anchor"]) == (RESTING, 0.0, 0, 0.2)
    assert (s["zero_before"], s["zero_variance"]) == (0.01, pytest.approx(0.02**2 + 0.01**2))
    c, s = law(STOPPING, position=0.2, anchor=0.2031, since=9, moved=5)  # two counts: it moved
    brake(c, s, 0.0)
    assert (s["moved"], s["anchor"]) == (9, 0.2)
    c, s = law(STOPPING, position=1.2, anchor=1.2, since=20)
    assert brake(c, s, 0.0) == 1.0  # it rests inside its range


def test_the_first_moment_is_the_bend_that_nobody_saw() -> None:
    c, s = law(STARTING, raw=0.03, hand=0.5)
    for k in range(20):
        assert s["state"] == STARTING
        assert listen(c, s) == 0.2
        assert s["since"] == (k + 1) % 20  # a rest counts anew
    assert (s["state"], s["hand"]) == (RESTING, 0.0)
    assert s["zero"] == s["zero_before"] == pytest.approx(-0.03)
    c, s = law(STARTING, raw=-9.0, since=19)
    listen(c, s)
    assert s["zero"] == pytest.approx(0.1)  # no more than friction can hold


def test_a_tare_begins_at_rest_and_untouched_only() -> None:
    for numbers in ({"state": GUIDING}, {"zero_variance": 1e-9}):
        c, s = law(**numbers)
        assert not tare(c, s)
    c, s = law(hand=-0.0141)
    assert not tare(c, s)
    assert s["outcome"] == TOUCHED
    c, s = law(hand=0.0139, anchor=0.3, zero=0.01, bias=0.02, w=1.0, outcome=TOUCHED)
    assert tare(c, s)
    assert (s["state"], s["way"], s["x"], s["outcome"], s["zero_before"]) == (
        TARING,
        -1.0,
        0.3,
        USED,
        0.01,
    )
    assert not any(s[name] for name in ("hand", "w", "zero", "bias", "since"))
    np.testing.assert_array_equal(s["information"], np.eye(4))
    c, s = law(anchor=-0.3)
    tare(c, s)
    assert s["way"] == 1.0  # towards the middle


TRUE = {"load": 0.01, "level": -0.15, "damping": 0.1}


def weights(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the sums of a tare: two periods lie between them."""
    turns = np.diff(rows[:, 1], prepend=0.0) * 0.02 / 0.02
    return np.asarray(1.0 / (0.03**2 + (0.5 * rows[:, 2]) ** 2 + turns**2))


def swept(
    touch: tuple[int, int, float] = (0, 0, 0.0),
    left: float = 0.0,
    load: float = TRUE["load"],
    lasts: int = 2,
) -> tuple[Any, list[float], NDArray[np.float64]]:
    """A tare of an axis that follows at once: its friction is off by `TRUE`, and what is left alternates."""
    c, s = law(anchor=0.3)
    assert tare(c, s)
    path, heard = [], []
    for k in range(400):
        w = float(s["w"])
        elastic, damping = math.copysign(0.05, w), 0.1 * w / 0.4
        hand = touch[2] if touch[0] <= k < touch[1] else 0.0
        wrong = load + TRUE["level"] * elastic + TRUE["damping"] * damping
        plain = -wrong + hand + left * (-1.0) ** (k // lasts)
        felt = 1.0 - 2.0 * abs(w)
        motor = (wrong - hand) / 2.0
        place = kernel.act(c, s, float(s["x"]), w, motor, plain, elastic, damping, 0.99, felt)
        path.append(place)
        heard.append((1.0, elastic, damping, 0.99 ** (k + 1) * felt, -plain))
        if s["state"] != TARING:
            return s, path, np.array(heard)
    raise AssertionError("it never ends")


def test_a_tare_learns_load_level_and_damping() -> None:
    """Least squares of every second sample of both cycles, three noises, half the damping and what a turn may
    be late by uncertain, with what is known before."""
    s, path, heard = swept()
    assert len(path) == 2 * 80 + 9
    assert s["outcome"] == USED
    assert (s["state"], s["grip"], s["turn"]) == (RESTING, GONE, 0)  # the uncertainty is known anew at once
    rows, target = heard[:160:2, :4], heard[:160:2, 4]
    weight = 2.0 * weights(rows)
    information = np.diag(1.0 / np.array(AXIS["prior"]) ** 2) + (rows * weight[:, None]).T @ rows
    found = np.linalg.solve(information, rows.T @ (weight * target))
    np.testing.assert_allclose(s["learned"][:3], found[:3], rtol=1e-9)
    np.testing.assert_allclose(s["learned"][:3], list(TRUE.values()), atol=0.06)
    assert s["zero_before"] == pytest.approx(found[3] * 0.99**169, abs=1e-9)
    assert np.ptp(path) == pytest.approx(2.0 * 0.4 * 0.01 / AXIS["tare_turn"] + 0.05 * 0.4, rel=0.15)
    assert path[-1] == 0.3
    assert np.all(np.diag(s["spread"])[:3] < 0.6)
    assert s["zero_variance"] > 0.0


@pytest.mark.parametrize("hand", [0.06, -0.06])
def test_a_hand_in_one_cycle_is_found(hand: float) -> None:
    s, _, _ = swept((95, 115, hand))
    assert s["outcome"] == TOUCHED
    assert not s["learned"].any()
    assert s["grip"] == MAY_HOLD


def test_the_first_part_of_a_tare_comes_from_rest_and_is_compared_with_none() -> None:
    s, _, heard = swept((0, 10, 0.06))
    assert s["outcome"] == USED
    parts = heard[80:160, 4].reshape(8, 10).mean(axis=1) / 2.0  # of the motor, A
    np.testing.assert_allclose(s["means"], parts, rtol=1e-9)


def test_what_the_model_cannot_explain_is_not_learned() -> None:
    s, _, _ = swept(left=0.045)
    assert s["outcome"] == NOT_EXPLAINED
    assert not s["learned"].any()
    s, _, heard = swept(left=0.035)
    assert s["outcome"] == USED
    rows, target = heard[:160:2, :4], heard[:160:2, 4]
    left = target - rows[:, :3] @ s["learned"][:3] - rows[:, 3] * s["zero_before"] / 0.99**169
    weight = weights(rows)
    square = np.sum(weight * left**2) / np.sum(weight)
    jumps = np.diff(target, prepend=0.0) ** 2
    noise = 0.5 * np.sum(weight * jumps) / np.sum(weight)
    assert noise > 0.01**2
    assert s["unexplained"] ** 2 == pytest.approx(max(square - noise, 0.0), rel=1e-6)


def test_what_differs_from_sample_to_sample_is_noise_and_what_lasts_is_not() -> None:
    """0.035 N m that alternates with every sum, and with every fourth."""
    fast, _, _ = swept(left=0.035)
    slow, _, _ = swept(left=0.035, lasts=8)
    assert fast["unexplained"] == 0.0
    assert slow["unexplained"] > 0.02


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_another_load_is_refused_and_left_to_the_hand(sign: float) -> None:
    s, _, _ = swept(load=0.05 * sign)
    assert s["outcome"] == OTHER_LOAD
    assert not s["learned"].any()
    assert s["load"] == pytest.approx(0.05 * sign, rel=0.2)
    assert s["unexplained"] == pytest.approx(abs(s["load"]))


def test_each_state_does_its_own_and_nothing_else() -> None:
    """One sample without a hand, in every state."""
    for state, command in ((RESTING, 0.2), (STARTING, 0.2), (STOPPING, 0.2 + 0.006 * 0.3)):
        c, s = law(state, limited=1)
        assert kernel.act(c, s, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0) == pytest.approx(command)
        assert (s["state"], s["limited"]) == (state, 0)
    c, s = law(GUIDING, hand=0.2, way=1.0)
    kernel.act(c, s, 0.2, 0.0, 0.0, 0.2, 0.0, 0.0, 1.0, 1.0)
    assert s["w"] > 0.0
