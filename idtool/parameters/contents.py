"""What the parts of the parameter file hold: names, dimensions, an effect, the controller."""

from __future__ import annotations

from dataclasses import dataclass

from idtool.parameters.parameter import Parameter

GRAVITY_MODELS: dict[str, dict[str, str]] = {
    "slide": {"base": "torque", "per_payload": "torque_per_payload"},
    "arm": {"sin": "torque", "cos": "torque"},
}
#: What a file says where gravity does not act on the axis.
NO_GRAVITY = "none"
STATIC: dict[str, str] = {
    "coulomb": "torque",
    "static": "torque",
    "stribeck_velocity": "velocity",
    "viscous": "damping",
}
DYNAMIC: dict[str, str] = {"bristle_stiffness": "stiffness", "bristle_damping": "damping"}
#: Control periods that a computer or a board keeps, s; shorter ones, and a tare is counted for minutes.
PERIODS_S = (1e-4, 1.0)
#: [controller]: key on a rotary and on a linear axis
CONTROLLER_KEYS: dict[str, tuple[str, str]] = {
    "command_gain": ("command_gain_s", "command_gain_s"),
    "loop_gain": ("loop_gain_rad_s_per_nm", "loop_gain_m_s_per_n"),
    "period": ("period_s", "period_s"),
    "start_torque": ("start_torque_nm", "start_force_n"),
}
#: Those that a file may leave out.
CONTROLLER_OPTIONAL = ("start_torque",)
CONTROLLER_MODES = ("paper", "light")


@dataclass(frozen=True)
class EffectEntry:
    """One `[[effects]]` entry: the effect's name and its parameters by base name."""

    name: str
    parameters: dict[str, Parameter]

    def __repr__(self) -> str:
        numbers = (f"{name} {parameter.in_short}" for name, parameter in self.parameters.items())
        return f"<{self.name}: {', '.join(numbers)}>"

    def values(self) -> dict[str, float]:
        """Plain numbers by base name."""
        return {name: parameter.value for name, parameter in self.parameters.items()}


@dataclass(frozen=True)
class Controller:
    """The `[controller]` table.

    Attributes:
        command_gain: K_r, s.
        loop_gain: K_c, rad/s per N m (m/s per N).
        period: s.
        start_torque: a hand below this starts no motion, N m (N); None: the mode's own.
        mode: "paper", the published law, or "light" (`idtool.control.admittance`).
    """

    command_gain: float
    loop_gain: float
    period: float
    start_torque: float | None = None
    mode: str = "paper"
