"""What every effect is: a form, parameters with units and bounds, and what reveals it.

An effect is written down once, as `at`: what it adds to the model (see `Contribution`) at one row, given its
numbers and what it remembers. Fits, prediction and diagnosis take that over all rows (`contribute`), the
controller one row at a time, compiled; a board has the same in C (`in_c`).
"""

from __future__ import annotations

import math
from abc import ABC
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from idtool.model.contribution import FIELDS, Contribution
from idtool.model.motion import Array, Motion
from idtool.model.units import Units, radians_per_unit

Values = Mapping[str, float]
#: What an effect may be a function of, as the tests of the residual name it.
FOLLOWED = ("position", "velocity", "acceleration", "direction", "load", "temperature", "time", "order")
#: What a person would call an attribute of `Motion`.
_NEEDS = {
    "load": "a load (payload or tilt columns, or an arm that swings)",
    "load_upright": "a load (payload or tilt columns)",
    "tilt_alpha": "a tilt column",
    "temperature": "a temperature column",
}


@dataclass(frozen=True)
class EffectParameter:
    """A parameter as the parameter file holds it.

    Attributes:
        name: base name; the unit of `dimension` ends it in the file.
        dimension: a key of `units.SUFFIXES`.
        meaning: a few words.
        lower, upper: physical bounds.
        optional: may be absent in a file (the effect has more than one form).
    """

    name: str
    dimension: str
    meaning: str
    lower: float = -math.inf
    upper: float = math.inf
    optional: bool = False


@dataclass(frozen=True)
class Coordinate:
    """A number as the fit varies it.

    Attributes:
        name: as in `contribute`'s values; "log_" and the name of a parameter is its logarithm.
        null: the value at which the effect vanishes (for a shape coordinate: any valid value).
        lower, upper: bounds of the fit.
        increment: step of the numerical derivative of `contribute`; exact where it enters linearly.
    """

    name: str
    null: float = 0.0
    lower: float = -math.inf
    upper: float = math.inf
    increment: float = 1.0


@dataclass(frozen=True)
class Past:
    """What an effect with memory starts a row from.

    Attributes:
        first: where the memory starts anew, shape (rows,).
        step: time since the row before, s, shape (rows,).
        memory: the effect's numbers after the last row, changed in place, shape (`Effect.memory`,).
        start: where in its range the memory starts, -1 to 1, for each of the starts, shape (starts,).
    """

    first: NDArray[np.bool_]
    step: Array
    memory: Array
    start: Array

    @classmethod
    def none(cls, motion: Motion, size: int, start: Array | None = None) -> Past:
        """Every trial starts anew, in the middle of the range unless `start`, shape (trials,), says where."""
        return cls(
            motion.first, motion.step, np.zeros(size), np.zeros(motion.trials) if start is None else start
        )


@dataclass(frozen=True)
class Wave:
    """For an effect that is a sine of something: what a search over all its frequencies needs.

    Attributes:
        coordinate: the shape coordinate that holds the frequency.
        of: what the sine is of, rad per unit of that coordinate, shape (rows,).
        lowest, highest: frequencies between which to look.
        of_friction: whether the level of friction has the sine too; it is looked for there then.
        part: rows with one number, 0, 1, 2, ..., share a phase, shape (rows,); None: all do.
    """

    coordinate: str
    of: Array
    lowest: float
    highest: float
    of_friction: bool = False
    part: NDArray[np.intp] | None = None


@dataclass(frozen=True)
class CForm:
    """An effect as C99 statements in single precision, for a controller on a board.

    Attributes:
        code: statements. They read `row->` (position, velocity, acceleration, step, time, payload,
            tilt_alpha, tilt_beta, temperature, has_temperature, gravity_factor, load, load_upright,
            torque_constant; units as in `Motion`), add to `sum->` (the fields of `Contribution`), and keep
            what they must remember in `memory[0]` to `memory[Effect.memory + keeps - 1]`; `row->first` is
            true where that starts anew, `row->tilted` where a tilt is another than before. Of functions
            there are those of libm that end in f, clamp(x, low, high), and, several times faster on a
            small board than its libm and compiler: decay(x) = exp(-x) for x >= 0, inverse(x) = 1 / x,
            sine_and_cosine(angle, &sine, &cosine), half(x), within(x, limit), is_negative(x),
            differs(x, y), above(x, limit) and beyond(x, limit) for x and |x| > limit >= 0.
        constants: the numbers that the code calls by name.
        keeps: how many numbers more than `Effect.memory` the C remembers, to save itself work.
        follows_temperature: does nothing without a thermometer.
        looks_back_s: how far into the past a delay of `sum->delay` reaches, s.
    """

    code: str
    constants: Values
    keeps: int = 0
    follows_temperature: bool = False
    looks_back_s: float = 0.0


