"""Isaac Lab and mjlab: an actuator's configuration as Python, with armature, friction and gains.

Isaac Lab hands friction to PhysX, which has a static, a dynamic and a viscous part of each joint; mjlab hands
it to MuJoCo's `frictionloss`. Neither has a Stribeck curve or a bristle, nor any other effect. Reference:
Isaac Lab 2.2, `isaaclab.actuators.ImplicitActuatorCfg`; mjlab, `mjlab.actuator.BuiltinPositionActuatorCfg`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

from idtool.export.base import Plan, Target, comment_lines, number
from idtool.export.joint import inertia_alone, inertia_of, simulated
from idtool.log import Log
from idtool.parameters import Parameters


@final
class Isaac(Target):
    name = "isaac"
    title = "Isaac Lab and mjlab (Python)"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        return simulated(parameters, logs, friction, inertia_alone, bristle=False)

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        model = plan.model
        static = {name: number(model.static[name].value) for name in ("coulomb", "viscous")}
        armature = number(inertia_of(model) or 0.0)
        lines, stiffness, damping = _gains(model)
        return "\n".join(
            [
                *comment_lines(remarks),
                *lines,
                f"ARMATURE = {armature}  # all of the identified inertia; take off what your bodies have",
                "",
                "# Isaac Lab 2.2 or newer",
                "from isaaclab.actuators import ImplicitActuatorCfg",
                "",
                f"{joint.upper()} = ImplicitActuatorCfg(",
                f'    joint_names_expr=["{joint}"],',
                f"    stiffness={stiffness},",
                f"    damping={damping},",
                "    armature=ARMATURE,",
                f"    friction={static['coulomb']},",
                f"    dynamic_friction={static['coulomb']},",
                f"    viscous_friction={static['viscous']},",
                ")",
                "",
                "# mjlab: viscous friction is the damping of the joint in your MJCF",
                "from mjlab.actuator import BuiltinPositionActuatorCfg",
                "",
                f"{joint.upper()}_MJLAB = BuiltinPositionActuatorCfg(",
                f'    target_names_expr=("{joint}",),',
                f"    stiffness={stiffness},",
                f"    damping={damping},",
                "    armature=ARMATURE,",
                f"    frictionloss={static['coulomb']},",
                ")",
                "",
            ]
        )


def _gains(model: Parameters) -> tuple[list[str], str, str]:
    """Lines that define what the gains are made of, and the two gains, in torque per rad and per rad/s."""
    drive = model.drive
    if drive is None or drive.position_gain is None:
        lines = ["GAINS = (0.0, 0.0)  # no gains in the parameter file: put your own"]
        return lines, "GAINS[0]", "GAINS[1]"
    position = number(drive.position_gain.value)
    velocity = number(drive.velocity_gain.value if drive.velocity_gain else 0.0)
    if drive.command == "effort":
        return [], position, velocity
    per_volt = model.axis.voltage_constant
    known = "1.0" if per_volt is None else number(per_volt)
    return (
        [
            "SUPPLY_V = 12.0  # of your robot: the servo's gains are of a duty, a share of the supply",
            f"TORQUE_PER_DUTY = SUPPLY_V * {known}",
        ],
        f"{position} * TORQUE_PER_DUTY",
        f"{velocity} * TORQUE_PER_DUTY",
    )
