"""The identified model, one sample at a time.

`OnlineModel` gives what the motor must carry at this instant: gravity, LuGre friction and every effect
of the parameter file. The arithmetic is compiled (`load`), so a sample costs a microsecond; an effect
that is not written out there is asked by its own class, one row at a time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from idtool.control import load as compiled
from idtool.control.load import Instant
from idtool.effects import registry
from idtool.effects.base import Effect, Past, Values
from idtool.errors import InputError
from idtool.model.contribution import FIELDS, Term
from idtool.model.motion import Motion
from idtool.parameters import Parameters
from idtool.parameters.correction import Correction

_TORQUE = FIELDS.index("torque")


@dataclass(slots=True)
class Load:
    """What the motor carries at one sample, N m (N): the model's share of K i.

    Attributes:
        gravity: gravity torque.
        elastic, damping: friction: what the deflected bristle holds, and what carries a part of its level for
            it; and what goes with speed.
        effects: other additive effects, inertia among them.
        level: friction level g at the present speed, effects included.
        saturation: relative loss of motor torque per torque, 1/(N m).
        gain: relative change of the motor's torque.
        delay: by how much position and velocity lag the current, s.
        kept: share of the bristle's deflection that outlived the travel since the sample before.
        felt: torque of a deflection that nobody saw, over what it is at rest.
    """

    gravity: float = 0.0
    elastic: float = 0.0
    damping: float = 0.0
    effects: float = 0.0
    level: float = 0.0
    saturation: float = 0.0
    gain: float = 0.0
    delay: float = 0.0
    kept: float = 1.0
    felt: float = 1.0

    @property
    def friction(self) -> float:
        """Whole friction, N m (N)."""
        return self.elastic + self.damping

    def arriving(self, torque: float) -> float:
        """What the motor gives, N m (N), where its current stands for `torque`."""
        return torque * (1.0 + self.gain - self.saturation * abs(torque))

    @property
    def total(self) -> float:
        """Torque of the model, N m (N)."""
        return self.gravity + self.elastic + self.damping + self.effects


class OnlineModel:
    """Gravity, friction and effects of a parameter file, evaluated sample by sample.

    Attributes:
        torque_constant: what leads from a reading of the motor, A or V, to the torque of the file.
        viscous: viscous coefficient, with what the back-EMF takes of a voltage.
        bristle: deflection z, rad (m); the controller may correct it while the axis rests.
        skipped: effects of the file that cannot act here, each as a sentence.
    """

    def __init__(self, parameters: Parameters, correction: Correction | None = None) -> None:
        """Read what is needed from the file; a `correction` acts as one more effect.

        Raises:
            InputError: the file lacks the torque constant, gravity or static friction.
        """
        self.axis = parameters.axis
        self.torque_constant = check_complete(parameters)
        self._parameters = parameters
        self._names: list[str] = []
        self._inside: list[tuple[Effect, Values]] = []
        self._outside: list[tuple[Effect, Values, Past | None]] = []
        self._thermometer = False
        for entry in parameters.effects:
            effect = registry.get(entry.name)
            values = effect.from_file(entry.values(), parameters.axis.kind)
            self._names.append(effect.name)
            self._thermometer |= effect.name == "thermal_drift" and "rate" in values
            if compiled.compiled(effect.name):
                self._inside.append((effect, values))
            else:
                self._outside.append((effect, values, _past(effect)))
        self._write()
        self.coulomb, self.static, self.stribeck_velocity, self.viscous, self.bristle_stiffness = map(
            float, self._numbers[compiled.COULOMB : compiled.SIGMA0 + 1]
        )
        self.bristle_damping = float(self._numbers[compiled.SIGMA1])
        slope = parameters.gravity.get("per_payload")
        self._per_payload = slope.value if slope else 0.0
        self._correction = correction
        self.skipped: list[str] = []
        self._warm = _Row(self.torque_constant, with_temperature=True)
        self._blind = _Row(self.torque_constant, with_temperature=False)
        self.load = Load()
        # compiled code is loaded at its first call, which takes longer than many periods of a real servo
        nowhere = Instant(*np.zeros(len(Instant._fields)))
        self.gravity(nowhere.position, nowhere.payload)
        self.update(nowhere)
        self.load = Load()
        self.reset()

    def _write(self) -> None:
        """Fill numbers and memory anew, for the effects that are compensated."""
        self._numbers = compiled.numbers_of(self._parameters, self._inside, self.torque_constant)
        self._memory = compiled.memory_of(self._inside)

    @property
    def friction_bound(self) -> float:
        """The most that friction can hold at rest, N m (N)."""
        return max(self.coulomb, self.static)

    @property
    def grip(self) -> float:
        """The most that the axis can hold at rest by friction and hysteresis, N m (N)."""
        return self.friction_bound + sum(effect.grips(values) for effect, values in self._inside)

    @property
    def inertia(self) -> float:
        """Inertia of the file, kg m^2 (kg); 0 where it has none."""
        return next((values["inertia"] for effect, values in self._inside if effect.name == "inertia"), 0.0)

    @property
    def holding(self) -> int:
        """How many effects hold a part of the friction level in place of the bristle."""
        return int(self._numbers[compiled.HOLDING])

    @property
    def held(self) -> tuple[float, float]:
        """What share of the friction level they hold, and the travel over which they yield, rad (m)."""
        share, reach = self._numbers[[compiled.HELD_SHARE, compiled.HELD_REACH]].tolist()
        return share, reach

    @property
    def presliding_stiffness(self) -> float:
        """What friction holds per travel before it slips, N m/rad (N/m)."""
        share, reach = self.held
        return self.bristle_stiffness + share * self.coulomb / reach

    @property
    def late(self) -> float:
        """By how much position and velocity lag the current by the file, s; 0 where the current is late."""
        delay = next((v["delay"] for effect, v in self._inside if effect.name == "transport_delay"), 0.0)
        return max(delay, 0.0)

    @property
    def bristle(self) -> float:
        """Deflection z, rad (m)."""
        return self._bristle

    @bristle.setter
    def bristle(self, value: float) -> None:
        self._bristle = value
        self._memory[compiled.BRISTLE] = value

    def uses(self, effect: str) -> bool:
        """Whether the file holds that effect and it is compensated."""
        return effect in self._names

    @property
    def needs_temperature(self) -> bool:
        """Whether an effect follows a measured temperature."""
        followed = self._correction is not None and self._correction.variable == "temperature"
        return followed or (self._thermometer and self.uses("thermal_drift"))

    def drop(self, effect: str, why: str) -> None:
        """Leave an effect out of the compensation and remember why."""
        if not self.uses(effect):
            return
        self._names.remove(effect)
        self._inside = [known for known in self._inside if known[0].name != effect]
        self._outside = [known for known in self._outside if known[0].name != effect]
        self._write()
        self.skipped.append(f"{effect} is not compensated: {why}")

    def reset(self) -> None:
        """Forget the motion; the bristle is straight and nothing has moved."""
        load = self.load
        load.gravity = load.elastic = load.damping = load.effects = 0.0
        self._memory[:] = 0.0
        self._bristle = 0.0
        for _, _, past in self._outside:
            if past is not None:
                past.first[0] = True

    def gravity(self, position: float, payload: float) -> float:
        """Gravity torque of an axis that stands upright, N m (N)."""
        return float(compiled.gravity_of(self._numbers, position, payload))

    def weight_of(self, payload: float, tilt_alpha: float, tilt_beta: float) -> float:
        """Gravity torque of a payload alone, N m (N); 0 for an arm, whose file does not know it."""
        return self._per_payload * payload * math.cos(tilt_alpha) * math.cos(tilt_beta)

    def update(self, now: Instant) -> Load:
        """Advance the bristle over the step that ends now and return what the motor carries: the same object
        every time."""
        if self._outside or self._correction is not None:
            self._ask_outside(now)
        load = self.load
        (
            load.gravity,
            load.elastic,
            load.damping,
            load.effects,
            load.level,
            load.saturation,
            load.gain,
            load.delay,
            self._bristle,
            load.kept,
            load.felt,
        ) = compiled.carry(self._numbers, self._memory, *now)
        return load

    def _ask_outside(self, now: Instant) -> None:
        """Effects that are not compiled: each by its own class, on a table of one row."""
        time, step, position, velocity, acceleration, payload, alpha, beta, temperature, _ = now
        factor = math.cos(alpha) * math.cos(beta)
        row = self._blind if math.isnan(temperature) else self._warm
        upright = self.gravity(position, payload)
        load = upright if self._parameters.gravity_model == "arm" else upright * factor
        row.fill(
            time, position, velocity, acceleration, payload, factor, alpha, beta, temperature, load, upright
        )
        total = [0.0] * len(FIELDS)
        for effect, values, past in self._outside:
            if past is None:
                part = effect.contribute(row.motion, values)
            else:
                past.step[0] = step
                part = effect.resume(row.motion, values, past)
                past.first[0] = False
            for k, name in enumerate(FIELDS):
                total[k] += _number(getattr(part, name))
        if self._correction is not None:
            total[_TORQUE] += self._corrected(row.motion, self._correction)
        self._memory[compiled.OUTSIDE : compiled.OUTSIDE + len(FIELDS)] = total

    def _corrected(self, motion: Motion, correction: Correction) -> float:
        """Torque of the correction at this sample, N m (N)."""
        values = getattr(motion, correction.variable)
        if values is None:
            return 0.0
        torque = correction.at(float(values[0]))
        if correction.with_direction:
            # at rest a noisy speed has no sign; what the bristle holds has the one of the friction
            level = self.load.level
            torque *= max(-1.0, min(1.0, self.load.elastic / level)) if level > 0.0 else 0.0
        return torque


def _past(effect: Effect) -> Past | None:
    if not effect.memory:
        return None
    return Past(np.ones(1, dtype=bool), np.zeros(1), np.zeros(effect.memory), np.zeros(1))


class _Row:
    """A `Motion` of one row that is filled in place, so that no sample allocates anew."""

    def __init__(self, torque_constant: float, *, with_temperature: bool) -> None:
        values = np.zeros((11, 1))
        self._cells = [values[k] for k in range(11)]
        c = self._cells
        self.motion = Motion(
            time=c[0],
            trial=np.zeros(1, dtype=np.intp),
            position=c[1],
            velocity=c[2],
            acceleration=c[3],
            payload=c[4],
            gravity_factor=c[5],
            tilt_alpha=c[6],
            tilt_beta=c[7],
            temperature=c[8] if with_temperature else None,
            load=c[9],
            load_upright=c[10],
            torque_constant=torque_constant,
        )

    def fill(self, *numbers: float) -> None:
        """Set time, position, ... load_upright, in the order of the cells."""
        for cell, number in zip(self._cells, numbers, strict=True):
            cell[0] = number


def _number(term: Term) -> float:
    return term if isinstance(term, float) else float(np.asarray(term).flat[0])


def check_complete(parameters: Parameters, file: Path | None = None) -> float:
    """Raise where the file lacks what a controller needs, or a contact is felt by; else its torque constant.

    Raises:
        InputError: no torque constant, gravity or static friction.
    """
    constant = parameters.axis.per_reading
    if constant is None:
        raise InputError(
            "the parameter file has no torque constant",
            file=file,
            place=f"axis.{parameters.axis.constant_key}",
            remedy="the controller reads the hand from the motor current; add it from the servo's data sheet",
        )
    if not parameters.gravity and not parameters.weightless:
        raise InputError(
            "the parameter file has no gravity model",
            file=file,
            place="[gravity]",
            remedy="add it with `ffc-id fit-gravity` or `ffc-id identify`; where gravity does not act write "
            'model = "none"',
        )
    if not parameters.static:
        raise InputError(
            "the parameter file has no friction model",
            file=file,
            place="[friction.static]",
            remedy="add it with `ffc-id fit-static` or `ffc-id identify`",
        )
    return float(constant)
