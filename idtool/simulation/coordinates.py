"""The numbers of a parameter file as the coordinates that a fit of the motion varies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from idtool.effects import registry
from idtool.model.motion import Array
from idtool.parameters import GRAVITY_MODELS, STATIC, EffectEntry, Parameter, Parameters
from idtool.parameters.drive import Drive

#: Effects whose parameters are varied; what the others say of the shape along the stroke stays as it is.
VARIED = (
    "inertia",
    "torque_offset",
    "direction_asymmetry",
    "nonlinear_viscous",
    "load_dependent_friction",
    "drive_backdrive",
)
#: Those of the drive.
OF_DRIVE = {"bend": "number", "dead_band": "number", "back_emf": "damping"}
_LOGARITHMIC = ("coulomb", "static", "stribeck_velocity", "inertia", "doubling_load")
#: Bounds of pure numbers, by name.
_BOUNDS = {"bend": (0.0, 5.0), "dead_band": (0.0, 0.3)}
#: A logarithmic coordinate keeps within this factor of the scales, and one at a bound within this of it.
_DECADES, _AT_BOUND = 1e4, 1e-3
#: A friction curve that is over below this share of the lowest speed shows in nothing, as in fits of torque.
_OF_SLOWEST = 0.2


@dataclass(frozen=True)
class Scales:
    """Typical sizes of the logs: effort, speed, way, and the lowest speed at which the axis moved."""

    torque: float
    velocity: float
    position: float
    slowest: float

    def of(self, dimension: str) -> float:
        """The size of a quantity of that dimension; 1 for a pure number."""
        t, w, q = self.torque, self.velocity, self.position
        known = {
            "torque": t,
            "velocity": w,
            "damping": t / w,
            "quadratic_damping": t / w**2,
            "inertia": t * q / w**2,
            "stiffness": t / q,
            "torque_per_payload": t,
        }
        return known.get(dimension, 1.0)


@dataclass(frozen=True)
class Coordinate:
    """One number: where it stands, and how it is varied.

    Attributes:
        part: "gravity", "static", "drive", or the name of an effect.
        name: base name.
        scale: its typical size.
        logarithmic: whether its logarithm is varied.
        lower, upper: bounds of the coordinate (the number over `scale`, or the logarithm of that).
    """

    part: str
    name: str
    scale: float
    logarithmic: bool
    lower: float
    upper: float

    def value(self, x: float) -> float:
        """The number at a coordinate."""
        return self.scale * (math.exp(x) if self.logarithmic else x)

    def at(self, value: float) -> float:
        """The coordinate of a number, inside the bounds."""
        size = value / self.scale
        x = math.log(max(size, 1e-300)) if self.logarithmic else size
        return min(max(x, self.lower + 2.0 * _AT_BOUND), self.upper - 2.0 * _AT_BOUND)

    def parameter(self, x: float, stderr: float, quantile: float) -> Parameter:
        """The number with its interval."""
        at_bound = x - self.lower < _AT_BOUND or self.upper - x < _AT_BOUND
        slope = self.value(x) if self.logarithmic else self.scale
        wide = self.logarithmic and quantile * stderr > math.log(_DECADES)
        found = Parameter(self.value(x), at_bound=at_bound)
        if at_bound or wide or not math.isfinite(stderr):
            return found.undetermined()
        ends = (self.value(x - quantile * stderr), self.value(x + quantile * stderr))
        if quantile * stderr >= 1.0:
            return found.undetermined(at_most=ends[1])
        return Parameter(self.value(x), slope * stderr, ends)


def coordinates_of(parameters: Parameters, scales: Scales, *, drive_was_off: bool) -> list[Coordinate]:
    """What of a file is varied; only where the drive was off do the back-EMF and the rest of the viscous
    coefficient show apart."""
    found = []
    if parameters.gravity_model:
        dimensions = GRAVITY_MODELS[parameters.gravity_model]
        found += [_coordinate("gravity", name, dimensions[name], scales) for name in parameters.gravity]
    found += [_coordinate("static", name, STATIC[name], scales) for name in parameters.static]
    for entry in parameters.effects:
        if entry.name in VARIED:
            known = {one.name: one.dimension for one in registry.get(entry.name).parameters}
            found += [_coordinate(entry.name, name, known[name], scales) for name in entry.parameters]
    if parameters.drive is not None:
        there = [name for name in OF_DRIVE if getattr(parameters.drive, name) is not None]
        there = [name for name in there if drive_was_off or name != "back_emf"]
        found += [_coordinate("drive", name, OF_DRIVE[name], scales) for name in there]
    return found


def _coordinate(part: str, name: str, dimension: str, scales: Scales) -> Coordinate:
    scale = scales.of(dimension)
    if name in _LOGARITHMIC:
        lowest = 1.0 / _DECADES
        if name == "stribeck_velocity":
            lowest = max(lowest, _OF_SLOWEST * scales.slowest / scale)
        return Coordinate(part, name, scale, True, math.log(lowest), math.log(_DECADES))
    lower, upper = _BOUNDS.get(name, (-math.inf, math.inf))
    if name in ("viscous", "back_emf") or name.startswith("mu"):
        lower = 0.0
    if name.startswith("mu"):
        upper = 1.0
    return Coordinate(part, name, scale, False, lower, upper)


def start(parameters: Parameters, coordinates: Sequence[Coordinate]) -> Array:
    """The coordinates of a file, shape (coordinates,)."""
    values = [_parts(parameters, one.part)[one.name].value for one in coordinates]
    place = _damping(coordinates)
    if place is not None:
        values[place[0]] -= values[place[1]]
    return np.array([one.at(value) for one, value in zip(coordinates, values, strict=True)])


def _damping(coordinates: Sequence[Coordinate]) -> tuple[int, int] | None:
    """Places of the viscous coefficient and of the back-EMF in it. The coordinate of the first is what is
    left of it where the drive is off, so that neither can be less than nothing."""
    names = [(one.part, one.name) for one in coordinates]
    if ("drive", "back_emf") not in names:
        return None
    return names.index(("static", "viscous")), names.index(("drive", "back_emf"))


def parameters_at(coordinates: Sequence[Coordinate], x: Array) -> list[Parameter]:
    """The numbers at coordinates, without intervals."""
    whole = _whole(coordinates, x)
    return [Parameter(one.value(float(v))) for one, v in zip(coordinates, whole, strict=True)]


def parameters_with_errors(
    coordinates: Sequence[Coordinate], x: Array, covariance: Array, quantile: float
) -> list[Parameter]:
    """The numbers with their intervals."""
    whole, spread = _whole(coordinates, x), np.diag(covariance).copy()
    place = _damping(coordinates)
    if place is not None:
        both = np.ix_(place, place)
        spread[place[0]] = covariance[both].sum()
    errors = np.sqrt(np.maximum(spread, 0.0))
    return [
        one.parameter(float(v), float(e), quantile)
        for one, v, e in zip(coordinates, whole, errors, strict=True)
    ]


def _whole(coordinates: Sequence[Coordinate], x: Array) -> Array:
    place = _damping(coordinates)
    whole = np.array(x, dtype=float)
    if place is not None:
        whole[place[0]] += whole[place[1]]
    return whole


def with_values(
    parameters: Parameters, coordinates: Sequence[Coordinate], values: Sequence[Parameter]
) -> Parameters:
    """The file with other numbers."""
    parts: dict[str, dict[str, Parameter]] = {}
    for one, value in zip(coordinates, values, strict=True):
        parts.setdefault(one.part, {})[one.name] = value
    effects = tuple(
        EffectEntry(entry.name, {**entry.parameters, **parts.get(entry.name, {})})
        for entry in parameters.effects
    )
    drive = parameters.drive
    if drive is not None:
        drive = replace(drive, **parts.get("drive", {}))  # type: ignore[arg-type]
    return replace(
        parameters,
        gravity={**parameters.gravity, **parts.get("gravity", {})},
        static={**parameters.static, **parts.get("static", {})},
        effects=effects,
        drive=drive,
    )


def _parts(parameters: Parameters, part: str) -> Mapping[str, Parameter]:
    if part in ("gravity", "static"):
        return parameters.gravity if part == "gravity" else parameters.static
    if part == "drive":
        assert isinstance(parameters.drive, Drive)
        return {name: getattr(parameters.drive, name) for name in OF_DRIVE}
    entry = parameters.effect(part)
    assert entry is not None
    return entry.parameters
