"""Waves of a ripple are counted per turn of a rotary axis and per metre of a linear one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool import Log, identify
from idtool.effects import registry
from idtool.effects.position_ripple import PositionRipple
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion
from idtool.model.torque import Friction
from idtool.model.torque import predict as torque
from idtool.verbs.predict import predict

WAVES = 25.0
#: What else there is has tests of its own.
OTHERS = tuple(name for name in registry.names() if name not in ("inertia", "position_ripple"))


def there_and_back(path: Path, kind: str) -> Log:
    """Slow and fast moves over 0.6 of a unit of travel: friction, mass, a ripple of a quarter of Coulomb."""
    n = WAVES * (2.0 * np.pi if kind == "linear" else 1.0)
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 20.0, 0.01)
    friction = Friction(1.0, 1.0, 0.1, 2.0, 1000.0, 0.0)
    rows = []
    for trial, frequency in enumerate((0.05, 0.1, 0.15, 0.2, 0.25, 0.3)):
        omega = 2.0 * np.pi * frequency
        position, velocity = 0.3 * np.cos(omega * time), -0.3 * omega * np.sin(omega * time)
        motion = Motion(time, np.zeros(len(time), dtype=np.intp), position, velocity, -(omega**2) * position)
        effort = torque(motion, friction, Contribution(torque=-0.5 * omega**2 * position), np.zeros(1)).torque
        effort += 0.25 * np.sin(n * position + 0.5) + 0.01 * rng.standard_normal(len(time))
        rows += [
            np.column_stack([np.full(len(time), trial), time + 30.0 * trial, position, velocity, effort])
        ]
    names = "position_m,velocity_m_s,force_n" if kind == "linear" else "position_rad,velocity_rad_s,torque_nm"
    np.savetxt(path, np.vstack(rows), delimiter=",", header=f"trial,time_s,{names}", comments="", fmt="%.9g")
    return Log.read(path)


@pytest.mark.parametrize(
    ("kind", "key", "without"), [("rotary", "cycles_per_turn", ()), ("linear", "cycles_per_m", OTHERS)]
)
def test_waves_are_counted_in_the_unit_of_the_file(
    tmp_path: Path, kind: str, key: str, without: tuple[str, ...]
) -> None:
    log = there_and_back(tmp_path / "log.csv", kind)
    result = identify([log], seed=0, without=without)
    (ripple,) = (e for e in result.diagnosis["effects"] if e["name"] == "position_ripple")
    assert ripple["parameters"][key]["value"] == pytest.approx(WAVES, rel=0.01)
    low, high = ripple["parameters"][key]["ci95"]
    assert low < WAVES < high < 1.02 * WAVES
    others = tuple(e for e in result.parameters.effects if e.name != "position_ripple")
    smooth = replace(result.parameters, effects=others)
    (error,), (plain,) = (predict([log], file).errors.values() for file in (result.parameters, smooth))
    assert error["rmse"] ** 2 < plain["rmse"] ** 2 - 0.9 * 0.25**2 / 2.0


@pytest.mark.parametrize(("cycles", "twin"), [(10.9, True), (10.4, False)], ids=["twins", "apart"])
def test_a_second_harmonic_that_another_family_has_goes(cycles: float, twin: bool) -> None:
    """Lines that are less than a wave apart over the stroke could be of any size, and cancel each other."""
    time = np.linspace(0.0, 2.0 * np.pi, 500)
    motion = Motion(time, np.zeros(500, dtype=int), np.pi * np.sin(time), np.cos(time), -np.sin(time))
    effect = PositionRipple((True, True))
    values = {c.name: 0.01 * (k + 1) for k, c in enumerate(effect.active(motion))}
    values |= {"cycles": 22.0, "family_2_cycles": cycles}
    found = effect.plainer(values, {}, motion)
    if not twin:
        assert found is None
        return
    assert found is not None
    plain, moved = found
    assert plain == PositionRipple((True, True), pure=(2,))
    assert moved == pytest.approx(
        {
            f"position_ripple.{part}_1": values[f"{part}_1"] + values[f"family_2_{part}_2"]
            for part in ("sin", "cos")
        }
    )
    assert "family_2_sin_2" not in {c.name for c in plain.active(motion)}
    kept = {name: value for name, value in values.items() if name in {c.name for c in plain.active(motion)}}
    assert plain.form_of(plain.to_values(plain.to_parameters(kept))) == plain
    assert plain.plainer(kept, {}, motion) is None
    assert all(more.pure == (2,) for more in plain.larger(motion))


@pytest.mark.parametrize("coordinate", ["cycles", "family_2_cycles"])
def test_slope_along_the_frequency_is_that_of_contribute(coordinate: str) -> None:
    """Of a family whose friction has the line too, and of one beside it."""
    t = np.linspace(0.0, 3.0, 300)
    motion = Motion(t, np.zeros(300, dtype=int), np.sin(t), np.cos(t), -np.sin(t))
    effect = PositionRipple((False, True))
    values = {c.name: 0.01 * (k + 1) for k, c in enumerate(effect.active(motion))}
    values |= {"cycles": 11.0, "family_2_cycles": 17.0}
    change = effect.slope(motion, values, coordinate)
    high, low = (
        effect.contribute(motion, values | {coordinate: values[coordinate] + sign * 1e-5}) for sign in (1, -1)
    )
    for name in ("torque", "level_torque"):
        expected = (np.asarray(getattr(high, name)) - getattr(low, name)) / 2e-5
        np.testing.assert_allclose(
            getattr(change, name), expected, atol=1e-7 * np.max(np.abs(expected)) + 1e-9
        )


def test_the_shortest_wave_is_one_that_the_travel_samples() -> None:
    """Rests, where the last count of an encoder chatters, take no part: the axis gets nowhere in them."""
    period, speed, count = 0.01, 0.23, 4.8e-5
    ways = [np.tile([speed, -speed], 5).repeat(150), np.zeros(4000)]
    velocity = np.concatenate(ways)
    position = period * np.cumsum(velocity) + count * (np.arange(len(velocity)) % 2)
    time = period * np.arange(len(velocity))
    # a slope over a few rows, as a recording has it
    seen = np.convolve(np.gradient(position, period), np.full(9, 1.0 / 9.0), "same")
    motion = Motion(time, np.zeros(len(time), dtype=np.intp), position, seen, np.gradient(seen, period))
    highest = PositionRipple().wave(motion).highest
    assert highest == pytest.approx(2.0 * np.pi / (6.0 * speed * period), rel=0.1)


def test_a_wave_that_only_a_slow_way_samples_is_looked_for() -> None:
    period, slow, fast = 0.01, 0.05, 1.0
    velocity = np.concatenate([np.full(800, slow), np.full(200, fast)])  # 0.4 rad of 2.4
    time, position = period * np.arange(1000), period * np.cumsum(velocity)
    motion = Motion(time, np.zeros(1000, dtype=np.intp), position, velocity, np.zeros(1000))
    assert PositionRipple().wave(motion).highest == pytest.approx(2.0 * np.pi / (6.0 * slow * period))


def test_an_axis_that_stands_shows_no_wave() -> None:
    still = np.zeros(100)
    motion = Motion(0.01 * np.arange(100), np.zeros(100, dtype=np.intp), still, still, still)
    assert "too coarse over the angle" in str(PositionRipple().untestable(motion))
