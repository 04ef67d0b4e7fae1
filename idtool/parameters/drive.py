"""The servo's own position loop, `[drive]` of the parameter file.

    command = p (goal(t - delay) - q) - d w,   held within +- limit
    effort  = supply * c / (1 + b |c|),        c = command less the dead band

The command is a duty (share of the supply, -1 to 1) where the log holds one, else the effort itself. On a
servo whose gain can be set, `position_gain` is the one at `gain_setting`, and another setting (`[drive]
gain_setting` of a log) changes it in proportion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

from idtool.errors import InputError, nearest
from idtool.io.toml import is_finite, short
from idtool.model.units import Units, file_key
from idtool.parameters.parameter import Parameter

Command = Literal["duty", "effort"]
_DIMENSIONS: dict[Command, dict[str, str]] = {
    "duty": {
        "position_gain": "per_position",
        "velocity_gain": "per_velocity",
        "limit": "number",
        "dead_band": "number",
        "bend": "number",
    },
    "effort": {"position_gain": "stiffness", "velocity_gain": "damping", "limit": "torque"},
}


@dataclass(frozen=True)
class Drive:
    """The table.

    Attributes:
        command: what the loop commands, "duty" or "effort".
        position_gain: p, duty or effort per rad (m); it and the next three are None where no log told a
            goal, so that the loop is not known.
        velocity_gain: d, duty or effort per rad/s (m/s).
        limit: the most that it commands; not identified where no log reached it.
        delay: by how much the goal acts later than it is logged, s.
        back_emf: the part of the viscous coefficient that is there only while the drive is on, since it is
            the motor's back-EMF; None where that is not known.
        dead_band: command that makes no torque yet; None where it was not looked for.
        bend: b; at full command the drive makes 1 / (1 + b) of what its first part promises; None likewise.
        gain_setting: the servo's own number for the gain at which `position_gain` holds; None where no log
            told one.
    """

    command: Command
    position_gain: Parameter | None = None
    velocity_gain: Parameter | None = None
    limit: Parameter | None = None
    delay: Parameter | None = None
    gain_setting: float | None = None
    back_emf: Parameter | None = None
    dead_band: Parameter | None = None
    bend: Parameter | None = None

    def to_table(self, units: Units) -> dict[str, Any]:
        """The TOML table."""
        table: dict[str, Any] = {"command": self.command}
        for name, dimension in dimensions(self.command).items():
            if getattr(self, name) is None:
                continue
            table[file_key(name, dimension, units)] = getattr(self, name).to_table()
        if self.gain_setting is not None:
            table["gain_setting"] = self.gain_setting
        return table

    def gain_at(self, setting: float | None) -> float:
        """Position gain at a setting of the servo; that of the file where either is not known, 0 without."""
        if self.position_gain is None:
            return 0.0
        known = setting is not None and self.gain_setting is not None
        return self.position_gain.value * (setting / self.gain_setting if known else 1.0)  # type: ignore[operator]


def with_loop(drive: Drive | None, loop: Drive) -> Drive:
    """The loop of one table with what another knows of the bend and the back-EMF."""
    if drive is None or drive.command != loop.command:
        return loop
    return replace(loop, back_emf=drive.back_emf, dead_band=drive.dead_band, bend=drive.bend)


def dimensions(command: Command) -> dict[str, str]:
    """Name -> dimension of every number of the table."""
    return {**_DIMENSIONS[command], "delay": "time", "back_emf": "damping"}


#: The loop itself: there as a whole, or not at all.
LOOP = ("position_gain", "velocity_gain", "limit", "delay")


def check_drive(table: Mapping[str, Any]) -> tuple[Command, float | None]:
    """What the table says besides its identified numbers.

    Raises:
        InputError: an unknown command, or a setting that is no number above zero.
    """
    command = table.get("command")
    if command not in _DIMENSIONS:
        raise InputError(
            "is missing" if command is None else f"unknown command {short(command)}",
            place="drive.command",
            remedy=nearest(short(command).strip("'"), _DIMENSIONS),
        )
    setting = table.get("gain_setting")
    if setting is not None and (not is_finite(setting) or setting <= 0):
        raise InputError(
            f"expected a number above zero, found {short(setting)}",
            place="drive.gain_setting",
            remedy="correct it",
        )
    return command, None if setting is None else float(setting)
