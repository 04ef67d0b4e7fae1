"""A parameter file as the plant that `idtool.model.forward` simulates."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from idtool.effects import registry
from idtool.effects.base import Effect, Values
from idtool.errors import InputError
from idtool.model import forward, gravity
from idtool.model.contribution import Contribution, combine
from idtool.model.forward import Plant
from idtool.model.motion import Array, Motion
from idtool.model.stribeck import EXPONENT
from idtool.parameters import GRAVITY_MODELS, Parameters

#: Positions and velocities of the tables; lines between them are straight.
_POSITIONS = 8192
_VELOCITIES = 4096
#: Of a fit that fills them anew at every step, where no effect has waves over the position.
_FEWER = 8
#: A slow speed, as a share of the table's: direction without size.
_SLOW = 1e-9


@dataclass(frozen=True)
class PlantFile:
    """A parameter file taken apart for simulation.

    Attributes:
        parameters: the file.
        effects: those that the plant has, with their values.
        inertia: kg m^2, or what stands for it.
        delay: by how much position and velocity are reported late, s.
        saturation: relative loss of torque per torque.
        notes: what is left out, one sentence each.
        coarse: whether longer steps and tables an eighth as fine will do.
    """

    parameters: Parameters
    effects: tuple[tuple[Effect, Values], ...]
    inertia: float
    delay: float
    saturation: float
    notes: tuple[str, ...]
    coarse: bool = False

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
        numbers = {"inertia": 0.0, "transport_delay": 0.0, "torque_constant_saturation": 0.0}
        for entry in parameters.effects:
            effect = registry.get(entry.name)
            values = effect.from_file(entry.values(), parameters.axis.units)
            if entry.name == "torque_constant_saturation":
                numbers[entry.name] = values["kappa"] / torque_constant if torque_constant else 0.0
            elif entry.name in numbers:
                numbers[entry.name] = values["inertia" if entry.name == "inertia" else "delay"]
            elif effect.memory:
                notes.append(f"the effect {entry.name} was left out: a simulation of it is not written yet.")
            else:
                effects.append((effect, values))
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
            numbers["transport_delay"],
            numbers["torque_constant_saturation"],
            tuple(notes),
        )

    def plant(self, motion: Motion, rows: slice, back_emf: float) -> Plant:
        """The plant of one trial; the position gain of its loop is left at 0.

        Args:
            motion: what was measured; positions and speeds far beyond it are not looked up.
            rows: of the trial, whose payload and tilt hold throughout.
            back_emf: damping that is there while the drive is on only, N m s/rad.
        """
        file = self.parameters
        position, velocity = motion.position, motion.velocity
        room = max(float(np.ptp(position)), 1e-3)
        fewer = _FEWER if self.coarse and not self._follow("position") else 1
        over = np.linspace(position.min() - room, position.max() + room, _POSITIONS // fewer)
        top = 3.0 * float(np.max(np.abs(velocity))) + 1e-6
        tables = np.vstack(
            [
                self._over_position(motion, rows, over, -_SLOW * top),
                self._over_position(motion, rows, over, _SLOW * top),
            ]
        )
        speeds = np.linspace(-top, top, _VELOCITIES // fewer)
        n = np.zeros(forward.NUMBERS)
        n[forward.INERTIA] = self.inertia
        static = file.static
        n[forward.COULOMB] = static["coulomb"].value
        n[forward.STATIC] = static["static"].value
        n[forward.STRIBECK] = static["stribeck_velocity"].value
        n[forward.EXPONENT] = self._exponent(motion)
        n[forward.VISCOUS] = static["viscous"].value + file.axis.back_emf_damping
        n[forward.VISCOUS_OFF] = max(n[forward.VISCOUS] - back_emf, 0.0)
        if file.has_bristle:
            n[forward.SIGMA0] = file.dynamic["bristle_stiffness"].value
            n[forward.SIGMA1] = file.dynamic["bristle_damping"].value
        n[forward.SATURATION] = self.saturation
        if file.drive is not None:
            for entry, number in (
                (forward.VELOCITY_GAIN, file.drive.velocity_gain),
                (forward.DEAD_BAND, file.drive.dead_band),
                (forward.BEND, file.drive.bend),
            ):
                n[entry] = number.value if number is not None else 0.0
            limit = file.drive.limit
            n[forward.LIMIT] = limit.value if limit is not None and limit.identified else math.inf
        n[forward.TIME_STEP] = forward.COARSE_STEP if self.coarse else forward.LONGEST_STEP
        n[forward.FIRST_POSITION], n[forward.POSITION_STEP] = over[0], over[1] - over[0]
        n[forward.FIRST_VELOCITY], n[forward.VELOCITY_STEP] = speeds[0], speeds[1] - speeds[0]
        return Plant(n, np.ascontiguousarray(tables), self._over_velocity(motion, rows, over, speeds))

    def _follow(self, *quantities: str) -> bool:
        """Whether an effect is a function of one of these."""
        return any(what in effect.follows for effect, _ in self.effects for what in quantities)

    def surroundings(self, motion: Motion, rows: slice) -> tuple[float, ...]:
        """What holds throughout a trial: payload, tilt and temperature; trials that agree share a plant."""
        names = ["payload", "gravity_factor", "tilt_alpha", "tilt_beta"]
        if self._follow("temperature"):
            names.append("temperature")
        return tuple(motion.typical(name, rows) or 0.0 for name in names)

    def added(self, motion: Motion, rows: slice) -> Array:
        """Torque of effects that follow the clock, at each row of a trial, shape (rows,)."""
        if not self._follow("time"):
            return np.zeros(rows.stop - rows.start)
        trial = _surroundings(motion, rows, motion.position[rows], 0.0 * motion.velocity[rows])
        trial = replace(trial, position=np.full(len(trial), trial.position[0]))
        moving = _column(self._sum(self._loaded(replace(trial, time=motion.time[rows]))).torque, len(trial))
        return np.asarray(moving - moving[0])

    def _over_position(self, motion: Motion, rows: slice, over: Array, velocity: float) -> Array:
        at = self._loaded(_surroundings(motion, rows, over, np.full(len(over), velocity)))
        total = self._sum(at)
        fields = (
            total.torque,
            total.level_change,
            total.level_torque,
            total.static_change,
            total.viscous_change,
            total.gain_change,
        )
        table = np.vstack([_column(field, len(over)) for field in fields])
        if at.load is not None:
            table[forward.TORQUE] += at.load
        return table

    def _over_velocity(self, motion: Motion, rows: slice, over: Array, speeds: Array) -> Array:
        """Torque over velocity less what the direction alone makes; short where there is none."""
        if not self._follow("velocity", "direction"):
            return np.zeros(2)
        middle = np.full(len(speeds), over[len(over) // 2])
        both = [speeds, np.where(speeds > 0.0, _SLOW, -_SLOW) * speeds[-1]]
        fast, slow = (
            _column(self._sum(self._loaded(_surroundings(motion, rows, middle, w))).torque, len(speeds))
            for w in both
        )
        return np.asarray(fast - slow) if np.any(fast != slow) else np.zeros(2)

    def _exponent(self, motion: Motion) -> float:
        change = self._sum(replace(motion, load=np.zeros(len(motion)), load_upright=np.zeros(len(motion))))
        return EXPONENT + float(np.mean(change.exponent_change))

    def _sum(self, motion: Motion) -> Contribution:
        return combine([effect.contribute(motion, values) for effect, values in self.effects])

    def _loaded(self, motion: Motion) -> Motion:
        """The motion with the load that the file's gravity makes."""
        model = self.parameters.gravity_model
        if model is None:
            return motion
        coefficients = np.array([self.parameters.gravity[name].value for name in GRAVITY_MODELS[model]])
        return replace(
            motion,
            load=gravity.columns(model, motion) @ coefficients,
            load_upright=gravity.upright_columns(model, motion) @ coefficients,
        )


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
    )


def _column(term: Array | float, rows: int) -> Array:
    return np.array(np.broadcast_to(np.asarray(term, dtype=float), (rows,)))
