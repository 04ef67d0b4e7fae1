"""The identified model, one sample at a time.

`OnlineModel` gives what the motor must carry at this instant: gravity, LuGre friction and every effect
of the parameter file. It is the same model as `idtool.model.torque.predict`, row for row (a test holds
the two together), but keeps the bristle's deflection between calls and works on plain floats, so that
a sample costs microseconds and not a table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from idtool.effects import registry
from idtool.effects.base import Effect, Past, Values
from idtool.errors import InputError
from idtool.model.contribution import FIELDS, Contribution, Term
from idtool.model.motion import Motion
from idtool.model.stribeck import EXPONENT
from idtool.parameters import Parameters

#: As in the batch model: effects never push the friction level below this share of its plain value.
_LEVEL_FLOOR = 0.02
#: Presliding travel assumed where the file has a friction level but no bristle, rad (m). Under an
#: encoder count of any servo, so that friction then acts as plain Coulomb friction.
_RIGID_PRESLIDING = 1e-4
#: Below this exponent 1 - exp(-x) loses its digits and its series is exact enough.
_SMALL = 1e-5

#: level_change, level_torque, static_change, exponent_change of a Contribution, summed over effects
_Changes = tuple[float, float, float, float]


@dataclass(slots=True)
class Load:
    """What the motor carries at one sample, N m (N): the model's share of K i.

    Attributes:
        gravity: gravity torque.
        friction: LuGre friction with the tracked bristle.
        effects: additive effects, inertia among them.
        level: friction level g at the present speed, effects included.
        saturation: relative loss of motor torque per torque, 1/(N m).
        delay: by how much position and velocity lag the current, s.
    """

    gravity: float = 0.0
    friction: float = 0.0
    effects: float = 0.0
    level: float = 0.0
    saturation: float = 0.0
    delay: float = 0.0

    @property
    def total(self) -> float:
        """Torque of the model, N m (N)."""
        return self.gravity + self.friction + self.effects


class OnlineModel:
    """Gravity, friction and effects of a parameter file, evaluated sample by sample.

    Attributes:
        bristle: deflection z, rad (m); the controller may correct it while the axis rests.
        skipped: effects of the file that cannot act here, each as a sentence.
    """

    def __init__(self, parameters: Parameters) -> None:
        """Read what is needed from the file.

        Raises:
            InputError: the file lacks the torque constant, gravity or static friction.
        """
        _check(parameters)
        self.axis = parameters.axis
        self.torque_constant = float(parameters.axis.torque_constant or 0.0)
        self._arm = parameters.gravity_model == "arm"
        self._gravity = tuple(p.value for p in parameters.gravity.values())
        static = parameters.static
        self.coulomb = static["coulomb"].value
        self.static = static["static"].value
        self.stribeck_velocity = static["stribeck_velocity"].value
        self.viscous = static["viscous"].value
        if parameters.dynamic:
            self.bristle_stiffness = parameters.dynamic["bristle_stiffness"].value
            self.bristle_damping = parameters.dynamic["bristle_damping"].value
        else:
            self.bristle_stiffness = max(self.coulomb, self.static, 1e-9) / _RIGID_PRESLIDING
            self.bristle_damping = 0.0
        self._floor = _LEVEL_FLOOR * min(self.coulomb, self.static) + 1e-12
        self._effects: list[tuple[Effect, Values]] = []
        self._past: dict[str, Past] = {}
        self.skipped: list[str] = []
        for entry in parameters.effects:
            effect = registry.get(entry.name)
            self._effects.append((effect, effect.to_values(entry.values())))
            if effect.memory:
                self._past[effect.name] = Past(
                    np.ones(1, dtype=bool), np.zeros(1), np.zeros(effect.memory), np.zeros(1)
                )
        self._warm = _Row(self.torque_constant, with_temperature=True)
        self._blind = _Row(self.torque_constant, with_temperature=False)
        self.load = Load()
        self.reset()

    @property
    def friction_bound(self) -> float:
        """The most that friction can hold at rest, N m (N)."""
        return max(self.coulomb, self.static)

    def uses(self, effect: str) -> bool:
        """Whether the file holds that effect and it is compensated."""
        return any(known.name == effect for known, _ in self._effects)

    @property
    def needs_temperature(self) -> bool:
        """Whether an effect follows a measured temperature."""
        return any(known.name == "thermal_drift" and "rate" in values for known, values in self._effects)

    def drop(self, effect: str, why: str) -> None:
        """Leave an effect out of the compensation and remember why."""
        if self.uses(effect):
            self._effects = [(known, values) for known, values in self._effects if known.name != effect]
            self.skipped.append(f"{effect} is not compensated: {why}")

    def reset(self) -> None:
        """Forget the motion; the bristle is straight and nothing has moved."""
        for past in self._past.values():
            past.first[0] = True
        self.bristle = 0.0
        self._last_velocity: float | None = None
        self._last_changes: _Changes = (0.0, 0.0, 0.0, 0.0)

    def gravity(self, position: float, payload: float, factor: float) -> float:
        """Gravity torque, N m (N)."""
        first, second = self._gravity
        if self._arm:
            return first * math.sin(position) + second * math.cos(position)
        return (first + second * payload) * factor

    def update(
        self,
        time: float,
        step: float,
        position: float,
        velocity: float,
        acceleration: float,
        payload: float,
        tilt_alpha: float,
        tilt_beta: float,
        temperature: float | None,
        travel: float | None = None,
    ) -> Load:
        """Advance the bristle over the step that ends now and return what the motor carries.

        Args:
            time: s, for effects that follow the clock.
            step: time since the sample before, s.
            position, velocity, acceleration: rad, rad/s, rad/s^2 (m ...).
            payload: kg.
            tilt_alpha, tilt_beta: rad.
            temperature: degrees Celsius, None if unknown.
            travel: change of position over the step. It drives the bristle if given: unlike a quantised
                velocity, its error does not add up. None: the mean of the two velocities does.

        Returns:
            The load; the same object every time.
        """
        load = self.load
        factor = math.cos(tilt_alpha) * math.cos(tilt_beta)
        load.gravity = self.gravity(position, payload, factor)
        total = dict.fromkeys(FIELDS, 0.0)
        if self._effects:
            row = self._blind if temperature is None else self._warm
            row.fill(
                time,
                position,
                velocity,
                acceleration,
                payload,
                factor,
                tilt_alpha,
                tilt_beta,
                0.0 if temperature is None else temperature,
                load.gravity,
                self.gravity(position, payload, 1.0),
            )
            for effect, values in self._effects:
                past = self._past.get(effect.name)
                if past is None:
                    _add(total, effect.contribute(row.motion, values))
                    continue
                past.step[0] = step
                _add(total, effect.resume(row.motion, values, past))
                past.first[0] = False
        changes = (
            total["level_change"],
            total["level_torque"],
            total["static_change"],
            total["exponent_change"],
        )
        if self._last_velocity is not None:
            # the bristle sees the mean of the step's two ends, as in the batch model
            middle = 0.5 * (velocity + self._last_velocity) if travel is None else travel / max(step, 1e-9)
            self._advance(middle, step, self._level(middle, _mean(changes, self._last_changes)))
        self._last_velocity = velocity
        self._last_changes = changes
        load.level = self._level(velocity, changes)
        pull = self.bristle_stiffness / load.level * abs(velocity)
        load.friction = (1.0 + total["bristle_change"]) * (
            (self.bristle_stiffness - self.bristle_damping * pull) * self.bristle
            + self.bristle_damping * velocity
        ) + self.viscous * (1.0 + total["viscous_change"]) * velocity
        load.effects = total["torque"]
        load.saturation = total["saturation"]
        load.delay = total["delay"]
        return load

    def _level(self, velocity: float, changes: _Changes) -> float:
        """Friction level g, with what the effects change about it (scalar twin of the batch model's)."""
        level_change, level_torque, static_change, exponent_change = changes
        ratio = abs(velocity) / self.stribeck_velocity
        exponent = EXPONENT + exponent_change
        fade = math.exp(-min(ratio * ratio if exponent == 2.0 else ratio**exponent, 700.0))
        plain = self.coulomb + (self.static * (1.0 + static_change) - self.coulomb) * fade
        return max(plain * (1.0 + level_change) + level_torque, self._floor)

    def _advance(self, velocity: float, step: float, level: float) -> None:
        """Exact step of the bristle for a velocity held over the step (see `idtool.model.lugre`)."""
        rho = self.bristle_stiffness / level
        x = rho * abs(velocity) * step
        decay = math.exp(-min(x, 700.0))
        if x > _SMALL:
            forced = math.copysign((1.0 - decay) / rho, velocity)
        else:
            forced = velocity * step * (1.0 - 0.5 * x)
        self.bristle = decay * self.bristle + forced


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


def _add(total: dict[str, float], part: Contribution) -> None:
    for name in FIELDS:
        term = getattr(part, name)
        if not (isinstance(term, float) and term == 0.0):
            total[name] += _number(term)


def _mean(a: _Changes, b: _Changes) -> _Changes:
    if a == b:
        return a
    return (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2]), 0.5 * (a[3] + b[3]))


def _check(parameters: Parameters) -> None:
    """Raise where the file cannot carry a controller."""
    if parameters.axis.torque_constant is None:
        raise InputError(
            "the parameter file has no torque constant",
            place=f"axis.{parameters.axis.constant_key}",
            remedy="the controller reads the hand from the motor current; add it from the servo's data sheet",
        )
    if not parameters.gravity:
        raise InputError(
            "the parameter file has no gravity model",
            place="[gravity]",
            remedy="add it with `ffc-id fit-gravity` or `ffc-id identify`",
        )
    if not parameters.static:
        raise InputError(
            "the parameter file has no friction model",
            place="[friction.static]",
            remedy="add it with `ffc-id fit-static` or `ffc-id identify`",
        )
