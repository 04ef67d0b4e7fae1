"""A virtual servo for a person: started from a plant, and told what a person does to a real one."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from idtool.errors import InputError, nearest
from idtool.rig.base import TrialSetup
from idtool.rig.clock import HostClock
from idtool.rig.plant_file import PlantFile
from idtool.virtual_servo.axis import VirtualAxis
from idtool.virtual_servo.base import VirtualServo
from idtool.virtual_servo.dynamixel import servo as dynamixel
from idtool.virtual_servo.dynamixel.families import FAMILIES
from idtool.virtual_servo.faults import Mishaps, parse_fault
from idtool.virtual_servo.feetech import servo as feetech
from idtool.virtual_servo.terminal import VirtualTerminal

#: What a person may say, each done by the method of its name; and how it is written.
COMMANDS = {
    "payload": "payload KG            hang another payload on the axis",
    "tilt": "tilt ALPHA BETA       tilt the axis, rad",
    "tilt-deg": "tilt-deg ALPHA BETA   the same in degrees",
    "hand": "hand NM               push with this torque; hand 0 lets go",
    "fault": "fault WORD            let something go wrong, as --fault does",
    "power": "power                 switch its power off and on",
    "status": "status                say where the axis is",
}


#: The heaviest payload, kg, and the strongest hand, N m: those of a recipe and beyond any servo.
_HEAVIEST, _STRONGEST = 1e4, 1e4


class Rehearsal(VirtualTerminal):
    """A virtual servo in real or scaled time.

    Args:
        plant: the axis behind it.
        kind: "dynamixel" or "feetech".
        id: of the servo.
        model: its model number; None is an XH540-V150 or an STS3215.
        baud: None is the rate that such a servo comes with.
        scale: seconds of the servo per second of the computer.
        faults: what goes wrong, as words.
        setup: payload and tilt at the start.
        seed: of noise and of faults.

    Raises:
        InputError: a fault that is none, a model that is not known, a baud rate that the servo has not, or a
            payload that no axis carries.
    """

    def __init__(
        self,
        plant: PlantFile,
        *,
        kind: str = "dynamixel",
        id: int = 1,
        model: int | None = None,
        baud: int | None = None,
        scale: float = 1.0,
        faults: tuple[str, ...] = (),
        setup: TrialSetup | None = None,
        seed: int = 0,
    ) -> None:
        self._setup = setup or TrialSetup()
        _check_payload(self._setup.payload_kg)
        clock = HostClock(scale)
        servo = virtual_servo(
            kind, plant, id=id, model=model, baud=baud, now=clock.now(), seed=seed, setup=self._setup
        )
        mishaps = Mishaps([parse_fault(word) for word in faults], seed=seed)
        super().__init__(servo, mishaps=mishaps, clock=clock)

    def do(self, line: str) -> str:
        """Do what a person does, and say what was done.

        Raises:
            InputError: not one of `COMMANDS`, or without its numbers.
        """
        word, *rest = line.split() or [""]
        if word not in COMMANDS:
            raise InputError(f'no command "{word[:40]}"', remedy=nearest(word[:40], COMMANDS))
        action: Callable[[list[str]], str] = getattr(self, f"_{word.replace('-', '_')}")
        with self.lock:
            self.servo.pass_time(self._clock.now())
            return action(rest)

    def _payload(self, words: list[str]) -> str:
        (payload,) = _numbers(words, 1, "payload")
        _check_payload(payload)
        return self._load(replace(self._setup, payload_kg=payload))

    def _tilt_deg(self, words: list[str]) -> str:
        alpha, beta = map(math.radians, _numbers(words, 2, "tilt-deg"))
        return self._load(replace(self._setup, tilt_alpha_rad=alpha, tilt_beta_rad=beta))

    def _tilt(self, words: list[str]) -> str:
        alpha, beta = _numbers(words, 2, "tilt")
        return self._load(replace(self._setup, tilt_alpha_rad=alpha, tilt_beta_rad=beta))

    def _load(self, setup: TrialSetup) -> str:
        self.servo.axis.load(setup)
        self._setup = setup
        alpha, beta = math.degrees(setup.tilt_alpha_rad), math.degrees(setup.tilt_beta_rad)
        return f"payload {setup.payload_kg:g} kg, tilt {alpha:.3g}° and {beta:.3g}°"

    def _hand(self, words: list[str]) -> str:
        (torque,) = _numbers(words, 1, "hand")
        if abs(torque) > _STRONGEST:
            raise InputError(f"no hand pushes with {torque:g} N m", remedy="write hand 0.2")
        self.servo.axis.hand_nm = torque
        return f"the hand pushes with {torque:g} N m"

    def _fault(self, words: list[str]) -> str:
        for fault in [parse_fault(word) for word in words]:  # all are read before one is in force
            self.mishaps.add(fault)
        return "as you wish"

    def _power(self, _: list[str]) -> str:
        self.servo.lose_power()
        return "its power was off for a moment"

    def _status(self, _: list[str]) -> str:
        servo, counts = self.servo, self.mishaps.counts
        torque = "on" if servo.torque else "off"
        struck = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
        return (
            f"position {servo.axis.position:.3f} rad, speed {servo.axis.velocity:.3f} rad/s, "
            f"torque {torque}, faults so far: {struck or 'none'}"
        )


#: Kind of servo -> sensors of its axis, model and baud rate that it comes with, and its baud rates.
_KINDS = {
    "dynamixel": ("dynamixel", 1150, 57600, dynamixel.BAUD_RATES.values()),
    "feetech": ("feetech", 777, 1_000_000, feetech.BAUD_RATES.values()),
}


def virtual_servo(
    kind: str,
    plant: PlantFile,
    *,
    id: int = 1,
    model: int | None = None,
    baud: int | None = None,
    now: float = 0.0,
    seed: int = 0,
    setup: TrialSetup | None = None,
) -> VirtualServo:
    """A virtual servo with an axis; the arguments are those of `Rehearsal`, and the clock's time at the
    start.

    Raises:
        InputError: a model that is not known, or a baud rate that the servo has not.
    """
    sensors, usual, rate, rates = _KINDS[kind]
    model, baud = model or usual, baud or rate
    if baud not in rates:
        raise InputError(f"the servo has no baud rate {baud}", remedy=f"take one of {sorted(rates)}")
    axis = VirtualAxis(plant, seed=seed, setup=setup, sensors=sensors)
    if kind == "feetech":
        return feetech.VirtualFeetech(axis, id=id, model=model, baud=baud, now=now)
    if model not in FAMILIES:
        known = ", ".join(map(str, FAMILIES))
        raise InputError(f"no virtual servo has model number {model}", remedy=f"take one of {known}")
    return dynamixel.VirtualDynamixel(axis, id=id, model=model, baud=baud, now=now)


def _check_payload(payload: float) -> None:
    if not 0.0 <= payload <= _HEAVIEST:
        said = f"a payload is 0 to {_HEAVIEST:g} kg, not {payload:g} kg"
        raise InputError(said, remedy="give kilograms, such as 0.4")


def _numbers(words: list[str], count: int, command: str) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        raise InputError(f"{command} takes {count} number{'s' * (count > 1)}", remedy=COMMANDS[command])
    return numbers
