"""A parameter file as the plant that `idtool.model.forward` simulates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from idtool.effects import registry
from idtool.effects.base import Effect, Values
from idtool.effects.torque_constant_saturation import per_torque
from idtool.errors import InputError
from idtool.model import forward, gravity, tabulated
from idtool.model.contribution import Contribution, combine, is_zero
from idtool.model.motion import Array, Motion
from idtool.model.stribeck import EXPONENT
from idtool.model.tabulated import Plant
from idtool.parameters import GRAVITY_MODELS, Parameters

#: Positions and velocities of the tables; lines between them are straight.
_POSITIONS = 8192
_VELOCITIES = 4096
#: So many times fewer will do where no effect has waves over the position.
_FEWER = 8
#: A slow speed, as a share of the table's: direction without size.
_SLOW = 1e-9
#: A limit of the command that is none; the difference of two is zero.
_UNLIMITED = 1e300
#: What `Contribution` calls the fields of the table over position, in their order.
_FIELDS = ("torque", "level_change", "level_torque", "static_change", "viscous_change", "gain_change")


@dataclass(frozen=True)
class PlantFile:
    """A parameter file taken apart for simulation.

    Attributes:
        parameters: the file.
        effects: those that the plant has, with their values.
        inertia: of the axis alone, kg m^2, or what stands for it.
        per_payload: what a kilogram of payload adds.
        delay: by how much position and velocity are reported late, s.
        saturation: relative loss of torque per torque.
        notes: what is left out, one sentence each.
        longest_step: of the simulation, s.
    """

    parameters: Parameters
    effects: tuple[tuple[Effect, Values], ...]
    inertia: float
    per_payload: float
    delay: float
    saturation: float
    notes: tuple[str, ...]
    longest_step: float = forward.LONGEST_STEP

    @classmethod
    def of(cls, parameters: Parameters, torque_constant: float | None) -> PlantFile:
        """Take the file apart.

        Args:
            parameters: the file.
            torque_constant: effort over current where the effort is one, for the effects that need it.

        Raises:
            InputError: no friction, or no inertia, without which nothing says how fast a torque acts.
        """
        if not parameters.static:
            raise InputError(
                "the parameter file has no [friction.static]",
                remedy="make it with ffc-id identify, or ffc-id fit-static",
            )
        effects: list[tuple[Effect, Values]] = []
        notes: list[str] = []
        numbers = {
            "inertia": 0.0,
            "per_payload": 0.0,
            "transport_delay": 0.0,
            "torque_constant_saturation": 0.0,
        }
        for entry in parameters.effects:
            effect = registry.get(entry.name)
            values = effect.from_file(entry.values(), parameters.axis.units)
            if entry.name == "torque_constant_saturation":
                numbers[entry.name] = per_torque(values, torque_constant)
            elif entry.name in numbers:
                numbers |= values if entry.name == "inertia" else {entry.name: values["delay"]}
            else:
                effects.append((effect, values))
                if effect.memory:
                    notes.append(f"the effect {entry.name} acts as it does while the axis slides on.")
        if numbers["inertia"] <= 0.0:
            raise InputError(
                "the parameter file has no inertia, so nothing says how fast a torque acts",
                place="[[effects]]",
                remedy="identify from logs that accelerate (ffc-id run-sine), which show it",
            )
        return cls(
            parameters,
            tuple(effects),
            numbers["inertia"],
            numbers["per_payload"],
            numbers["transport_delay"],
            numbers["torque_constant_saturation"],
            tuple(notes),
        )

    def plant(self, around: Surroundings, like: tuple[PlantFile, Plant] | None = None) -> Plant:
        """The plant of one trial; the position gain of its loop is left at 0.

        Args:
            around: what holds throughout the trial.
            like: a file and its plant there, whose tables hold if its gravity and effects are the same.
        """
        if like is None or like[0]._at_position != self._at_position:
            exponent, over_position = self._over_position(around)
        else:
            exponent, over_position = like[1].numbers[tabulated.EXPONENT], like[1].over_position
        if like is None or like[0]._at_velocity != self._at_velocity:
            over_velocity = self._over_velocity(around)
        else:
            over_velocity = like[1].over_velocity
        n = self._numbers(around.payload)
        n[tabulated.EXPONENT] = exponent
        n[tabulated.FIRST_POSITION], n[tabulated.FIRST_VELOCITY] = around.positions[0], around.velocities[0]
        n[tabulated.POSITION_STEP] = around.positions[1] - around.positions[0]
        n[tabulated.VELOCITY_STEP] = around.velocities[1] - around.velocities[0]
        return Plant(n, over_position, over_velocity)

    @property
    def _at_position(self) -> object:
        """What the table over position is made of."""
        return self.parameters.gravity, self.effects

    @property
    def _at_velocity(self) -> list[tuple[Effect, Values]]:
        """The effects that the table over velocity is made of."""
        return [one for one in self.effects if {"velocity", "direction"} & {*one[0].follows}]

    def _numbers(self, payload: float) -> Array:
        n = np.zeros(tabulated.NUMBERS)
        file, static = self.parameters, self.parameters.static
        told = None if file.drive is None else file.drive.back_emf
        back_emf = file.axis.back_emf_damping if told is None else told.value
        n[tabulated.INERTIA] = self.inertia + self.per_payload * payload
        n[tabulated.COULOMB] = static["coulomb"].value
        n[tabulated.STATIC] = static["static"].value
        n[tabulated.STRIBECK] = static["stribeck_velocity"].value
        n[tabulated.VISCOUS] = static["viscous"].value + file.axis.back_emf_damping
        n[tabulated.VISCOUS_OFF] = max(n[tabulated.VISCOUS] - back_emf, 0.0)
        if file.has_bristle:
            n[tabulated.SIGMA0] = file.dynamic["bristle_stiffness"].value
            n[tabulated.SIGMA1] = file.dynamic["bristle_damping"].value
        n[tabulated.SATURATION] = self.saturation
        if file.drive is not None:
            for entry, number in (
                (tabulated.VELOCITY_GAIN, file.drive.velocity_gain),
                (tabulated.DEAD_BAND, file.drive.dead_band),
                (tabulated.BEND, file.drive.bend),
            ):
                n[entry] = number.value if number is not None else 0.0
            limit = file.drive.limit
            n[tabulated.LIMIT] = limit.value if limit is not None and limit.identified else _UNLIMITED
        n[tabulated.TIME_STEP] = self.longest_step
        return n

    def _follow(self, *quantities: str) -> bool:
        """Whether an effect is a function of one of these."""
        return any(what in effect.follows for effect, _ in self.effects for what in quantities)

    def surroundings(self, motion: Motion, rows: slice) -> tuple[float, ...]:
        """What holds throughout a trial: payload, tilt and temperature; trials that agree share a plant."""
        names = ["payload", "gravity_factor", "tilt_alpha", "tilt_beta"]
        if self._follow("temperature"):
            names.append("temperature")
        return tuple(motion.typical(name, rows) or 0.0 for name in names)

    def around(self, motion: Motion, rows: slice) -> Surroundings:
        """Where the tables of one trial are filled.

        Args:
            motion: what was measured; positions and speeds far beyond it are not looked up.
            rows: of the trial, whose payload and tilt hold throughout.
        """
        fewer = 1 if self._follow("position") else _FEWER
        position = motion.position
        room = max(float(np.ptp(position)), 1e-3)
        positions = np.linspace(position.min() - room, position.max() + room, _POSITIONS // fewer)
        top = 3.0 * float(np.max(np.abs(motion.velocity))) + 1e-6
        velocities = np.linspace(-top, top, _VELOCITIES // fewer)
        return Surroundings(motion, rows, positions, velocities)

    def added(self, motion: Motion, rows: slice) -> Array:
        """Torque of effects that follow the clock, at each row of a trial, shape (rows,)."""
        if not self._follow("time"):
            return np.zeros(rows.stop - rows.start)
        trial = _surroundings(motion, rows, motion.position[rows], 0.0 * motion.velocity[rows])
        trial = replace(trial, position=np.full(len(trial), trial.position[0]))
        trial = self._loaded(trial, _gravity_columns(self.parameters.gravity_model, trial))
        torque = _sum(self.effects, replace(trial, time=motion.time[rows])).torque
        moving = np.broadcast_to(torque, len(trial))
        return np.asarray(moving - moving[0])

    def _over_position(self, around: Surroundings) -> tuple[float, Array]:
        """Stribeck exponent, and what is added at each position."""
        count = len(around.positions)
        at = self._loaded(around.over_position, around.gravity_columns(self.parameters.gravity_model))
        total = _sum(self.effects, at)
        table = np.zeros((count, 2, tabulated.FIELDS))
        for field, name in enumerate(_FIELDS):
            if not is_zero(term := getattr(total, name)):
                table[:, :, field] = _by_direction(term, count)
        if with_memory := [one for one in self.effects if one[0].memory]:
            # what an element that slips holds against the motion is friction, which no rest turns into a push
            held = 0.5 * np.diff(_by_direction(_sum(with_memory, at).torque, count), axis=1)
            table[:, :, tabulated.TORQUE] -= held * np.array([-1.0, 1.0])
            table[:, :, tabulated.LEVEL_TORQUE] += held
        if at.load is not None:
            table[:, :, tabulated.TORQUE] += _by_direction(at.load, count)
        exponent = EXPONENT + float(np.mean(total.exponent_change))
        return exponent, table.reshape(count, 2 * tabulated.FIELDS)

    def _over_velocity(self, around: Surroundings) -> Array:
        """Torque over velocity less what the direction alone makes; short where there is none."""
        if not self._at_velocity:
            return np.zeros(2)
        count = len(around.velocities)
        torque = _sum(self._at_velocity, around.over_velocity).torque
        fast, slow = np.broadcast_to(torque, 2 * count).reshape(2, count)
        return np.asarray(fast - slow)

    def _loaded(self, motion: Motion, columns: tuple[Array, Array]) -> Motion:
        """The motion with the load that the file's gravity makes of its columns, as it is and upright."""
        model = self.parameters.gravity_model
        if model is None:
            return motion
        coefficients = np.array([self.parameters.gravity[name].value for name in GRAVITY_MODELS[model]])
        return replace(motion, load=columns[0] @ coefficients, load_upright=columns[1] @ coefficients)


