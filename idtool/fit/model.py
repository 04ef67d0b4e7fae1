"""The model with its parameters free: what a joint fit varies, evaluates and differentiates.

The fit works in coordinates: logarithms of the friction levels, the Stribeck velocity and the bristle
stiffness (positive, and spread over decades), the rest as they are. Every trial's start deflection of
the bristle is linear; it is eliminated in closed form at every evaluation (variable projection, Golub &
Pereyra 1973), with a prior as wide as the bristle can bend, so that a trial that says nothing about its
start costs nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import Coordinate, Effect, derivative
from idtool.fit.eliminate import eliminate, filter_and_eliminate
from idtool.fit.spec import FrictionKind, Scales, Spec
from idtool.model import gravity
from idtool.model.contribution import Contribution, combine
from idtool.model.motion import Array, Motion
from idtool.model.stribeck import level
from idtool.model.torque import BLOCK, ON_FINISHED, At, Direction, Friction
from idtool.parameters import GRAVITY_MODELS
from idtool.signals import Recording

_FRICTION_COORDINATES: dict[FrictionKind, tuple[str, ...]] = {
    "lugre": ("coulomb", "static", "stribeck_velocity", "viscous", "bristle_stiffness", "bristle_damping"),
    "stribeck": ("coulomb", "static", "stribeck_velocity", "viscous"),
    "coulomb": ("coulomb", "viscous"),
}
#: The bristle may bend over this share of the stroke, or over so many strokes where it is `soft`.
_STIFF_BEND = 0.25
_SOFT_BEND = 20.0
#: The least that is unknown of a start, as a share of the bend's variance: no start is known exactly.
_NO_BEND = 1e-6
#: The bristle is damped in turns only, where the axis is slow: at top speed it may be so many times this.
_MOST_DAMPING = 20.0
#: Coordinates that are logarithms.
LOGARITHMIC = ("coulomb", "static", "stribeck_velocity", "bristle_stiffness")


@dataclass(frozen=True)
class Evaluation:
    """A model evaluated on its recording, on filtered rows.

    Attributes:
        residual: measured minus predicted torque with the best start deflections, (filtered rows,).
        start: those deflections, (stretches,).
        penalty: root of the prior's weight times each start deflection, (stretches,).
    """

    residual: Array
    start: Array
    penalty: Array

    @property
    def stacked(self) -> Array:
        """Residual and penalty as one vector."""
        return np.concatenate([self.residual, self.penalty])


@dataclass(frozen=True)
class JointModel:
    """A `Spec` on a `Recording`.

    Attributes:
        constants: numbers of each effect that the data set and no fit varies.
        starts: where the memory of an effect starts in each trial (`Past.start`), shape (trials,); that
            of an effect that is not named starts in the middle of its range.
        coordinates_from: where the coordinates and their scales come from, if not from `recording`: a run
            that is only thought of may not show all that the fitted one did.
    """

    recording: Recording
    spec: Spec
    constants: dict[str, dict[str, float]] = field(default_factory=dict)
    starts: dict[str, Array] = field(default_factory=dict)
    coordinates_from: Recording | None = None

    @classmethod
    def build(
        cls, recording: Recording, spec: Spec, constants: Mapping[str, dict[str, float]] | None = None
    ) -> JointModel:
        """The model; constants that the data set (a reference temperature) are taken from `constants`
        where they are given, so that a subset of trials uses those of the whole."""
        known = dict(constants or {})
        for effect in spec.effects:
            known.setdefault(effect.name, effect.constants(recording.motion))
        return cls(recording, spec, known)

    @cached_property
    def scales(self) -> Scales:
        """Typical sizes of the data."""
        scales: Scales = self._shown.once(Scales, lambda: Scales.of(self._shown))
        return scales

    @property
    def _shown(self) -> Recording:
        return self.coordinates_from or self.recording

    @property
    def friction_coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of friction."""
        return _FRICTION_COORDINATES[self.spec.friction]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Coordinate names in order; those of an effect are "effect.coordinate"."""
        names = list(self.friction_coordinates)
        names += [f"gravity.{column}" for column in self.spec.gravity_columns]
        for effect in self.spec.effects:
            names += [f"{effect.name}.{c.name}" for c in effect.active(self._shown.motion)]
        return tuple(names)

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bound of every coordinate."""
        s = self.scales
        typical, most = self.friction_sizes
        table: dict[str, tuple[float, float]] = {
            "coulomb": (math.log(1e-4 * s.torque), math.log(most)),
            "static": (math.log(1e-4 * s.torque), math.log(most)),
            "stribeck_velocity": (math.log(0.2 * s.slowest), math.log(s.widest_curve)),
            "viscous": (0.0, most / s.speed),
            "bristle_stiffness": (
                math.log(typical / self.longest_bend),
                math.log(5.0 * s.torque / s.shortest_bend),
            ),
            "bristle_damping": (0.0, _MOST_DAMPING * most / s.speed),
        }
        for effect in self.spec.effects:
            for c in effect.active(self._shown.motion):
                table[f"{effect.name}.{c.name}"] = (c.lower, c.upper)
        pairs = [table.get(name, (-math.inf, math.inf)) for name in self.names]
        return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs])

    @property
    def longest_bend(self) -> float:
        """The most that the bristle may bend, rad (m)."""
        share = _SOFT_BEND if self.spec.soft else _STIFF_BEND
        return max(share * self.scales.travel, 4.0 * self.scales.shortest_bend)

    @cached_property
    def friction_sizes(self) -> tuple[float, float]:
        """The typical and the largest torque that can have been friction: what was measured, gravity out.

        The largest is that of single readings, those of a rest among them: an axis that started has reached
        its break-away torque, and what was never reached nobody can know.
        """
        key = "friction sizes", self.spec.gravity, self.spec.gravity_columns
        sizes: tuple[float, float] = self.recording.once(key, self._friction_sizes)
        return sizes

    def _friction_sizes(self) -> tuple[float, float]:
        recording = self.recording
        target, columns = self.measured, recording.filtered(self.gravity_columns)
        rows = recording.usable | recording.at_rest
        readings = recording.torque[rows]
        if columns.shape[1]:
            found = np.linalg.lstsq(columns, target, rcond=1e-10)[0]
            target, readings = target - columns @ found, readings - self.gravity_columns[rows] @ found
        typical = float(np.median(np.abs(target / recording.row_weight)))
        return typical + 1e-12, float(np.max(np.abs(readings))) + 1e-12

    @cached_property
    def stiff(self) -> float:
        """Bristle stiffness that stands for a rigid contact where the law has none."""
        return self.scales.torque / self.scales.shortest_bend

    @property
    def measured(self) -> Array:
        """Filtered torque."""
        return self.recording.filtered_torque

    @cached_property
    def gravity_columns(self) -> Array:
        """Gravity regressors at full rate, (rows, free gravity coefficients)."""
        if self.spec.gravity is None:
            return np.empty((len(self.recording.motion), 0))
        model = self.spec.gravity
        everything = self.recording.once(
            ("gravity", model), lambda: gravity.columns(model, self.recording.motion)
        )
        order = tuple(GRAVITY_MODELS[model])
        return np.asarray(everything[:, [order.index(name) for name in self.spec.gravity_columns]])

    def friction(self, x: Array) -> Friction:
        """LuGre parameters at coordinates `x`."""
        value = self.values(x)
        coulomb = value["coulomb"]
        return Friction(
            coulomb=coulomb,
            static=value.get("static", coulomb),
            stribeck_velocity=value.get("stribeck_velocity", self.scales.slowest),
            viscous=value["viscous"],
            bristle_stiffness=value.get("bristle_stiffness", self.stiff),
            bristle_damping=value.get("bristle_damping", 0.0),
        )

    def values(self, x: Array) -> dict[str, float]:
        """Physical value of every coordinate by name."""
        value = {
            name: math.exp(number) if name in LOGARITHMIC else float(number)
            for name, number in zip(self.names, x, strict=True)
        }
        return value | {"static": value["coulomb"]} if self.flat(x) else value

    def flat(self, x: Array) -> bool:
        """Whether coordinates `x` ask for a curve that rises where it may only fall: it is flat there."""
        return self.spec.falling and "static" in self.names and bool(x[self._static] <= x[self._coulomb])

    @cached_property
    def _coulomb(self) -> int:
        return self.names.index("coulomb")

    @cached_property
    def _static(self) -> int:
        return self.names.index("static")

    def coordinates(self, values: Mapping[str, float]) -> Array:
        """Coordinates of physical values by name, moved inside the bounds."""
        raw = [math.log(values[name]) if name in LOGARITHMIC else values[name] for name in self.names]
        low, high = self.bounds
        return np.asarray(np.clip(np.array(raw), low, high))

    def effect_values(self, x: Array, effect: Effect) -> dict[str, float]:
        """Coordinates and constants of one effect."""
        return self._of(effect, self.values(x))

    def _of(self, effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
        own = {name: values[full] for name, full in self._owned[effect.name]}
        return {**self.constants[effect.name], **own}

    @cached_property
    def _owned(self) -> dict[str, list[tuple[str, str]]]:
        """Effect -> its coordinates, by their own names and by those in the model."""
        owned: dict[str, list[tuple[str, str]]] = {effect.name: [] for effect in self.spec.effects}
        for full in self.names:
            owner, _, name = full.partition(".")
            if name and owner in owned:
                owned[owner].append((name, full))
        return owned

    def contribution(self, x: Array, starts: Mapping[str, Array] | None = None) -> Contribution:
        """Gravity, the known back-EMF and all effects; `starts` in place of the model's own."""
        motion = self.recording.motion
        begun = self.starts if starts is None else starts
        value = self.values(x)
        parts = [e.from_start(motion, self._of(e, value), begun.get(e.name)) for e in self.spec.effects]
        coefficients = np.array([value[f"gravity.{c}"] for c in self.spec.gravity_columns])
        if len(coefficients):
            parts.append(Contribution(torque=self.gravity_columns @ coefficients))
        if motion.back_emf is not None:
            parts.append(Contribution(torque=motion.braking))
        return combine(parts)

    def directions(self, x: Array, varied: NDArray[np.bool_] | None = None) -> list[Direction]:
        """One per coordinate, or per coordinate that is `varied`."""
        value = self.values(x)
        shown: Motion = self._shown.motion
        result = []
        effects = {e.name: (e, self._of(e, value), _coordinates(e, shown)) for e in self.spec.effects}
        wanted = np.ones(len(x), dtype=bool) if varied is None else varied
        flat = self.flat(x)
        for name in np.array(self.names)[wanted].tolist():
            owner, _, part = name.partition(".")
            if owner == "gravity":
                column = self.gravity_columns[:, self.spec.gravity_columns.index(part)]
                result.append(Direction(effect=Contribution(torque=column), origin=(name, ())))
            elif part:
                effect, values, coordinates = effects[owner]
                start = self.starts.get(owner)
                result.append(self._direction(effect, values, coordinates[part], start))
            elif name == "coulomb" and (flat or self.spec.friction == "coulomb"):
                result.append(Direction(coulomb=value[name], static=value[name]))
            elif name == "static" and flat:
                result.append(Direction())
            else:
                unit = value[name] if name in LOGARITHMIC else 1.0
                result.append(replace(Direction(), **{name: unit}))  # type: ignore[arg-type]
        return result

    def _direction(
        self, effect: Effect, values: Mapping[str, float], coordinate: Coordinate, start: Array | None
    ) -> Direction:
        """Along one coordinate of an effect; that of a linear one depends on the shape coordinates only."""
        name = f"{effect.name}.{coordinate.name}"
        if coordinate.increment != 1.0 or start is not None:
            return Direction(effect=derivative(effect, self.recording.motion, values, coordinate, start))
        linear = {c.name for c in effect.coordinates if c.increment == 1.0}
        around = effect.around(values, coordinate.name)
        shape = tuple(sorted((key, value) for key, value in around.items() if key not in linear))
        known = self.recording.derivatives.get(name)
        if known is None or known[0] != shape:
            change = derivative(effect, self.recording.motion, values, coordinate)
            known = self.recording.derivatives[name] = (shape, change)
        return Direction(effect=known[1], origin=(name, shape))

    def presliding_scale(self, x: Array) -> float:
        """How far the bristle bends before it slides at coordinates `x`, rad (m): the scale of its start."""
        friction = self.friction(x)
        return max(friction.coulomb, friction.static) / friction.bristle_stiffness

    def evaluate(self, x: Array, bend: float, starts: Mapping[str, Array] | None = None) -> Evaluation:
        """Residual at coordinates `x`, start deflections eliminated; `bend` is the prior's scale, `starts` in
        place of the model's own."""
        recording = self.recording
        expected = self.expected_start(x)
        at = self._at(x, starts)
        prediction = at.predict(expected)
        residual = self.measured - recording.filtered(prediction.torque)
        column = recording.filtered(prediction.start_column)
        weight = self.weight(bend)
        pointer = recording.stretch_pointer
        share = eliminate(residual, column, pointer, weight, np.empty_like(residual))
        # rows that no start explains must not bend the bristle further than it can
        start = np.clip(expected + share, -at.furthest_bend, at.furthest_bend)
        residual -= column * (start - expected)[recording.filtered_stretch]
        return Evaluation(residual, start, weight * (start - expected))

    def _at(self, x: Array, starts: Mapping[str, Array] | None = None) -> At:
        """The model at coordinates `x`; the last one is kept, since it is evaluated, differentiated and
        scored there."""
        key = x.tobytes()
        if starts is None and key in self._last:
            return self._last[key]
        at = At(self.recording.motion, self.friction(x), self.contribution(x, starts))
        if starts is None:
            self._last.clear()
            self._last[key] = at
        return at

    @cached_property
    def _last(self) -> dict[bytes, At]:
        return {}

    def forget(self) -> None:
        """Let go what is kept of the last coordinates."""
        self._last.clear()

    def differentiate(
        self, x: Array, bend: float, start: Array, varied: NDArray[np.bool_] | None = None
    ) -> Array:
        """Derivative of -residual and -penalty at coordinates `x` and the start deflections `start`, free of
        what the starts can do, (filtered rows + stretches, coordinates): a column for every coordinate, or
        for those that are `varied`."""
        return self.project(x, bend, start, self.directions(x, varied))

    def project(self, x: Array, bend: float, start: Array, directions: Sequence[Direction]) -> Array:
        """As `differentiate`, along any directions (columns that a candidate effect would add)."""
        recording = self.recording
        at = self._at(x)
        # what only adds a torque needs no bristle, unless something acts on the finished torque
        finished = [at.effect, *(direction.effect for direction in directions)]
        apart = not any(place in ON_FINISHED for one in finished for place in one.places)
        through = [d for d in directions if not (apart and d.only_adds)]
        prediction, blocks = at.linearise(start, through)
        weight = self.weight(bend)
        start_column = recording.filtered(prediction.start_column)
        # one row per direction: a column of a matrix stored by rows is slow to write
        count, starts = len(start_column), (start_column, recording.stretch_pointer, weight)
        rows = np.empty((len(directions), count + len(weight)))
        free = np.empty((BLOCK, count))
        bent: Iterator[tuple[Array, Array]] = iter(())
        for row, direction in zip(rows, directions, strict=True):
            if apart and direction.only_adds:
                row[count:] = -weight * eliminate(self._added(direction), *starts, row[:count])
                continue
            found = next(bent, None)
            if found is None:
                moved = filter_and_eliminate(next(blocks), *recording.model_operator.csr, *starts, free)
                bent = zip(free, moved, strict=True)
                found = next(bent)
            row[:count], row[count:] = found[0], -weight * found[1]
        return rows.T

    def _added(self, direction: Direction) -> Array:
        """Filtered torque of a direction that only adds one; the last one of each origin is kept."""
        name, depends_on = direction.origin or (None, None)
        known = self.recording.added.get(name)
        if name is None or known is None or known[0] != depends_on:
            torque = np.broadcast_to(direction.effect.torque, len(self.recording.motion))
            known = self.recording.added[name] = (depends_on, self.recording.filtered(torque))
        return known[1]

    def expected_start(self, x: Array) -> Array:
        """Middle of the prior of each start deflection, shape (stretches,).

        An axis that moves when its trial begins has slid before: its bristle is bent as at that speed. Taken
        for straight there, it would be damped all at once.
        """
        friction, entering = self.friction(x), self.recording.entering
        levels = level(entering, friction.coulomb, friction.static, friction.stribeck_velocity)
        return np.asarray(np.sign(entering) * levels / friction.bristle_stiffness)

    def weight(self, bend: float) -> Array:
        """Noise of a filtered row over the prior's standard deviation of each start, shape (stretches,).

        Before a trial the bristle bent anywhere up to `bend`, which sliding forgets; in a rest the axis may
        have moved as far as its position cannot show (`Recording.unseen`). A trial that begins in motion came
        about as far since its last turn as it goes on before its first, so that it has not slid yet by
        `bend` over that.
        """
        weight: Array = self.recording.once(("weight", bend), lambda: self._weight(bend))
        return weight

    def _weight(self, bend: float) -> Array:
        motion, unseen = self.recording.motion, self.recording.unseen
        variance = bend**2 * np.minimum(bend / np.maximum(self.recording.goes_on, bend), 1.0)
        if motion.restart is not None and motion.stretches > motion.trials:
            kept = np.exp(-2.0 * motion.travels / bend)
            for k in np.flatnonzero(~motion.first[motion.begins]):
                variance[k] = variance[k - 1] * kept[k - 1] + unseen**2
        return np.asarray(self.filtered_noise / np.sqrt(variance + _NO_BEND * bend**2))

    @cached_property
    def filtered_noise(self) -> float:
        """Standard deviation that white sensor noise leaves on a filtered row."""
        noise: float = self.recording.once("filtered noise", self._filtered_noise)
        return noise

    def _filtered_noise(self) -> float:
        operator = self.recording.model_operator
        gain = float(np.sqrt(operator.overlap(0) / len(operator)))
        return self.recording.noise * gain


def _coordinates(effect: Effect, motion: Motion) -> dict[str, Coordinate]:
    """By name; a run that is only thought of may not show all that the fitted one did."""
    return {c.name: c for c in (*effect.coordinates, *effect.active(motion))}
