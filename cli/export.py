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


class ExportGroup(LazyGroup):
    """The forms of the tool, and those that other packages add (`ffc_id.exports`)."""

    def known(self) -> dict[str, tuple[str, str, str]]:
        from idtool.io.entry_points import outside

        added = {
            name: ("export_models", "", f"Added by {point.dist.name if point.dist else 'a package'}.")
            for name, point in outside("ffc_id.exports", COMMANDS).items()
        }
        return super().known() | added

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name in COMMANDS or cmd_name not in self.known():
            return super().get_command(ctx, cmd_name)
        from .export_models import from_outside

        return from_outside(cmd_name)


@click.command(cls=ExportGroup, commands_of=COMMANDS)
def export() -> None:
    """Turn a parameter file into what other programs and boards use.

    \b
    ffc-id export c -p result/params.toml -o board --range -1.5 1.5
    ffc-id export mujoco -p result/params.toml -o axis.xml sine.csv
    """
