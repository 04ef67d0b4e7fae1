"""`ffc-id export`: what a parameter file becomes for other programs; each kind is imported when used."""

from __future__ import annotations

import importlib

import click

#: sub-command -> (module beside this one, function, help line)
COMMANDS: dict[str, tuple[str, str, str]] = {
    "mujoco": ("export_models", "mujoco", "MuJoCo: joint and actuator, with LuGre friction (MJCF)."),
    "urdf": ("export_models", "urdf", "URDF: Coulomb and viscous friction of a joint."),
    "ros2": ("export_models", "ros2", "ROS 2 parameter file (YAML)."),
    "json": ("export_models", "plain_json", "The whole parameter file as JSON."),
}


class _LazyGroup(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module, function, _ = COMMANDS[cmd_name]
        command: click.Command = getattr(importlib.import_module(f"idtool.cli.{module}"), function)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, _, text) in COMMANDS.items()])


@click.command(cls=_LazyGroup)
def export() -> None:
    """Write a parameter file as another program reads it."""
