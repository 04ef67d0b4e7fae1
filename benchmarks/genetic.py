"""A genetic algorithm of the usual kind, from DEAP's own operators."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass

_CROSSOVER, _MUTATION = 0.8, 0.3


@dataclass(frozen=True)
class Outcome:
    """The best point of a search, its cost, and how often the cost was computed."""

    x: list[float]
    cost: float
    evaluations: int


def available() -> bool:
    """Whether DEAP is there."""
    try:
        import deap  # noqa: F401
    except ImportError:
        return False
    return True


def minimise(
    cost: Callable[[Sequence[float]], float],
    bounds: Sequence[tuple[float, float]],
    *,
    population: int = 50,
    generations: int = 100,
) -> Outcome:
    """Blend crossover, Gaussian mutation of a tenth of the range, tournaments of three (`eaSimple`)."""
    from deap import algorithms, base, creator, tools

    random.seed(0)
    if not hasattr(creator, "Smallest"):
        creator.create("Smallest", base.Fitness, weights=(-1.0,))
        creator.create("Point", list, fitness=creator.Smallest)
    evaluations = 0

    def inside(point: Sequence[float]) -> list[float]:
        return [
            low + min(max(u, 0.0), 1.0) * (high - low) for u, (low, high) in zip(point, bounds, strict=True)
        ]

    def evaluate(point: Sequence[float]) -> tuple[float]:
        nonlocal evaluations
        evaluations += 1
        return (cost(inside(point)),)

    toolbox = base.Toolbox()
    toolbox.register("point", tools.initRepeat, creator.Point, random.random, len(bounds))
    toolbox.register("population", tools.initRepeat, list, toolbox.point)
    toolbox.register("evaluate", evaluate)
    toolbox.register("mate", tools.cxBlend, alpha=0.3)
    toolbox.register("mutate", tools.mutGaussian, mu=0.0, sigma=0.1, indpb=0.5)
    toolbox.register("select", tools.selTournament, tournsize=3)
    best = tools.HallOfFame(1)
    algorithms.eaSimple(
        toolbox.population(population),
        toolbox,
        _CROSSOVER,
        _MUTATION,
        generations,
        halloffame=best,
        verbose=False,
    )
    return Outcome(inside(best[0]), best[0].fitness.values[0], evaluations)
