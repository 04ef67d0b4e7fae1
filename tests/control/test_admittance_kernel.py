"""The compiled admittance law: what it feels and how it rests, against numbers worked out by hand.

How it moves is in `test_admittance_motion`, sessions on simulated axes in `test_admittance`.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from idtool.control.admittance.constants import CONSTANTS, constants_of
from idtool.control.admittance.hand import sense, uncertainty, watch
from idtool.control.admittance.motion import certain
from idtool.control.admittance.record import NOT_EXPLAINED, OTHER_LOAD, TOUCHED
from idtool.control.admittance.rest import hold, rest
from idtool.control.admittance.states import GONE, GUIDING, MAY_HOLD, RESTING, SEEMS_GONE, STOPPING, TARING

from .kernel_law import AXIS, law


def test_the_record_counts_in_noises_and_periods() -> None:
    c = constants_of(AXIS)
    assert c["floor"] == pytest.approx(0.018)
    assert c["jump"] == pytest.approx(0.055)
    assert c["stop_noise"] == pytest.approx(0.01)
    assert c["bias_most"] == pytest.approx(0.01)
    assert c["virtual"] == pytest.approx(1.0 - math.exp(-0.01 / 0.15))
    assert c["follows"] == pytest.approx(1.0 - math.exp(-0.4))
    assert c["hand_filter"] == pytest.approx(1.0 - math.exp(-0.5))
    assert c["least_time"] == pytest.approx(1.0 - math.exp(-0.01 / 0.15))
    assert c["bias_time"] == pytest.approx(0.01 / 2.5)
    assert c["zero_time"] == pytest.approx(0.01 / 30.0)
    assert (c["coverage"], c["left"], c["seems"]) == (2.0, 0.65, 0.55)


def test_bias_never_takes_all_of_the_floor() -> None:
    """Or a hand as light as the floor would be learned away while it pushes."""
    assert CONSTANTS["bias_most"].value < CONSTANTS["floor"].value


def test_the_speed_is_what_was_asked_for_late_and_a_share_of_what_is_measured() -> None:
    c, s = law(w=0.2, nominal=0.1, seen=0.1)
    nominal = 0.1 * (1.0 - math.exp(-0.4))
    change = nominal + 0.15 * (0.3 - 0.1 - nominal)
    assert watch(c, s, 0.3) == pytest.approx(change)
    assert s["nominal"] == pytest.approx(0.1 + nominal)
    assert s["seen"] == pytest.approx(0.1 + change)


def test_a_reading_that_is_late_is_compared_with_what_was_told_then() -> None:
    """Told 0.1 rad/s more, it follows by 0.1 (1 - e^-0.4), of which readings 20 ms late show a share."""
    c, s = law(GUIDING, w=0.2, nominal=0.1, reported=0.1, seen=0.1)
    c["reports"] = 1.0 - math.exp(-0.5)
    nominal = 0.1 * (1.0 - math.exp(-0.4))
    shown = 0.1 + nominal * (1.0 - math.exp(-0.5))
    assert watch(c, s, shown) == pytest.approx(nominal)  # as was told: nothing is learned of it
    assert s["reported"] == pytest.approx(shown)
    s["state"] = STOPPING  # how a brake brings it to rest is the drive's: nothing is carried forward
    watch(c, s, 0.0)
    assert s["reported"] == s["nominal"] > 0.0


def test_before_a_tare_two_standard_deviations_are_left_to_the_hand() -> None:
    c, s = law(elastic=0.05, damping=-0.1)
    expected = 2.0 * math.sqrt(0.02**2 + (0.2 * 0.05) ** 2 + (0.25 * 0.1) ** 2)
    assert uncertainty(c, s) == pytest.approx(expected)
    s["unexplained"] = 0.04
    assert uncertainty(c, s) == pytest.approx(2.0 * math.hypot(0.5 * expected, 0.04))
    s["unexplained"], s["spread"][:] = 0.0, 0.0
    assert uncertainty(c, s) == pytest.approx(0.018)  # the floor


def sensed(c: Any, s: Any, plain: float, kept: float = 1.0, felt: float = 1.0) -> float:
    sense(c, s, plain, 0.05, 0.1, kept, felt)
    return float(s["raw"])


def test_the_hand_is_the_model_with_what_was_learned() -> None:
    c, s = law(zero=0.002, zero_before=0.001, bias=0.004)
    s["learned"][:3] = 0.003, 0.1, 0.2
    assert sensed(c, s, 0.01, kept=0.5) == pytest.approx(0.01 + 0.003 + 0.005 + 0.02 + 0.001)
    assert (s["zero"], s["zero_before"]) == pytest.approx((0.001, 0.0005))
    s["state"] = GUIDING
    assert sensed(c, s, 0.01) == pytest.approx(0.01 + 0.003 + 0.005 + 0.02 + 0.001 + 0.004)
    assert s["zero_before"] == pytest.approx(0.0005)


def test_a_steady_hand_is_felt_through_its_filter() -> None:
    c, s = law(hand=0.1)
    sensed(c, s, 0.12)
    assert s["hand"] == pytest.approx(0.1 + 0.02 * (1.0 - math.exp(-0.5)))
    assert s["least"] == pytest.approx((1.0 - math.exp(-0.01 / 0.15)) * s["hand"])


@pytest.mark.parametrize(
    ("hand", "falls_to", "leaves"),
    [
        (0.10, 0.034, True),  # by two thirds
        (0.10, 0.036, False),  # by less
        (-0.10, -0.034, True),  # the other way
        (-0.10, -0.036, False),
        (0.07, 0.017, False),  # by three quarters, but within the noise
        (0.10, 0.30, False),  # more of it
    ],
)
def test_a_hand_that_falls_within_a_sample_has_left(hand: float, falls_to: float, leaves: bool) -> None:
    c, s = law(GUIDING, hand=hand, way=math.copysign(1.0, hand), pushed=7)
    sensed(c, s, falls_to)
    assert s["grip"] == (GONE if leaves else MAY_HOLD)
    if leaves:
        assert s["hand"] == pytest.approx(falls_to)  # no filter delays that it left
        assert s["pushed"] == 0


@pytest.mark.parametrize(
    ("least", "falls_to", "seems"), [(0.15, 0.067, True), (0.15, 0.068, False), (0.09, 0.036, False)]
)
def test_a_hand_below_its_least_of_late_seems_to_leave(least: float, falls_to: float, seems: bool) -> None:
    c, s = law(GUIDING, hand=falls_to, least_1=least, least_2=least, way=1.0)
    sensed(c, s, falls_to)
    assert s["grip"] == (SEEMS_GONE if seems else MAY_HOLD)
    assert s["least_2"] == (0.0 if seems else least)  # forgotten once it was seen


def test_the_least_push_of_late_is_two_samples_old_and_never_negative() -> None:
    c, s = law(hand=0.1, least=0.05, least_1=0.04)
    sensed(c, s, 0.1)
    assert (s["least_2"], s["least_1"]) == (0.04, 0.05)
    assert s["least"] == pytest.approx(0.05 + (1.0 - math.exp(-0.01 / 0.15)) * 0.05)
    c, s = law(hand=0.01, least=0.02)
    sensed(c, s, -0.045)
    assert s["raw"] == -0.045
    assert (s["grip"], s["least"]) == (MAY_HOLD, 0.0)


def test_a_hand_that_leaves_a_resting_axis_opens_the_zero_once() -> None:
    c, s = law(hand=0.2, zero=0.003)
    sensed(c, s, 0.01)
    most = 0.02**2 + 0.01**2
    assert (s["grip"], s["zero_variance"]) == (GONE, pytest.approx(most))
    assert s["zero_before"] == 0.003
    c, s = law(hand=0.2, zero_variance=1e-4)
    sensed(c, s, 0.01)
    assert (s["grip"], s["zero_variance"]) == (MAY_HOLD, 1e-4)


def test_the_uncertainty_is_that_of_every_other_sample_and_of_the_last_motion_at_rest() -> None:
    for state, turn, dead, anew in (
        (GUIDING, 0, 0.5, True),
        (GUIDING, 1, 0.5, False),
        (STOPPING, 0, 0.5, True),
        (RESTING, 0, 0.5, False),
        (RESTING, 0, 0.0, True),  # not known yet
    ):
        c, s = law(state, turn=turn, dead=dead)
        sensed(c, s, 0.0)
        assert s["dead"] == (uncertainty(c, s) if anew else dead), (state, turn)


def test_in_a_tare_what_was_learned_waits_outside() -> None:
    c, s = law(TARING, zero=0.01, zero_before=0.02, fade=0.5, hand=0.3)
    s["learned"][:3] = 1.0
    assert sensed(c, s, 0.07, kept=0.5) == 0.07
    assert (s["fade"], s["zero_before"], s["correction"], s["hand"]) == (0.25, 0.01, 0.0, 0.3)


def test_two_samples_beyond_what_a_rest_may_be_wrong_by_start_a_motion() -> None:
    """The bound at rest is root(0.02^2 + 0.01^2) = 0.0224, the starting torque 0.014 beyond it; once a hand
    is known to be gone it is the floor of 0.018 of a motion."""
    for hand, starts in ((0.0363, False), (0.0365, True), (-0.0365, True)):
        c, s = law(hand=hand, anchor=0.3, w=0.4)
        assert rest(c, s) == 0.3
        assert (s["state"], s["pushed"]) == (RESTING, int(starts))
        rest(c, s)
        assert s["state"] == (GUIDING if starts else RESTING)
        if starts:
            assert (s["x"], s["w"], s["way"], s["grip"]) == (0.3, 0.0, math.copysign(1.0, hand), MAY_HOLD)
    for grip, variance, starts in ((GONE, 0.0, True), (SEEMS_GONE, 0.0, False), (GONE, 1e-4, False)):
        c, s = law(hand=0.0325, grip=grip, zero_variance=variance)
        rest(c, s)
        assert s["pushed"] == starts
    c, s = law(hand=0.0365, dead=0.03)  # a less certain model leaves more
    rest(c, s)
    assert s["pushed"] == 0
    c, s = law(hand=0.0365, unexplained=0.01)
    rest(c, s)
    assert s["pushed"] == 0
    c, s = law(hand=0.0365, pushed=1)
    s["hand"] = 0.0
    rest(c, s)
    assert s["pushed"] == 0  # not in turns


def test_what_is_felt_all_the_time_starts_a_motion_only_beyond_half_as_much_again() -> None:
    """1.5 times 0.0224 and the starting torque: 0.0475. What came of late is twice that torque, 0.028,
    beyond what is usual."""
    for hand, usual, starts in (
        (0.045, 0.045, False),
        (0.047, 0.045, False),
        (0.048, 0.048, True),
        (0.045, 0.018, False),
        (0.045, 0.016, True),
        (-0.045, -0.045, False),
        (-0.045, -0.016, True),
        (-0.045, 0.045, True),
    ):
        c, s = law(hand=hand, usual=usual, raw=usual)
        rest(c, s)
        assert s["pushed"] == starts, (hand, usual)


def test_what_is_usual_is_a_mean_that_is_taken_with_the_zero_and_follows_it() -> None:
    c, s = law(raw=0.02, usual=0.01)
    rest(c, s)
    assert s["usual"] - s["zero"] == pytest.approx(
        0.01 + 0.01 * (1.0 - math.exp(-0.005))
    )  # within two seconds
    c, s = law(raw=0.02, usual=-0.03, zero_variance=4e-4)  # an eased hand: the zero stays, this does not
    rest(c, s)
    assert (s["zero"], s["usual"]) == (0.0, pytest.approx(-0.03 + 0.05 * 4e-4 / 5e-4))
    _, s = law(GUIDING, usual=0.02)
    hold(s)  # what is felt once it is let go is a hand
    assert s["usual"] == 0.0


def test_a_zero_that_is_taken_anew_is_a_mean() -> None:
    c, s = law(zero_variance=4e-4, zero_before=0.001, zero=0.001, raw=0.01, grip=GONE, hand=0.01)
    rest(c, s)
    gain = 4e-4 / (4e-4 + 1e-4)
    assert s["zero"] == pytest.approx(0.001 - gain * 0.01)
    assert s["hand"] == pytest.approx(0.01 - gain * 0.01)
    assert s["zero_variance"] == pytest.approx(4e-4 * (1.0 - gain))
    s["raw"] = 10.0
    rest(c, s)
    assert s["zero"] == pytest.approx(0.001 - math.hypot(0.02, 0.01))  # and no further than a stop leaves
    for _ in range(20):
        rest(c, s)
    assert s["zero_variance"] == 0.0
    c, s = law(zero_variance=1e-4 / 11.5, raw=0.01)  # nobody left: the zero stays, and is known after 12
    rest(c, s)
    assert (s["zero"], s["zero_variance"]) == (0.0, 0.0)
    c, s = law(zero_variance=1e-4 / 10.5, raw=0.01)
    rest(c, s)
    assert s["zero_variance"] == pytest.approx(1e-4 / 11.5)


def test_the_zero_then_follows_over_half_a_minute() -> None:
    c, s = law(raw=0.02, zero=0.004)
    rest(c, s)
    assert s["zero"] == pytest.approx(0.004 - 0.02 * 0.01 / 30.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_what_stays_as_it_is_for_a_second_is_taken_once_and_starts_nothing_should_it_leave(
    sign: float,
) -> None:
    """A hundred samples within one noise of what is usual; of 0.03 N m no more than the dead zone's 0.018."""
    c, s = law(raw=sign * 0.03, hand=sign * 0.03, usual=sign * 0.03, since=98)
    s["hand"] = sign * 0.0405  # more than a noise away takes four back
    rest(c, s)
    assert (s["since"], s["grip"]) == (94, MAY_HOLD)
    s["since"] = 3
    rest(c, s)
    assert s["since"] == 0
    s["since"], s["hand"] = 98, sign * 0.0395
    rest(c, s)
    assert (s["since"], s["grip"]) == (99, MAY_HOLD)
    zero, s["usual"] = float(s["zero"]), sign * 0.03
    rest(c, s)
    assert s["grip"] == GONE
    assert s["zero"] - zero == pytest.approx(-sign * 0.018, rel=0.01)
    zero = float(s["zero"])
    for _ in range(300):
        rest(c, s)
    assert abs(s["zero"] - zero) < 0.003  # the half minute's
    c, s = law(raw=0.03, hand=0.03, usual=0.03, since=99, outcome=TOUCHED)
    rest(c, s)
    assert s["grip"] == GONE  # a tare that something touched changed nothing
    for unknown in ({"outcome": NOT_EXPLAINED}, {"outcome": OTHER_LOAD}, {"zero_variance": 1.0}):
        c, s = law(raw=0.03, hand=0.03, usual=0.03, since=99, **unknown)
        rest(c, s)
        assert s["grip"] == MAY_HOLD


def test_a_zero_that_is_not_known_asks_more_of_a_hand() -> None:
    c, s = law(hand=0.05, zero_variance=1e-3)
    rest(c, s)
    assert s["pushed"] == 0
    c, s = law(hand=0.2, zero_variance=1e-3)
    rest(c, s)
    assert s["pushed"] == 1


def test_held_from_outside_it_starts_on_nothing_that_was_felt() -> None:
    _, s = law(GUIDING, w=1.0, hand=1.0, pushed=1, since=50, least=1.0, least_1=1.0, least_2=1.0)
    hold(s)
    assert s["state"] == RESTING
    assert not any(s[name] for name in ("w", "hand", "pushed", "since", "least", "least_1", "least_2"))


@pytest.mark.parametrize(("torque", "sure"), [(0.05, 0.03), (-0.05, -0.03), (0.02, 0.0), (-0.01, 0.0)])
def test_what_is_certain_is_what_is_left_of_it(torque: float, sure: float) -> None:
    assert certain(torque, 0.02) == pytest.approx(sure)
