"""The integration of an axis: what stands below break-away stands exactly, and derivatives are its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.model import forward, tabulated
from idtool.model.motion import Array

POSITIONS, VELOCITIES = np.linspace(-5.0, 5.0, 401), np.linspace(-20.0, 20.0, 201)
#: Every number that a fit varies, and a size of each table's part.
VARIED = [
    tabulated.INERTIA,
    tabulated.COULOMB,
    tabulated.STATIC,
    tabulated.STRIBECK,
    tabulated.VISCOUS,
    tabulated.VISCOUS_OFF,
    tabulated.DEAD_BAND,
    tabulated.BEND,
]
PARTS = range(tabulated.FIELDS + 1)
CLOCK = np.arange(0.0, 1.0, 0.004)


def plant(**more: float) -> tabulated.Plant:
    """An axis with something in every table."""
    n = np.zeros(tabulated.NUMBERS)
    known = {
        "inertia": 0.01,
        "coulomb": 0.1,
        "static": 0.16,
        "stribeck": 1.5,
        "exponent": 2.0,
        "viscous": 0.02,
    }
    known |= {"viscous_off": 0.01, "dead_band": 0.02, "bend": 0.3, "limit": 1e300, "saturation": 0.05}
    for name, value in (known | more).items():
        n[getattr(forward, name.upper())] = value
    n[tabulated.FIRST_POSITION], n[tabulated.POSITION_STEP] = POSITIONS[0], POSITIONS[1] - POSITIONS[0]
    n[tabulated.FIRST_VELOCITY], n[tabulated.VELOCITY_STEP] = VELOCITIES[0], VELOCITIES[1] - VELOCITIES[0]
    n[tabulated.TIME_STEP] = 1e-3
    one = tabulated.Plant(n, np.zeros((len(POSITIONS), 2 * tabulated.FIELDS)), np.zeros(len(VELOCITIES)))
    for part in PARTS:
        one = with_more(one, part, 1.0)
    return one


def with_more(one: tabulated.Plant, part: int, size: float) -> tabulated.Plant:
    """A little more of a table: a field over the position, or behind these the torque over velocity."""
    if part == tabulated.FIELDS:
        return replace(one, over_velocity=one.over_velocity + size * 1e-3 * VELOCITIES * np.abs(VELOCITIES))
    table = one.over_position.copy()
    table[:, part] += size * 0.05 * np.sin(POSITIONS)
    table[:, tabulated.FIELDS + part] += size * 0.05 * np.cos(2.0 * POSITIONS)
    return replace(one, over_position=table)


def with_number(one: tabulated.Plant, number: int, size: float) -> tabulated.Plant:
    numbers = one.numbers.copy()
    numbers[number] += size
    return replace(one, numbers=numbers)


def further(one: tabulated.Plant, step: float) -> list[tabulated.Plant]:
    """Plants a step further on along every number and every table."""
    numbers = [with_number(one, number, step) for number in VARIED]
    return [*numbers, *(with_more(one, part, step) for part in PARTS)]


def run(one: tabulated.Plant, by_goal: bool, slopes: tabulated.Slopes | None = None) -> tuple[Array, Array]:
    given = 0.9 * np.sin(9.0 * CLOCK) + 0.2
    on = np.where((CLOCK > 0.7) & (CLOCK < 0.8), 0.0, 1.0)
    along = np.empty((len(CLOCK), 0 if slopes is None else slopes.count))
    start = np.array([[0.3, 1.0, 0.0], [-0.2, -2.0, 0.0]])
    path = forward.simulate(
        one,
        CLOCK,
        given,
        1.5 + 0.1 * CLOCK,
        on,
        0.0 * CLOCK,
        np.array([0, 110]),
        start,
        by_goal=by_goal,
        slopes=slopes,
        along=along,
    )
    return path[:, 0], along


AXES = {
    "effort": (plant(), False),
    "goal": (plant(position_gain=3.0, velocity_gain=0.05), True),
    "bristle": (plant(sigma0=30.0, sigma1=0.1, dead_band=0.0), False),
    "exponent": (plant(exponent=1.5, sigma0=30.0, sigma1=0.1, position_gain=3.0), True),
}


@pytest.mark.parametrize("case", AXES)
def test_derivatives_are_those_of_the_steps_taken(case: str) -> None:
    """As differences over a step so small that nothing that slid stands."""
    one, by_goal = AXES[case]
    step = 1e-8
    slopes = tabulated.Slopes.between(one, further(one, step), [step] * len(further(one, step)))
    path, along = run(one, by_goal, slopes)
    assert np.array_equal(path, run(one, by_goal)[0])
    ups, downs = further(one, step), further(one, -step)
    found = np.column_stack(
        [run(a, by_goal)[0] - run(b, by_goal)[0] for a, b in zip(ups, downs, strict=True)]
    )
    found /= 2.0 * step
    size = np.abs(found).max(axis=0)
    assert size.min() > 1e-4
    assert np.all(np.abs(along - found).max(axis=0) <= 1e-4 * size + 1e-6)


def test_what_does_not_change_has_no_term() -> None:
    one = plant()
    slopes = tabulated.Slopes.between(
        one, [with_number(one, tabulated.STATIC, 1e-6), with_more(one, 2, 1e-6)], [1e-6] * 2
    )
    assert slopes.number_of.tolist() == [[0, tabulated.STATIC]]
    assert slopes.field_of.tolist() == [[1, tabulated.LEVEL_TORQUE]]
    assert len(slopes.torque_of) == 0


def test_an_axis_below_break_away_stands_exactly() -> None:
    numbers = np.zeros(tabulated.NUMBERS)
    numbers[[tabulated.INERTIA, tabulated.COULOMB, tabulated.STATIC, tabulated.STRIBECK]] = (
        0.01,
        0.1,
        0.15,
        0.05,
    )
    numbers[tabulated.EXPONENT], numbers[tabulated.POSITION_STEP] = 2.0, 1.0
    numbers[[tabulated.FIRST_POSITION, tabulated.VELOCITY_STEP]] = -5.0, 1.0
    still = tabulated.Plant(numbers, np.zeros((11, 2 * tabulated.FIELDS)), np.zeros(2))
    clock = np.arange(0.0, 4.0, 0.01)
    torque = np.where(clock < 0.2, 0.6, 0.14 * np.sin(20.0 * clock))  # a push, then below break-away
    rest = np.zeros(len(clock))
    more = with_number(still, tabulated.COULOMB, 1e-6)
    along = np.empty((len(clock), 1))
    path = forward.simulate(
        still,
        clock,
        torque,
        rest + 1.0,
        rest + 1.0,
        rest,
        np.array([0]),
        np.zeros((1, 3)),
        by_goal=False,
        slopes=tabulated.Slopes.between(still, [more], [1e-6]),
        along=along,
    )
    last = path[clock > 3.0]
    assert path[clock < 0.2, 1].max() > 1.0
    assert (last[:, 1] == 0.0).all()
    assert np.ptp(last[:, 0]) == 0.0
    assert along[-1, 0] < 0.0
    assert np.ptp(along[clock > 3.0]) == 0.0
