"""`fit-dynamic` on the four sines against what a user would write."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy import optimize

from benchmarks import euler, genetic, skilled, starts
from benchmarks.judge import common_cost, counted
from benchmarks.sessions import known_static, log_of
from benchmarks.table import Goal, Section, number, seconds
from benchmarks.timing import interleaved, once
from idtool.fit.search import Projection
from idtool.fit.staged import DynamicFit, fit_dynamic
from idtool.parameters import Parameters
from idtool.signals import Recording, record

_GA_GOAL, _DE_GOAL, _EVALUATIONS_GOAL = 400.0, 30.0, 3.0
#: SciPy's own defaults, but for the seed.
_DE: dict[str, Any] = {"popsize": 15, "maxiter": 1000, "tol": 0.01, "polish": True}


def measure(
    trials: tuple[int, ...] = (),
    sweep: tuple[int, ...] = (),
    *,
    population: int = 50,
    generations: int = 100,
    most: int = 1000,
    rounds: int = 30,
    seeds: Sequence[int] = (1, 2, 3, 4, 5),
) -> Section:
    """Everything about the dynamic fit; `most` bounds the generations of differential evolution."""
    recording = record([log_of("sine", trials=trials)])
    known = known_static(trials=sweep)
    section = against_euler(
        recording, known, population=population, generations=generations, most=most, rounds=rounds
    )
    section.more += [
        against_same_kernel(recording, known, most=most),
        skilled.measure(recording, known, rounds=rounds),
        skilled.everything_free(
            record([log_of("sweep", trials=sweep), log_of("sine", trials=trials)]), most=min(most, 200)
        ),
        starts.measure(seeds, trials, sweep),
    ]
    return section


def ours(recording: Recording, known: Parameters) -> DynamicFit:
    """`fit-dynamic` with nothing kept from a run before: filter and model are built anew."""
    return fit_dynamic(replace(recording, motion=replace(recording.motion)), known)


def against_euler(
    recording: Recording, known: Parameters, *, population: int, generations: int, most: int, rounds: int
) -> Section:
    """Genetic algorithm and differential evolution over the plain Python loop, each run once and whole."""
    static = {name: parameter.value for name, parameter in known.static.items()}
    cost, quick = euler.usual(recording, static), euler.careful(recording, static)
    middle = [math.log(0.05), 0.3, 0.006]
    best = interleaved(
        {
            "ours": lambda: ours(recording, known),
            "euler": lambda: cost(middle),
            "careful": lambda: quick(middle),
        },
        rounds,
    )
    with counted() as count:
        fit = ours(recording, known).fit
    evaluations = sum(count.values())
    section = Section(
        "fit-dynamic against a search over a plain Python loop",
        [
            "method",
            "unknowns",
            "model evaluations",
            "time",
            "times ours",
            "its own cost",
            "common cost",
            "sigma0",
            "sigma1",
        ],
    )
    own = float(fit.full_residual @ fit.full_residual)
    judged = common_cost(recording, static, *_dynamic(fit.values))
    section.add(
        "fit-dynamic",
        "sigma0, sigma1, inertia, offset, starts",
        evaluations,
        seconds(best["ours"]),
        "1",
        f"{own:.6g}",
        f"{judged:.6g}",
        *_dynamic(fit.values)[:2],
    )
    runs: list[tuple[str, float]] = []

    def add(name: str, x: Sequence[float], value: float, done: int, took: float) -> None:
        point = (math.exp(x[0]), float(x[1]), float(x[2]))
        theirs = common_cost(recording, static, *point)
        ratio = took / best["ours"]
        runs.append(
            (name, ratio if judged <= theirs * (1 + 1e-9) and own <= value * (1 + 1e-9) else math.nan)
        )
        unknowns = "sigma0, sigma1, inertia" + (", starts" if len(x) > 3 else "")
        section.add(
            name, unknowns, done, seconds(took), ratio, f"{value:.6g}", f"{theirs:.6g}", point[0], point[1]
        )

    for with_starts in (False, True):
        box = euler.bounds(recording.trials, starts=with_starts)
        if genetic.available():
            minimise = partial(genetic.minimise, population=population, generations=generations)
            found, took = once(partial(minimise, cost, box))
            add("genetic algorithm (DEAP), Euler", found.x, found.cost, found.evaluations, took)
        result, took = _evolve(cost, box, most if not with_starts else min(most, generations))
        add("differential evolution (SciPy), Euler", result.x, float(result.fun), int(result.nfev), took)
    _explain(section, recording, best, population, generations)
    _goals(section, runs, best)
    return section


def _explain(
    section: Section, recording: Recording, best: Mapping[str, float], population: int, generations: int
) -> None:
    per_row = best["euler"] / len(recording.motion)
    section.notes += [
        f"{len(recording.motion):,} rows in {recording.trials} trials of `sim:paper`; the static parameters "
        "are those of `fit-static`, held. In the same process and warm; velocity and acceleration come from "
        "our smoother, for everybody and not in anybody's time. All searches were run whole, once each, and "
        "their time is that of the processor (ours the shortest of several rounds); no time is extrapolated.",
        "Cost is the sum of squared torque errors over all rows. *Its own cost* is by the method's own "
        "model (explicit Euler, starts at 0 unless they are unknowns; ours with its start deflections). "
        "*Common cost* judges every sigma0, sigma1 and inertia alike: exact integration, best starts, no "
        "offset.",
        "Explicit Euler takes one step a row (5 ms), no substeps. That is stable where sigma0 |w| h / g < "
        "2, here below sigma0 of about 47 N m/rad: true of the paper's 0.051, not of all of the range "
        "searched (0.001 to 1000), where the sum of squares runs away and counts as infinite. A stiff axis "
        "would need substeps, which would make these searches slower still.",
        f"An evaluation of the Python loop takes {seconds(best['euler'])} ({1e9 * per_row:.0f} ns a row). A "
        f"user who computes |w| / g(w) once beforehand needs {seconds(best['careful'])}, "
        f"{best['euler'] / best['careful']:.2f} times less; the genetic algorithm, {population} points over "
        f"{generations} generations, computes the cost of changed points only. With starts as unknowns "
        f"differential evolution was stopped after {generations} generations if it had not converged.",
    ]


def _goals(section: Section, runs: Sequence[tuple[str, float]], best: Mapping[str, float]) -> None:
    speed_up = best["euler"] / best["careful"]
    for word, goal in (("genetic", _GA_GOAL), ("differential", _DE_GOAL)):
        what = (
            f"fit-dynamic against {word} search over Euler, {{}}: {goal:.0f} times faster at no higher cost"
        )
        ratios = [ratio for name, ratio in runs if name.startswith(word)]
        if not ratios:
            section.goals.append(Goal(what.format("any unknowns"), "DEAP is absent", None))
        for unknowns, ratio in zip(("starts at 0", "starts unknown"), ratios, strict=False):
            found = f"{ratio:,.0f} times ({ratio / speed_up:,.0f} if g(w) is computed once)"
            if math.isnan(ratio):
                found = "our cost is higher"
            section.goals.append(Goal(what.format(unknowns), found, ratio >= goal))


def against_same_kernel(recording: Recording, known: Parameters, *, most: int) -> Section:
    """Differential evolution over our own compiled model: what the search strategy alone is worth."""
    static = {name: parameter.value for name, parameter in known.static.items()}
    with counted() as count:
        fit = ours(recording, known).fit
    model, evaluations = fit.model, sum(count.values())
    section = Section(
        "The search alone: differential evolution over our compiled model",
        ["search", "unknowns", "model evaluations", "times ours", "cost, filtered rows"],
        notes=[
            "Model evaluations are propagations of the bristle over all rows; ours include those with "
            f"derivatives ({count['tangents']} of {evaluations}). All costs are those of the filtered rows, "
            "start deflections solved in closed form. The last row minimises what our search over sigma0 "
            "minimises."
        ],
    )
    section.add("fit-dynamic", "sigma0, then all by least squares", evaluations, 1, f"{fit.sse:.6g}")

    def cost(x: Sequence[float]) -> float:
        values = {**fit.values, **static, "bristle_stiffness": math.exp(x[0]), "bristle_damping": x[1]}
        values["inertia.inertia"] = x[2]
        point = model.coordinates(values)
        residual = model.evaluate(point, fit.bend).residual
        return float(residual @ residual)

    projection = Projection(model, static["coulomb"])
    shape = {"ratio": static["static"] / static["coulomb"], "stribeck_velocity": static["stribeck_velocity"]}
    level = static["coulomb"] * projection.medium_level(shape)

    def projected(x: Sequence[float]) -> float:
        return projection.solve({**shape, "bend": level / math.exp(x[0])})[0]

    result, _ = _evolve(cost, euler.BOUNDS, most)
    ratio = result.nfev / evaluations
    section.add(
        "differential evolution", "sigma0, sigma1, inertia", int(result.nfev), ratio, f"{result.fun:.6g}"
    )
    less, _ = _evolve(projected, euler.BOUNDS[:1], most)
    section.add(
        "differential evolution",
        "sigma0, the rest in closed form as ours",
        int(less.nfev),
        less.nfev / evaluations,
        f"{less.fun:.6g}",
    )
    section.goals.append(
        Goal(
            "fit-dynamic: at most a third of the evaluations of differential evolution over the same model",
            f"1 / {ratio:.1f} of them; cost {number(fit.sse / float(result.fun))} of its",
            ratio >= _EVALUATIONS_GOAL and fit.sse <= float(result.fun) * (1.0 + 1e-6),
        )
    )
    return section


def _evolve(
    cost: Callable[[Any], float], bounds: Sequence[tuple[float, float]], most: int
) -> tuple[optimize.OptimizeResult, float]:
    box = optimize.Bounds(*np.array(bounds).T)
    with np.errstate(all="ignore"):  # infinite costs where Euler runs away
        return once(lambda: optimize.differential_evolution(cost, box, seed=0, **{**_DE, "maxiter": most}))


def _dynamic(values: Mapping[str, float]) -> tuple[float, float, float]:
    return values["bristle_stiffness"], values["bristle_damping"], values.get("inertia.inertia", 0.0)
