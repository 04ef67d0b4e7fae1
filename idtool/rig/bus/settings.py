"""What may follow the device in `dynamixel:DEVICE,key=value,...` and `feetech:DEVICE,...`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

from idtool.errors import InputError
from idtool.parameters.axis_file import AxisFile


@dataclass(frozen=True)
class Settings:
    """How to reach a servo and what it may do; None is as the servo itself says.

    Attributes:
        id: on the bus.
        baud: bits a second; None is the rate that the servo comes with.
        zero: position that counts as 0 rad, encoder counts.
        low, high: lowest and highest position, rad.
        speed: highest speed, rad/s.
        current: highest current, A, on a servo that measures one.
        duty: highest share of the supply's voltage at the motor, on a servo that measures no motor current.
        temperature: highest temperature, degrees Celsius.
        constant: torque constant at the output shaft, N m/A; None is the data sheet's.
        per_volt: torque per volt at the output shaft, N m/V, where no current of the motor is measured.
        period: time between samples, s; None is what bus and adapter can do.
        scale: seconds of the servo per second of the computer, for a virtual servo that runs faster.
        axis: file that gives constants, range, speed and current where the other words do not.
    """

    id: int = 1
    baud: int | None = None
    zero: int = 2048
    low: float | None = None
    high: float | None = None
    speed: float | None = None
    current: float | None = None
    duty: float | None = None
    temperature: float | None = None
    constant: float | None = None
    per_volt: float | None = None
    period: float | None = None
    scale: float = 1.0
    axis: AxisFile | None = None

    @classmethod
    def read(cls, words: Mapping[str, str]) -> Settings:
        """Settings from the words of a rig's name.

        Raises:
            InputError: a value is no number or out of its range.
        """
        file = _axis_file(words["axis"]) if "axis" in words else None
        numbers = _defaults(file) | {
            key: _number(key, value) for key, value in words.items() if key != "axis"
        }
        if numbers.get("low", -math.inf) >= numbers.get("high", math.inf):
            raise InputError("low is not below high", place="low", remedy="swap them")
        whole = {key: int(value) for key, value in numbers.items() if key in _WHOLE}
        return cls(**(numbers | whole), axis=file)  # type: ignore[arg-type]

    def refuse(self, word: str, why: str, remedy: str) -> None:
        """Refuse a word that the servo has no use for; the axis file may give it all the same.

        Raises:
            InputError: the word was given.
        """
        if getattr(self, word) is not None and word not in _defaults(self.axis):
            raise InputError(why, place=word, remedy=remedy)


def _axis_file(path: str) -> AxisFile:
    file = AxisFile.read(path)
    if file.axis.kind != "rotary":
        raise InputError(
            f"is of a {file.axis.kind} axis and a servo turns",
            file=path,
            place="axis.kind",
            remedy="name the file of a rotary axis",
        )
    return file


def _defaults(file: AxisFile | None) -> dict[str, float]:
    """What the file says, in the words of the rig."""
    if file is None:
        return {}
    words = {"lowest": "low", "highest": "high", "speed": "speed", "current": "current"}
    numbers = {words[name]: value for name, value in file.limits.items()}
    if file.axis.torque_constant is not None:
        numbers["constant"] = file.axis.torque_constant
    if file.axis.torque_per_volt is not None:
        numbers["per_volt"] = file.axis.torque_per_volt
    return {key: _number(key, f"{value!r}") for key, value in numbers.items()}


#: Option names, as `--rig` takes them.
OPTIONS = tuple(field.name for field in fields(Settings))
_WHOLE = ("id", "baud", "zero")
_RANGES = {
    "id": (0.0, 252.0),
    "baud": (9600.0, 4_000_000.0),
    "zero": (-1_048_575.0, 1_048_575.0),
    "low": (-1600.0, 1600.0),
    "high": (-1600.0, 1600.0),
    "speed": (0.05, 24.0),
    "current": (0.003, 5.5),
    "duty": (0.05, 1.0),
    "temperature": (20.0, 100.0),
    "constant": (1e-3, 100.0),
    "per_volt": (1e-4, 100.0),
    "period": (0.001, 0.1),
    "scale": (0.1, 100.0),
}


def _number(key: str, value: str) -> float:
    low, high = _RANGES[key]
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not low <= number <= high or (key in _WHOLE and number != int(number)):
        what = "a whole number" if key in _WHOLE else "a number"
        raise InputError(
            f'"{value[:40]}" is not {what} from {low:g} to {high:g}', place=key, remedy="correct it"
        )
    return number