@dataclass(frozen=True)
class Surroundings:
    """What holds throughout a trial, and the positions and velocities at which tables are filled.

    Attributes:
        motion: what was measured.
        rows: of the trial.
        positions, velocities: evenly spaced, rad (m) and rad/s (m/s).
    """

    motion: Motion
    rows: slice
    positions: Array
    velocities: Array

    @property
    def payload(self) -> float:
        """Of the trial, kg."""
        return self.motion.typical("payload", self.rows) or 0.0

    def gravity_columns(self, model: str | None) -> tuple[Array, Array]:
        """Regressors of gravity over `over_position`, as it is and upright; computed once."""
        if model not in self._columns:
            self._columns[model] = _gravity_columns(model, self.over_position)
        return self._columns[model]

    @cached_property
    def _columns(self) -> dict[str | None, tuple[Array, Array]]:
        return {}

    @cached_property
    def over_position(self) -> Motion:
        """Every position, slowly backwards, then slowly forwards, each from far off."""
        slow = _SLOW * self.velocities[-1]
        velocity = np.repeat([-slow, slow], len(self.positions))
        there_and_back = np.concatenate([self.positions[::-1], self.positions])
        return _surroundings(self.motion, self.rows, there_and_back, velocity)

    @cached_property
    def over_velocity(self) -> Motion:
        """Every velocity, then its direction without a size, at the middle position."""
        slow = np.where(self.velocities > 0.0, _SLOW, -_SLOW) * self.velocities[-1]
        velocity = np.append(self.velocities, slow)
        middle = np.full(len(velocity), self.positions[len(self.positions) // 2])
        return _surroundings(self.motion, self.rows, middle, velocity)


def _surroundings(motion: Motion, rows: slice, position: Array, velocity: Array) -> Motion:
    """A motion that passes given positions and velocities with the payload and tilt of a trial."""
    size = len(position)

    def held(name: str) -> Array | None:
        typical = motion.typical(name, rows)
        return None if typical is None else np.full(size, typical)

    return Motion(
        time=np.full(size, motion.time[rows.start]),
        trial=np.zeros(size, dtype=np.intp),
        position=position,
        velocity=velocity,
        acceleration=np.zeros(size),
        payload=held("payload"),
        gravity_factor=held("gravity_factor"),
        tilt_alpha=held("tilt_alpha"),
        tilt_beta=held("tilt_beta"),
        temperature=held("temperature"),
        torque_constant=motion.torque_constant,
        clocks=np.zeros(size, dtype=np.intp),
    )


def _gravity_columns(model: str | None, motion: Motion) -> tuple[Array, Array]:
    if model is None:
        return np.zeros((len(motion), 0)), np.zeros((len(motion), 0))
    return gravity.columns(model, motion), gravity.upright_columns(model, motion)


def _by_direction(term: Array | float, count: int) -> Array:
    """Values over `Surroundings.over_position` by position and direction, shape (positions, 2)."""
    backwards, forwards = np.broadcast_to(term, 2 * count).reshape(2, count)
    return np.column_stack([backwards[::-1], forwards])


def _sum(effects: Sequence[tuple[Effect, Values]], motion: Motion) -> Contribution:
    return combine([effect.contribute(motion, values) for effect, values in effects])
