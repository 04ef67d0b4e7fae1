"""Effects with memory: what they remember, that trials start anew, and that they run sample by sample."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from idtool.effects import registry
from idtool.effects.base import Effect, Past
from idtool.model.contribution import FIELDS, Contribution
from idtool.model.motion import Array, Motion

REMEMBERING = [effect for effect in registry.library() if effect.memory]
VALUES = {
    "backlash": {"share_behind_gap": 0.5, "share_at_once": 0.1, "log_gap": math.log(0.04)},
    "hysteresis": {"yield": 0.05, "log_reach": math.log(0.1)},
    "breakaway_dwell": {
        "gain": 1.0,
        "log_time_constant": 0.0,
        "rest_speed": 0.01,
        "log_wear": math.log(0.02),
    },
    "compliance": {"load_inertia": 0.02, "log_omega": math.log(20.0), "damping_ratio": 0.1},
}
EFFECTS = pytest.mark.parametrize("effect", REMEMBERING, ids=[effect.name for effect in REMEMBERING])


def moved(velocity: Array, step: float = 0.005, trials: int = 1) -> Motion:
    """One motion, repeated as so many trials."""
    n = len(velocity)
    position = np.cumsum(velocity) * step
    return Motion(
        time=np.arange(n * trials, dtype=float) * step,
        trial=np.repeat(np.arange(trials), n).astype(np.intp),
        position=np.tile(position, trials),
        velocity=np.tile(velocity, trials),
        acceleration=np.tile(np.gradient(velocity, step), trials),
    )


def there_and_back() -> Array:
    way = np.concatenate([np.zeros(200), np.full(400, 0.3), np.zeros(100)])
    smooth = np.convolve(np.concatenate([way, -way]), np.hanning(41) / np.hanning(41).sum(), "same")
    return np.asarray(smooth)


def acting(part: Contribution, rows: int) -> dict[str, Array]:
    return {name: np.broadcast_to(getattr(part, name), rows) for name in FIELDS}


@EFFECTS
def test_every_trial_starts_anew(effect: Effect) -> None:
    motion = moved(there_and_back(), trials=2)
    n = len(motion) // 2
    for values in acting(effect.contribute(motion, VALUES[effect.name]), len(motion)).values():
        np.testing.assert_allclose(values[:n], values[n:], atol=1e-12)


@EFFECTS
def test_sample_by_sample_is_the_same(effect: Effect) -> None:
    motion = moved(there_and_back())
    whole = acting(effect.contribute(motion, VALUES[effect.name]), len(motion))
    past = Past(np.ones(1, dtype=bool), np.zeros(1), np.zeros(effect.memory), np.zeros(1))
    for k in range(len(motion)):
        row = Motion(
            **{
                name: getattr(motion, name)[k : k + 1]
                for name in ("time", "trial", "position", "velocity", "acceleration")
            }
        )
        past.step[0] = motion.step[k]
        one = acting(effect.resume(row, VALUES[effect.name], past), 1)
        past.first[0] = False
        for name in FIELDS:
            assert one[name][0] == pytest.approx(whole[name][k], abs=1e-12)


@EFFECTS
def test_parameters_and_values_are_inverse(effect: Effect) -> None:
    values = VALUES[effect.name]
    again = effect.to_values(effect.to_parameters(values))
    assert again == pytest.approx(values)


def test_compliance_is_inertia_when_slow_and_resonates() -> None:
    effect, values = registry.get("compliance"), VALUES["compliance"]
    time = 0.002 * np.arange(20000)

    def gain(omega: float) -> float:
        motion = replace(moved(np.sin(omega * time), 0.002), acceleration=omega * np.cos(omega * time))
        torque = np.asarray(effect.contribute(motion, values).torque)[-5000:]
        return float(np.std(torque) / np.std(0.02 * motion.acceleration[-5000:]))

    def theory(omega: float) -> float:
        spring = 20.0**2 + 2j * 0.1 * 20.0 * omega
        return abs(spring / (spring - omega**2) - 1.0)

    for omega in (1.0, 10.0, 20.0, 40.0):
        assert gain(omega) == pytest.approx(theory(omega), rel=0.02)


def test_backlash_acts_while_the_gap_is_crossed_and_a_load_can_close_it() -> None:
    effect = registry.get("backlash")
    motion = moved(there_and_back())
    change = np.asarray(effect.contribute(motion, VALUES["backlash"]).level_change)
    travelled = motion.position.max() - motion.position[700:]
    inside = (travelled > 0.001) & (travelled < 0.037)
    np.testing.assert_allclose(change[700:][inside], -0.5)
    across = (travelled > 0.0401) & (motion.velocity[700:] < -1e-3)
    np.testing.assert_allclose(change[700:][across], 0.0, atol=1e-12)
    loaded = replace(motion, load=np.full(len(motion), 1.0))
    values = VALUES["backlash"] | {"share_under_load": 0.0, "load_scale": 0.05}
    assert np.max(np.abs(np.asarray(effect.contribute(loaded, values).level_change))) < 1e-6


def test_backlash_starts_where_it_is_told() -> None:
    effect = registry.get("backlash")
    motion = moved(there_and_back(), trials=3)
    n = len(motion) // 3
    # behind the motor by a whole half gap: in contact from the start; ahead by one: a whole gap to cross
    part = effect.from_start(motion, VALUES["backlash"], np.array([1.0, 0.0, -1.0]))
    level = np.broadcast_to(part.level_change, len(motion)).reshape(3, n)
    for row, gap in zip(level, (0.0, 0.02, 0.04), strict=True):
        moving = (motion.position[:n] > 1e-3) & (motion.velocity[:n] > 1e-3)
        np.testing.assert_allclose(row[moving & (motion.position[:n] > gap + 1e-4)], 0.0, atol=1e-12)
        np.testing.assert_allclose(row[moving & (motion.position[:n] < gap - 0.0025)], -0.5)


@pytest.mark.parametrize(
    ("share", "at_once", "sound"), [(0.5, 0.0, True), (0.0, 0.4, True), (-0.03, -0.04, False)]
)
def test_backlash_that_raises_friction_is_none(share: float, at_once: float, sound: bool) -> None:
    values = VALUES["backlash"] | {"share_behind_gap": share, "share_at_once": at_once}
    assert (registry.get("backlash").implausible(values, {}) is None) == sound


def test_no_more_inertia_on_the_spring_than_there_is() -> None:
    effect = registry.get("compliance")
    assert effect.implausible(VALUES["compliance"], {"inertia.inertia": 0.03}) is None
    assert effect.implausible(VALUES["compliance"], {}) is None
    assert "inertia" in (effect.implausible(VALUES["compliance"], {"inertia.inertia": 0.01}) or "")