class Effect(ABC):
    """One physical cause. Sub-classes are final and hold no state.

    Attributes:
        name, title, formula: how files, people and the report call it.
        follows: what it is a function of, as the residual's tests name it.
        reveals: the run that shows it best.
        look_alikes: effects that are hard to tell from it.
        citation: where it is described.
        page: an address that explains it; those of the tool have theirs in docs/effects/.
        absorbs: effects that are special cases of it; it takes their place.
        needs: attributes of `Motion` without which it cannot be tested.
        parameters: as in the parameter file.
        coordinates: as the fit varies them.
        memory: how many numbers it must remember from row to row; 0 for a function of the row alone.
        free_start: whether nothing tells what it remembers when a trial starts, so that a fit must find
            that for every trial (`Past.start`).
        is_lag: whether it can stand for a lag between torque and motion. The columns of lags are nearly the
            same, so only refitted models tell which one it is.
        after_reversal: whether it shows after each reversal, whichever way the axis then goes.
        of_sliding: whether it is a property of the curve of steady sliding, so that it must show where the
            axis slides steadily.
        told_by_turns: whether rows that slide steadily are described as well by its special case and another
            gravity, so that only those after a turn tell.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    formula: ClassVar[str]
    follows: ClassVar[tuple[str, ...]]
    reveals: ClassVar[str]
    look_alikes: ClassVar[tuple[str, ...]] = ()
    citation: ClassVar[str]
    page: ClassVar[str] = ""
    absorbs: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    parameters: ClassVar[tuple[EffectParameter, ...]]
    coordinates: ClassVar[tuple[Coordinate, ...]]
    memory: ClassVar[int] = 0
    free_start: ClassVar[bool] = False
    is_lag: ClassVar[bool] = False
    after_reversal: ClassVar[bool] = False
    of_sliding: ClassVar[bool] = False
    told_by_turns: ClassVar[bool] = False

    #: The formula as a static method that numba compiled: at(row, numbers, memory, total) adds what the
    #: effect adds to `total` (places of `FIELDS`) and moves its memory on. Without a memory it takes all rows
    #: at once too, as numpy. None: the controller asks `contribute`, which is slow.
    at: ClassVar[Any] = None
    #: With a memory: the same for many rows, over(rows, numbers, memory, total of shape (fields, rows)).
    over: ClassVar[Any] = None

    def acts_on(self, values: Values) -> tuple[int, ...]:
        """With a memory: where `at` adds something, as places of `FIELDS`."""
        raise NotImplementedError

    def numbers(self, values: Values) -> tuple[float, ...]:
        """The numbers that `at` takes, of `values` (fit coordinates and constants by name)."""
        raise NotImplementedError

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        """What the effect adds at `values` (fit coordinates and constants by name)."""
        if self.memory:
            return self.resume(motion, values, Past.none(motion, self.memory))
        total: list[Any] = [0.0] * len(FIELDS)
        # of arrays at once; NUMBA_DISABLE_JIT leaves the plain function in place of the compiled one
        getattr(self.at, "py_func", self.at)(motion.rows, self.numbers(values), None, total)
        return Contribution(*total)

    def resume(self, motion: Motion, values: Values, past: Past) -> Contribution:
        """As `contribute`, for rows that follow on those before; updates `past`."""
        if self.over is None:
            return self.contribute(motion, values)
        start = np.zeros(len(motion))
        start[past.first] = past.start
        rows = motion.each_row._replace(first=past.first, start=start, step=past.step)
        total = np.zeros((len(FIELDS), len(motion)))
        self.over(rows, np.array(self.numbers(values)), past.memory, total)
        # copies: what is kept of a place must not keep the others
        return Contribution(**{FIELDS[place]: total[place].copy() for place in self.acts_on(values)})

    def from_start(self, motion: Motion, values: Values, start: Array | None) -> Contribution:
        """As `contribute`, with the memory of each trial started at `start` (see `Past`) if given."""
        if start is None:
            return self.contribute(motion, values)
        return self.resume(motion, values, Past.none(motion, self.memory, start))

    def in_c(self, values: Values) -> CForm | None:
        """As `contribute` (or `resume`) at `values`, in C; None if the effect cannot be put on a board."""
        return None

    def holds(self, values: Values) -> tuple[float, float]:
        """What it carries of the friction level in place of the bristle, N m (N), and what that holds per
        travel before it slips, N m/rad (N/m): a controller scales it with the friction that it learns."""
        return 0.0, 0.0

    def grips(self, values: Values) -> float:
        """The most that it holds at rest beside the friction level, N m (N)."""
        return 0.0

    def constants(self, motion: Motion) -> dict[str, float]:
        """Numbers that the data set once (a reference temperature) and no fit varies."""
        return {}

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        """Values of the shape coordinates from which a search should start.

        An effect whose strength enters linearly has no shape: one empty start.
        """
        return [{}]

    def sizes(self, motion: Motion) -> list[dict[str, float]]:
        """Values of every coordinate to start from besides, for an effect that is far from linear."""
        return []

    def also_from(self, values: Values, model: Values) -> list[dict[str, float]]:
        """Other values from which a refit should start than those that its score found, where it may end at
        nothing from those. Arguments as of `implausible`."""
        return []

    def wave(self, motion: Motion) -> Wave | None:
        """For an effect that is a sine of something; its `starts` are not used then. None for the others."""
        return None

    def untestable(self, motion: Motion) -> str | None:
        """Why these data cannot show the effect, and what to log or do; None if they can."""
        return None

    def implausible(self, values: Values, model: Values) -> str | None:
        """Why fitted values cannot be this effect (a share below zero), as a sentence; None if they can.

        A flexible form can follow what another cause left in the residual, with values that the effect
        itself could never have.

        Args:
            values: fit coordinates and constants of the effect.
            model: every coordinate of the fitted model, those of effects as "effect.coordinate".
        """
        return None

    def of_the_readings(self, values: Values, motion: Motion) -> str | None:
        """Why an effect of this size tells how the log was read, not what the axis does, as a sentence; None
        if it is the axis. It stays in the model, but is not told as found."""
        return None

    def slope(self, motion: Motion, values: Values, coordinate: str) -> Contribution | None:
        """Derivative along a coordinate that does not enter linearly; None: by differences."""
        return None

    def around(self, values: Values, coordinate: str) -> Values:
        """Those of `values` on which the derivative along a coordinate depends; all, unless an effect of many
        members knows better."""
        return values

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        """The coordinates that these data let the fit vary."""
        return self.coordinates

    def larger(self, motion: Motion) -> tuple[Effect, ...]:
        """The same effect with one more member (another family of lines, a shape that bends more), each with
        all coordinates that it has now. Which of them data ask for is found as for any effect."""
        return ()

    def needed(self, parameters: Collection[str]) -> tuple[str, ...]:
        """Attributes of `Motion` that these parameters of a file cannot do without."""
        return self.needs

    def together(self, values: Values) -> tuple[str, float] | None:
        """What its numbers come to together, in words and as a share; None where each speaks for itself."""
        return None

    def form_of(self, values: Values) -> Effect:
        """The form of this effect that has these values."""
        return self

    def forms(self, motion: Motion) -> tuple[Effect, ...]:
        """The same effect in other words, to be looked for beside it: a search may find one from where it
        does not find the other."""
        return ()

    def plainer(
        self, values: Values, model: Values, motion: Motion
    ) -> tuple[Effect, dict[str, float]] | None:
        """The plain form that is the same as this one at fitted values, and what other numbers of the model
        are then; None if this form has to stay. Arguments as of `implausible`."""
        return None

    def to_parameters(self, values: Values) -> dict[str, float]:
        """File parameters from fit coordinates and constants."""
        found = {}
        for name in (p.name for p in self.parameters):
            if name in values:
                found[name] = values[name]
            elif f"log_{name}" in values:
                found[name] = math.exp(values[f"log_{name}"])
        return found

    def to_values(self, parameters: Values) -> dict[str, float]:
        """Fit coordinates and constants from file parameters."""
        found = dict(parameters)
        for name in [c.name for c in self.coordinates if c.name.startswith("log_")]:
            if (plain := name.removeprefix("log_")) in found:
                found[name] = math.log(found.pop(plain))
        return found

    def to_file(self, values: Values, kind: Units) -> dict[str, float]:
        """`to_parameters` in the units of a file for this kind of axis."""
        found = self.to_parameters(values)
        return found | {
            p.name: found[p.name] / radians_per_unit(p.dimension, kind)
            for p in self.parameters
            if p.name in found
        }

    def from_file(self, parameters: Values, kind: Units) -> dict[str, float]:
        """`to_values` of what a file for this kind of axis holds."""
        units = {p.name: radians_per_unit(p.dimension, kind) for p in self.parameters}
        return self.to_values({name: units.get(name, 1.0) * value for name, value in parameters.items()})

    def missing(self, motion: Motion) -> str | None:
        """A needed quantity that was not logged, as a sentence; None if all are there."""
        for need in self.needs:
            if getattr(motion, need) is None:
                return f"needs {_NEEDS.get(need, need.replace('_', ' '))}, which these logs do not have"
        return self.untestable(motion)


def derivative(
    effect: Effect, motion: Motion, values: Values, coordinate: Coordinate, start: Array | None = None
) -> Contribution:
    """Derivative of the contribution with respect to one coordinate: what one unit of it alone adds where it
    enters linearly, else what the effect says, else the central difference."""
    value = values[coordinate.name]
    half = coordinate.increment
    values = effect.around(values, coordinate.name)
    if half == 1.0:
        linear = [c.name for c in effect.coordinates if c.increment == 1.0 and c.name in values]
        return effect.from_start(
            motion, {**values, **dict.fromkeys(linear, 0.0), coordinate.name: 1.0}, start
        )
    if start is None and (known := effect.slope(motion, values, coordinate.name)) is not None:
        return known
    above = effect.from_start(motion, {**values, coordinate.name: value + half}, start)
    below = effect.from_start(motion, {**values, coordinate.name: value - half}, start)
    change = {}
    for name in FIELDS:
        high, low = getattr(above, name), getattr(below, name)
        if high is low or (isinstance(high, float) and isinstance(low, float) and high == low):
            continue
        change[name] = (high - low) / (2.0 * half)
    return Contribution(**change)


#: Fewer reversals show nothing that comes back after each.
FEWEST_REVERSALS = 4
#: Less than this share of the motion in one direction is no motion in it.
OTHER_WAY = 0.02
#: Speeds above this share of the highest are motion.
MOVING = 0.05
#: An axis moves at one speed if this share of its motion is that near to it.
_HARDLY_OTHER, _ALIKE = 0.8, 0.15


def both_ways(velocity: Array) -> bool:
    """Whether the axis moved both ways: in one alone a constant torque and friction are one thing."""
    moving = velocity[velocity != 0.0]
    return bool(OTHER_WAY < np.mean(moving > 0.0) < 1.0 - OTHER_WAY) if len(moving) else False


def usual_speed(velocity: Array) -> float | None:
    """The speed at which nearly all of a motion goes; None where others are moved too. At one speed friction
    that grows with it, however, and a level of friction are one thing."""
    speed = np.abs(velocity)
    fast = speed[speed > MOVING * float(np.quantile(speed, 0.999))]
    usual = float(np.median(fast)) if len(fast) else 0.0
    return usual if np.mean(np.abs(fast - usual) < _ALIKE * usual) >= _HARDLY_OTHER else None


def stroke_of(motion: Motion) -> dict[str, float]:
    """The constants of a shape over the stroke: its middle, and half of it."""
    low, high = float(np.min(motion.position)), float(np.max(motion.position))
    return {"center": 0.5 * (low + high), "half_stroke": 0.5 * (high - low)}


def of_one_load(motion: Motion) -> str | None:
    """Why friction that grows with the load cannot show; None where the load changes."""
    assert motion.load is not None
    size = np.abs(motion.load)
    return None if varies(size, 1e-9 * (1.0 + np.max(size))) else "the load never changes: add payload steps"


def varies(values: np.ndarray | None, at_least: float) -> bool:
    """Whether a logged quantity spans at least `at_least`."""
    return values is not None and len(values) > 0 and float(np.ptp(values)) >= at_least
