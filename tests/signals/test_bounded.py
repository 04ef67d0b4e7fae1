"""The lowest place between two bounds, beside scipy's."""

from __future__ import annotations

import math

import pytest
from scipy import optimize

from idtool.signals.bounded import bounded_minimum

COSTS = {
    "parabola": lambda x: (x - 1.3) ** 2,
    "corner": lambda x: abs(x - 2.7) + 0.1 * x,
    "falls": lambda x: -x,
    "rises": math.exp,
    "flat": lambda x: 0.0,
    "waves": lambda x: math.sin(3.0 * x) + 0.1 * x,
    "steep": lambda x: x**4 - math.log(6.0 + x),
    "steps": lambda x: round(x) ** 2,
}


@pytest.mark.parametrize("name", COSTS)
@pytest.mark.parametrize(("low", "high"), [(-5.0, 9.0), (-2.0, 2.0), (0.0, 3.0)])
@pytest.mark.parametrize("within", [0.1, 1e-5])
def test_it_asks_where_scipy_asks_and_ends_there(name: str, low: float, high: float, within: float) -> None:
    asked: list[float] = []
    theirs: list[float] = []

    def cost(x: float, places: list[float]) -> float:
        places.append(float(x))
        return float(COSTS[name](float(x)))

    found = bounded_minimum(lambda x: cost(x, asked), low, high, within=within)
    result = optimize.minimize_scalar(
        lambda x: cost(x, theirs), bounds=(low, high), method="bounded", options={"xatol": within}
    )
    assert found == float(result.x)
    assert asked == theirs
