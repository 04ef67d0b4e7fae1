"""`ffc-id export`: a parameter file as something else; each form is a sub-command imported when used."""

from __future__ import annotations

import click

from .lazy import LazyGroup

#: sub-command -> (module beside this one, function, help line)
COMMANDS: dict[str, tuple[str, str, str]] = {
    "c": ("export_c", "export_c", "The force-free controller as C99, with an Arduino sketch."),
    "mujoco": ("export_models", "mujoco", "MuJoCo: joint and actuator, with LuGre friction (MJCF)."),
    "isaac": ("export_models", "isaac", "Isaac Lab and mjlab: an actuator's configuration (Python)."),
    "urdf": ("export_models", "urdf", "URDF: Coulomb and viscous friction of a joint."),
    "ros2": ("export_models", "ros2", "ROS 2 parameter file (YAML)."),
    "json": ("export_models", "plain_json", "The whole parameter file as JSON."),
    "bam": ("export_models", "bam", "BAM: parameters of its models M1 and M2 (JSON)."),
    "cogging": ("export_models", "cogging", "A cogging map for a motor controller (CSV)."),
}


@click.command(cls=LazyGroup, commands_of=COMMANDS)
def export() -> None:
    """Turn a parameter file into what other programs and boards use.

    \b
    ffc-id export c -p result/params.toml -o board --range -1.5 1.5
    ffc-id export mujoco -p result/params.toml -o axis.xml sine.csv
    """
