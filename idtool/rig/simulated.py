"""A simulated rig: the compiled plant behind the interface of a real one.

What a fit is to find out stays inside: nothing of the truth is in `description`, in a sample or in any
public attribute.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from idtool.errors import InputError, RigFault
from idtool.model.motion import Array
from idtool.model.units import unit_text
from idtool.parameters.axis import Axis
from idtool.rig import plant
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup
from idtool.rig.numbers import plant_numbers
from idtool.rig.plant_file import STEP_S, PlantFile
from idtool.rig.sensors import SENSORS, Sensors

#: Samples computed, and noise drawn, in one call.
_BLOCK = 50
#: Time between two looks at the limits, s.
_YIELDED_S = 0.25
#: How far past its position limits the axis may get before the drive reports a fault, rad.
_OVERRUN = 0.05
#: Share of the steady bristle deflection within which a trial may start.
_START_SHARE = 0.9
#: Speed at which the axis is brought to the start of a trial, rad/s; its ramps take a second more.
_RETURN_SPEED = 0.5


class SimulatedRig(Rig):
    """One simulated axis.

    Args:
        file: the truth.
        seed: of noise and of the unknown bristle deflection at the start of each trial.
        sensors: name of the sensors; None takes the file's.
    """

    simulated = True

    def __init__(self, file: PlantFile, *, seed: int = 0, sensors: str | None = None) -> None:
        self.axis = file.axis
        self.period_s = file.period_s
        self.description = f"simulated: {file.description}"
        self.measures_temperature = file.temperature_sensor
        edges = file.limits
        self.limits = Limits(
            (edges["lowest_rad"], edges["highest_rad"]), edges["speed_rad_s"], edges["current_a"]
        )
        self._file = file
        self._sensors: Sensors = SENSORS[sensors or file.sensors]
        if self._sensors.duty_step > 0.0:
            # nothing leads from its duty to a torque until somebody finds it out
            self.measures, self.measures_voltage = "voltage", True
            self.axis = Axis(file.axis.kind, None, file.axis.extra)
            self.limits = Limits(self.limits.position, self.limits.speed)
        self._rng = np.random.default_rng(seed)
        self._steps = round(file.period_s / STEP_S)
        self._state, self._history = plant.blank_state()
        self._numbers = plant_numbers(file, TrialSetup())

    def prepare(self, setup: TrialSetup) -> None:
        """Bring the axis to rest, holding its position; the clock runs on by what that takes.

        The way there is not computed: the axis stands at the start in balance, its bristles deflected by an
        amount that nobody knows, and the drive then holds it for the rest.
        """
        self._open()
        self._prepared = False
        start = setup.start_position
        goal = float(self._state[plant.POSITION]) if start is None else float(start)
        low, high = self.limits.position
        if start is None:
            goal = min(max(goal, low), high)
        if not low <= goal <= high:
            raise RigFault(
                f"the axis cannot start at {goal:g} rad, outside its limits {low:g} to {high:g} rad"
            )
        if setup.rest_s < 0.0 or not math.isfinite(setup.rest_s):
            raise InputError("the rest before a trial must be a time of 0 s or more", place="rest_s")
        if not all(map(math.isfinite, (setup.payload_kg, setup.tilt_alpha_rad, setup.tilt_beta_rad))):
            raise InputError("payload and tilt of a trial must be finite numbers")
        self._numbers = plant_numbers(self._file, setup)
        way = abs(goal - self._state[plant.POSITION])
        self._settle(goal, float(self._state[plant.TIME]) + way / _RETURN_SPEED + (1.0 if way else 0.0))
        self._prepared = True
        count = math.ceil(setup.rest_s / self.period_s)
        if count:
            self._run(np.full(count, goal), plant.POSITION_MODE, 0.0)

    def _settle(self, goal: float, time: float) -> None:
        """Stand at a position with a bristle deflection that nobody knows, every torque in balance."""
        p, state = self._numbers, self._state
        factor = plant.thermal_factor(p, time)
        load = plant.gravity_torque(p, goal)
        level = plant.friction_level(p, goal, 0.0, load, 0.0, factor)
        limit = level / p.bristle_stiffness if p.bristle_stiffness > 0.0 else 0.0
        share = self._rng.uniform(-_START_SHARE, _START_SHARE, 2)
        state[:] = 0.0
        state[plant.TIME] = time
        state[plant.POSITION] = goal
        state[plant.BRISTLE] = share[0] * limit
        state[plant.HYSTERESIS] = share[1] * p.hysteresis_yield
        state[plant.PLAY] = goal - 0.5 * p.gap * share[1]
        if p.compliance > 0.0:
            # the load hangs on the spring; a second look at an arm's own angle is enough of a solution
            state[plant.LOAD_POSITION] = goal - load / p.compliance
            load = plant.gravity_torque(p, float(state[plant.LOAD_POSITION]))
            state[plant.LOAD_POSITION] = goal - load / p.compliance
        torque = (
            load * plant.engagement(p, state, load, level)
            + plant.effect_torque(p, goal, 0.0, time)
            + p.bristle_stiffness * state[plant.BRISTLE]
            + state[plant.HYSTERESIS]
        )
        state[plant.INTEGRAL] = p.torque_constant * _current(torque, p.torque_constant, p.kappa)
        if abs(state[plant.INTEGRAL]) > p.torque_constant * p.current_limit:
            unit = unit_text("torque", self.axis.kind)
            raise RigFault(
                f"the drive cannot hold this payload: it takes {abs(torque):.3g} {unit}, and the current "
                f"limit allows {p.torque_constant * p.current_limit:.3g}; lower the payload (kg)"
            )
        self._history[0] = goal
        self._history[1] = 0.0

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """Follow the commands, one sample per period of the rig, taken at the end of that period.

        Raises:
            RigFault: the axis left its limits; the samples up to there have been yielded.
        """
        self._ready()
        command = trajectory.held(self.period_s)
        mode = plant.VELOCITY_MODE if trajectory.mode == "velocity" else plant.POSITION_MODE
        most = max(round(_YIELDED_S / (_BLOCK * self.period_s)), 1)
        blocks: list[Block] = []
        try:
            for begin in range(0, len(command), _BLOCK):
                self._open()
                part = np.ascontiguousarray(command[begin : begin + _BLOCK])
                truth = self._run(part, mode, 0.0)
                good = self._within(truth[1])
                if good:
                    blocks.append(self._block(truth[:, :good], part[:good]))
                if good < len(part):
                    self.stop()
                    raise RigFault("the drive stopped because the axis left its position limits")
                if len(blocks) == most:
                    yield Block.joined(blocks)
                    blocks = []
        except RigFault:
            if blocks:
                yield Block.joined(blocks)
            raise
        if blocks:
            yield Block.joined(blocks)

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """Command a position and run one period; the torque is that of a simulated hand."""
        self._ready()
        if not (math.isfinite(position_command) and math.isfinite(external_torque_nm)):
            raise RigFault("the drive refused a command that is not a finite number")
        truth = self._run(np.array([float(position_command)]), plant.POSITION_MODE, float(external_torque_nm))
        if not self._within(truth[1]):
            self.stop()
            raise RigFault("the drive stopped because the axis left its position limits")
        block = self._block(truth, np.array([position_command]))
        readings = {field.name: getattr(block, field.name) for field in fields(Sample)}
        values = {name: None if value is None else float(value[0]) for name, value in readings.items()}
        return Sample(**values)  # type: ignore[arg-type]

    def stop(self) -> None:
        """Stop where the axis is: what moves is braked to rest within a fifth of a second."""
        if self._closed or not self._prepared or abs(self._state[plant.VELOCITY]) < 1e-3:
            return
        self._run(np.zeros(max(1, round(0.2 / self.period_s))), plant.VELOCITY_MODE, 0.0)

    def close(self) -> None:
        """Stop; afterwards the rig answers with a fault."""
        if not self._closed:
            self.stop()
            self._closed = True

    def _run(self, commands: Array, mode: int, hand: float) -> Array:
        out = np.empty((plant.READINGS, len(commands)))
        plant.run(self._numbers, self._state, self._history, commands, mode, hand, self._steps, out)
        if not (np.isfinite(out).all() and np.isfinite(self._state).all()):
            now = float(out[0, -1])
            self._state[:] = 0.0
            self._state[plant.TIME] = now
            self._prepared = False
            raise RigFault("the simulated axis ran away: an effect in its plant file is too strong to move")
        return out

    def _within(self, position: Array) -> int:
        """How many samples from the first lie within the position limits."""
        low, high = self.limits.position
        outside = (position < low - _OVERRUN) | (position > high + _OVERRUN)
        return int(np.argmax(outside)) if outside.any() else len(position)

    def _block(self, truth: Array, command: Array) -> Block:
        """What the sensors make of the truth."""
        reading = self._sensors.read(truth, self._rng)
        warm = reading[4] if self._file.temperature_sensor else None
        if self.measures == "current":
            return Block(reading[0], reading[1], reading[2], reading[3], command, warm)
        constant = self._numbers.torque_constant
        voltage, duty = self._sensors.electrical(truth, self._file.motor, constant, self._rng)
        return Block(reading[0], reading[1], reading[2], None, command, warm, voltage, duty)


def _current(torque: float, constant: float, kappa: float) -> float:
    """The current whose torque K i (1 - kappa |i|) is this, A."""
    if kappa == 0.0:
        return torque / constant
    inside = 1.0 - 4.0 * kappa * abs(torque) / constant
    if inside < 0.0:
        raise RigFault("the drive cannot hold this payload: its motor saturates")
    return math.copysign((1.0 - math.sqrt(inside)) / (2.0 * kappa), torque)
