"""The motion of the tare, and whether a hand was in it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from idtool.control.tare import CYCLES, PARTS, Tare

from studies.guided_plants import corner
from studies.teach import GAINS, PERIOD
from studies.teach_tare import is_refused, tared

NOISE = 0.008
TRAVEL, SPEED = 0.21, 0.42


@given(st.floats(0.001, 0.06), st.floats(0.01, 1.0), st.floats(0.05, 2.0))
def test_whole_cycles_no_faster_than_asked(period: float, travel: float, speed: float) -> None:
    tare = Tare(travel, speed, period, NOISE)
    assert tare.cycle == PARTS * tare.part
    assert tare.samples == CYCLES * tare.cycle
    assert tare.top <= speed * (1.0 + 1e-9)
    tare.begin(-1.0)
    place, low = 0.0, 0.0
    for k in range(tare.samples):
        assert tare.next(0.0, 0.0) == (k == tare.samples - 1)
        place += tare.speed * period
        low = min(low, place)
    assert place == pytest.approx(0.0, abs=1e-9 * travel)
    # to this side only, and as far as asked but for what a sum of few samples makes of a cosine
    assert -low == pytest.approx(travel, rel=tare.turn**2 / 11.0)


@given(st.integers(0, 2**32 - 1))
def test_whatever_repeats_is_the_axis(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tare = Tare(TRAVEL, SPEED, PERIOD, NOISE)
    once = rng.normal(0.4, 0.3, tare.cycle)
    for torque in np.tile(once, CYCLES) + rng.normal(0.0, NOISE, tare.samples):
        tare.next(float(torque), 0.5)
    assert not tare.touched
    assert tare.remains == pytest.approx(0.25)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0), st.sampled_from([-1.0, 1.0]))
def test_what_comes_once_is_a_hand(seed: int, share: float, way: float) -> None:
    """Four torque noises over three parts, wherever."""
    rng = np.random.default_rng(seed)
    tare = Tare(TRAVEL, SPEED, PERIOD, NOISE)
    torque = np.tile(rng.normal(0.4, 0.3, tare.cycle), CYCLES) + rng.normal(0.0, NOISE, tare.samples)
    first = round(share * (tare.samples - 3 * tare.part))
    torque[first : first + 3 * tare.part] += way * 4.0 * NOISE
    for value in torque:
        tare.next(float(value), 0.0)
    assert tare.touched
    tare.begin(1.0)
    assert not tare.touched


@pytest.mark.parametrize("axis", ["paper", "bench"])
@pytest.mark.parametrize("begin", [0.1, 1.0, 1.7, 2.5])
def test_a_light_touch_is_found(axis: str, begin: float) -> None:
    """1 N for 0.4 s: less than the friction that the axis overcomes meanwhile."""
    case = replace(corner(axis, GAINS, (1, -1, 1), stiff=True, delay=0.01, late=True), seed=int(10 * begin))
    for newton in (-1.0, 1.0):
        assert "disturbed" in " ".join(tared(case, newton, begin, 0.4).status.notes)
    assert not is_refused(tared(case, 0.0, begin, 0.4))
