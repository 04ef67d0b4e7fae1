"""A virtual servo on a bench: in this process, on a clock that skips waits, behind its vendor's SDK."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from idtool.rig.base import TrialSetup
from idtool.rig.bus.rig import ServoRig
from idtool.rig.bus.settings import Settings
from idtool.rig.clock import SkippingClock
from idtool.rig.dynamixel.servo import DYNAMIXEL
from idtool.rig.feetech.servo import FEETECH
from idtool.rig.opening import read_plant
from idtool.virtual_servo.dynamixel.table import FIELDS
from idtool.virtual_servo.faults import Mishaps, parse_fault
from idtool.virtual_servo.feetech.table import FIELDS as FEETECH_FIELDS
from idtool.virtual_servo.rehearsal import virtual_servo
from idtool.virtual_servo.terminal import VirtualTerminal

_HEADER = """
schema = "ffc-id/recipe/1"
name = "{0}"
experiment = "{0}"
[setup]
tilt_alpha_rad = {1}
[[trials]]
"""
#: The bundled recipes, shortened: name -> text.
SHORT_SESSION = {
    "gravity": _HEADER.format("gravity", 0.0)
    + """
kind = "back_and_forth"
payload_kg = [0.0, 0.5, 1.0]
speed_rad_s = 0.3
travel_rad = 0.8
""",
    "sweep": _HEADER.format("sweep", np.pi / 2)
    + """
kind = "back_and_forth"
speed_rad_s = [0.024, 0.048, 0.096, 0.192, 0.384, 0.767]
travel_rad = [0.12, 0.16, 0.24, 0.4, 0.8, 1.6]
""",
    "sine": _HEADER.format("sine", np.pi / 2)
    + """
kind = "sine"
frequency_hz = [0.5, 1.0]
amplitude_rad_s = 0.6
duration_s = 8.0
""",
}
BAUD = 1_000_000
#: Lying on its side: without torque it stays where it is.
FLAT = TrialSetup(tilt_alpha_rad=np.pi / 2)
#: What a servo measures, and goals: they change with every motion.
MEASURED = {
    "goal_position", "goal_velocity", "realtime_tick", "present_current", "present_velocity",
    "present_position", "present_temperature", "present_pwm", "present_input_voltage",
    "present_speed", "present_load", "present_voltage", "moving", "goal_speed", "acceleration",
}  # fmt: skip


class Bench:
    """A virtual servo and its surroundings."""

    def __init__(
        self,
        *faults: str,
        plant: str = "bench",
        kind: str = "dynamixel",
        model: int | None = None,
        seed: int = 0,
    ) -> None:
        self.clock = SkippingClock()
        self._kind = {"dynamixel": DYNAMIXEL, "feetech": FEETECH}[kind]
        self._fields = FIELDS if kind == "dynamixel" else FEETECH_FIELDS
        # any of both kinds: its table holds what a test looks at
        self.servo: Any = virtual_servo(
            kind, read_plant(plant), model=model, baud=BAUD, now=self.clock.now(), seed=seed, setup=FLAT
        )
        self.mishaps = Mishaps([parse_fault(word) for word in faults], seed=seed)
        self.terminal = VirtualTerminal(self.servo, mishaps=self.mishaps, clock=self.clock)
        self.clock.others = self.terminal.take_turn

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.terminal.close()

    def bus(self, **other: Any) -> Any:
        wanted: dict[str, Any] = {"device": self.terminal.path, "id": 1, "baud": BAUD, "clock": self.clock}
        return self._kind.open_bus(*(wanted | other).values())

    def rig(self, **settings: Any) -> ServoRig:
        wanted: dict[str, Any] = {"baud": BAUD}
        return ServoRig(self.terminal.path, Settings(**(wanted | settings)), self._kind, clock=self.clock)

    def setup(self, trial: int, trials: int, setup: TrialSetup, before: TrialSetup | None) -> None:
        """What a person does between trials."""
        with self.terminal.lock:
            self.servo.axis.load(setup)

    def table(self) -> dict[str, int]:
        """The control table without what a motion changes."""
        with self.terminal.lock:
            return {name: self.servo.table[name] for name in self._fields if name not in MEASURED}

    def later(self, seconds: float) -> tuple[float, float]:
        """Position and speed of the axis after so long in which nobody says anything."""
        with self.terminal.lock:
            self.clock.wait_until(self.clock.now() + seconds)
            self.servo.pass_time(self.clock.now())
            return self.servo.axis.position, self.servo.axis.velocity

    def stands(self, seconds: float) -> bool:
        """Whether the axis stands after so long, and goes on standing."""
        first, speed = self.later(seconds)
        second, _ = self.later(1.0)
        return abs(speed) < 1e-2 and abs(second - first) < 2e-3
