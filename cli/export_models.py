"""`ffc-id export mujoco|isaac|urdf|ros2|...`: the model as simulators and other programs read it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .axis import Given, axis_options
from .common import Output, force_option, output_options
from .words import Choice

if TYPE_CHECKING:
    from rich.console import Console

Command = Callable[..., None]

_friction_option = click.option(
    "--friction",
    type=Choice(("auto", "coulomb")),
    default="auto",
    show_default=True,
    help="auto: the richest law that the target has; coulomb: Coulomb and viscous.",
)


def _shared(command: Command) -> Command:
    """The arguments and options that every target takes."""
    logs = click.argument("logs", nargs=-1, type=click.Path(path_type=Path), metavar="[LOG]...")
    params = click.option(
        "-p", "--params", required=True, type=click.Path(path_type=Path), help="Parameter file."
    )
    out = click.option(
        "-o", "--output", "out", required=True, type=click.Path(path_type=Path), help="File to write."
    )
    name = click.option("--name", "joint", default="axis", show_default=True, help="Name of the joint.")
    for option in (output_options, force_option, axis_options, name, out, params, logs):
        command = option(command)
    return command


@click.command(short_help="MuJoCo: joint and actuator, with LuGre friction (MJCF).")
@_friction_option
@_shared
def mujoco(friction: str, **options: Any) -> None:
    """Write a MuJoCo model (MJCF) of the joint: armature, damping and friction.

    LuGre friction becomes that of MuJoCo's dcmotor actuator (MuJoCo 3.12 or newer); --friction coulomb
    writes frictionloss instead. With logs, simplified friction is fitted to their range of speeds, and the
    torque error of the whole and the exported model is stated.

    \b
    ffc-id export mujoco -p result/params.toml -o axis.xml sine.csv
    """
    _run("mujoco", friction, **options)


@click.command(short_help="Isaac Lab and mjlab: an actuator's configuration (Python).")
@_shared
def isaac(**options: Any) -> None:
    """Write an actuator's configuration for Isaac Lab and mjlab: armature, friction and gains.

    Gains come from [drive] of the parameter file, where a log held the goal. With logs, friction is fitted to
    their range of speeds, and the torque error of the whole and the exported model is stated.

    \b
    ffc-id export isaac -p result/params.toml -o actuator.py sine.csv
    """
    _run("isaac", "coulomb", **options)


@click.command(short_help="URDF: Coulomb and viscous friction of a joint.")
@_shared
def urdf(**options: Any) -> None:
    """Write a URDF of one joint with <dynamics damping friction>.

    With logs, the two numbers are fitted to their range of speeds, and the torque error of the whole and
    the exported model is stated.

    \b
    ffc-id export urdf -p result/params.toml -o axis.urdf sine.csv
    """
    _run("urdf", "auto", **options)


@click.command(short_help="ROS 2 parameter file (YAML).")
@_shared
def ros2(**options: Any) -> None:
    """Write every value as a ROS 2 parameter file (YAML), for a node of your own.

    \b
    ffc-id export ros2 -p result/params.toml -o axis.yaml
    """
    _run("ros2", "auto", **options)


@click.command("json", short_help="The whole parameter file as JSON.")
@_shared
def plain_json(**options: Any) -> None:
    """Write the whole parameter file as JSON, with errors and intervals.

    \b
    ffc-id export json -p result/params.toml -o params.json
    """
    _run("json", "auto", **options)


@click.command(short_help="BAM: parameters of its models M1 and M2 (JSON).")
@_shared
def bam(**options: Any) -> None:
    """Write the parameters that mean the same in BAM (Rhoban's better actuator models), as its JSON.

    Coulomb, stiction, Stribeck and viscous friction, armature, torque constant and resistance: M1, or M2
    where there is a Stribeck curve. What M3 to M6 add is of another torque than ours, and is not written.

    \b
    ffc-id export bam -p result/params.toml -o bam.json
    """
    _run("bam", "auto", **options)


@click.command(short_help="A cogging map for a motor controller (CSV).")
@_shared
def cogging(**options: Any) -> None:
    """Write what a motor controller adds at each angle against an identified ripple: 1024 rows over a turn.

    \b
    ffc-id export cogging -p result/params.toml -o cogging.csv
    """
    _run("cogging", "auto", **options)


def from_outside(name: str) -> click.Command:
    """The command of a target that another package adds."""
    from idtool.export.targets import find

    @click.command(name, help=f"Write the model for {find(name).title}.")
    @_friction_option
    @_shared
    def command(friction: str, **options: Any) -> None:
        _run(name, friction, **options)

    return command


def _run(
    target: str,
    friction: str,
    *,
    logs: Sequence[Path],
    params: Path,
    out: Path,
    joint: str,
    given: Given,
    force: bool,
    output: Output,
) -> None:
    from idtool.export.targets import error_lines, export
    from idtool.io.atomic import atomic_write, refuse_existing
    from idtool.model.units import unit_text
    from idtool.parameters import Parameters

    parameters = Parameters.read(params)
    refuse_existing(out, force, params, *logs)
    read = given.read(logs, output, parameters.axis) if logs else []
    exported = export(target, parameters, read, joint=joint, friction=friction)
    with atomic_write(out) as stream:
        stream.write(exported.text)

    def show(console: Console) -> None:
        for sentence in exported.plan.lost:
            click.echo(f"not carried: {sentence}")
        for note in exported.plan.notes:
            click.echo(f"note: {note}.")
        for line in error_lines(exported.errors, parameters.axis.units):
            click.echo(line)
        click.echo(f"written: {out}")

    document = {
        "schema": "ffc-id/export/1",
        "target": target,
        "file": str(out),
        "not_carried": list(exported.plan.lost),
        "notes": list(exported.plan.notes),
        "unit": unit_text("torque", parameters.axis.units),
        "errors": exported.errors,
    }
    output.result(document, show)
    if exported.plan.lost and not logs:  # with logs it says what that costs
        output.next("export", target, "-p", params, "-o", out, "--force", "LOG...")
    else:
        output.next("tune", "-p", params, "--hand-force", "2")
