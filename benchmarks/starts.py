"""What estimating the unknown starts of the bristle buys, and what refining everything jointly does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.sessions import known_static, log_of, off_by, truth
from benchmarks.table import Section
from idtool.effects import registry
from idtool.fit.choose import choose_gravity
from idtool.fit.joint import solve
from idtool.fit.model import JointModel
from idtool.fit.search import search
from idtool.fit.spec import Spec
from idtool.model.motion import Array
from idtool.signals import Recording, record

_NAMES = ("bristle_stiffness", "bristle_damping")
#: Weight of the prior that leaves a start no way to go.
_HELD = 1e12


@dataclass(frozen=True)
class Unbent(JointModel):
    """The model of a user who takes every bristle to be straight when a trial begins."""

    def weight(self, bend: float) -> Array:
        return np.full(self.recording.motion.stretches, _HELD)


_KINDS: tuple[tuple[type[JointModel], str], ...] = (
    (Unbent, "starts taken to be 0"),
    (JointModel, "starts estimated"),
)


def measure(seeds: Sequence[int], trials: tuple[int, ...] = (), sweep: tuple[int, ...] = ()) -> Section:
    """Errors of sigma0 and sigma1 against the truth over several simulated sessions."""
    errors: dict[str, list[list[float]]] = {}
    for seed in seeds:
        for name, values in _fits(seed, trials, sweep).items():
            errors.setdefault(name, []).append([off_by(values, parameter) for parameter in _NAMES])
    section = Section(
        "What the unknown starts and the joint refinement buy",
        [
            "fit",
            "sigma0: mean error, %",
            "root mean square, %",
            "sigma1: mean error, %",
            "root mean square, %",
        ],
    )
    for name, found in errors.items():
        table = np.array(found)
        mean, rms = table.mean(axis=0), np.sqrt((table**2).mean(axis=0))
        section.add(name, f"{mean[0]:+.2f}", f"{rms[0]:.2f}", f"{mean[1]:+.2f}", f"{rms[1]:.2f}")
    section.notes.append(
        f"{len(seeds)} sessions of `sim:paper` (seeds {', '.join(map(str, seeds))}), whose bristles start "
        "each trial bent by an amount that no log holds. The first rows hold the static parameters at the "
        "truth, the next ones at what `fit-static` found in the same session; in the last two they are "
        "refined with the rest, on sweep and sines (as `identify` does). Search only: the search over "
        "sigma0, the rest in closed form."
    )
    return section


def _fits(seed: int, trials: tuple[int, ...], sweep: tuple[int, ...]) -> dict[str, dict[str, float]]:
    sines, known = log_of("sine", seed, trials), known_static(seed, sweep)
    recording = record([sines])
    spec = spec_of(recording)
    fitted = {name: parameter.value for name, parameter in known.static.items()}
    exact = {name: truth()[name] for name in fitted}
    result = {}
    for static, source in ((exact, "true static parameters"), (fitted, "those of fit-static")):
        curve = {name: static[name] for name in ("coulomb", "static", "stribeck_velocity")}
        for kind, words in _KINDS:
            model = kind.build(recording, spec)
            best = search(model, fixed=curve, evaluations=60, keep=1)[0].values
            result[f"{source}, {words}, search only"] = best
            point = model.coordinates({name: {**best, **static}.get(name, 0.0) for name in model.names})
            result[f"{source}, {words}, least squares"] = solve(model, point, held=frozenset(static)).values
    both = record([log_of("sweep", seed, sweep), sines])
    for kind, words in _KINDS:
        model = kind.build(both, spec_of(both))
        fits = [solve(model, model.coordinates(point.values)) for point in search(model)]
        result[f"static refined jointly, {words}"] = min(fits, key=lambda fit: fit.sse).values
    return result


def spec_of(recording: Recording) -> Spec:
    """LuGre with a bristle as soft as the paper's, and what can be seen of gravity, inertia and an offset."""
    gravity, columns = choose_gravity(recording)
    spec = Spec("lugre", gravity, columns, soft=True)
    for name in ("inertia", "torque_offset"):
        if registry.get(name).missing(recording.motion) is None:
            spec = spec.adding(registry.get(name))
    return spec
