"""`ffc-id export mujoco|isaac|urdf|ros2|...`: the model as simulators and other programs read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click

from .axis import Given, axis_options
from .common import PATH, Output, defaulted, force_option, handed, output_options, params_option
from .words import Choice

_friction_option = defaulted(
    "--friction",
    type=Choice(("auto", "coulomb")),
    default="auto",
    help="auto: the richest law that the target has; coulomb: Coulomb and viscous.",
)


@dataclass(frozen=True)
class _Asked:
    """What every target is asked."""

    logs: Sequence[Path]
    params: Path
    out: Path
    joint: str
    given: Given
    force: bool
    output: Output


_shared = handed(
    "asked",
    _Asked,
    click.argument("logs", nargs=-1, type=PATH, metavar="[LOG]..."),
    params_option(),
    click.option("-o", "--output", "out", required=True, type=PATH, help="File to write."),
    defaulted("--name", "joint", default="axis", help="Name of the joint."),
    axis_options,
    force_option,
    output_options,
)


def _run(target: str, friction: str, asked: _Asked) -> None:
    from idtool.export.targets import error_lines, export
    from idtool.io.atomic import refuse_existing, write_whole
    from idtool.model.units import unit_text
    from idtool.parameters import Parameters

    from .onward import logs_of

    params, out, logs, output = asked.params, asked.out, asked.logs, asked.output
    parameters = Parameters.read(params)
    refuse_existing(out, asked.force, params, *logs)
    read = asked.given.read(logs, output, parameters.axis) if logs else []
    exported = export(target, parameters, read, joint=asked.joint, friction=friction)
    write_whole(out, exported.text)

    lines = [
        *(f"not carried: {sentence}" for sentence in exported.plan.lost),
        *(f"note: {note}." for note in exported.plan.notes),
        *error_lines(exported.errors, parameters.axis.units),
        f"written: {out}",
    ]
    document = {
        "schema": "ffc-id/export/1",
        "target": target,
        "file": str(out),
        "not_carried": list(exported.plan.lost),
        "notes": list(exported.plan.notes),
        "unit": unit_text("torque", parameters.axis.units),
        "errors": exported.errors,
    }
    output.result(document, lines)
    # with logs it says what that costs
    if exported.plan.lost and not logs and (fitted := logs_of(parameters)):
        output.next("export", target, "-p", params, "-o", out, "--force", *fitted)
    else:
        output.next("tune", "-p", params, "--hand-force", "2")


def _target(name: str, text: str, law: str | None = "auto") -> click.Command:
    """The command of a target; `law` of friction, None where the target has several and `--friction` says."""

    def command(asked: _Asked, friction: str = law or "auto") -> None:
        _run(name, friction, asked)

    options = _shared if law else lambda function: _friction_option(_shared(function))
    return click.command(name, help=text)(options(command))


def from_outside(name: str) -> click.Command:
    """The command of a target that another package adds."""
    from idtool.export.targets import find

    return _target(name, f"Write the model for {find(name).title}.", None)


mujoco = _target(
    "mujoco",
    """Write a MuJoCo model (MJCF) of the joint: armature, damping and friction.

    LuGre friction becomes that of MuJoCo's dcmotor actuator (MuJoCo 3.12 or newer); --friction coulomb
    writes frictionloss instead. With logs, simplified friction is fitted to their range of speeds, and the
    torque error of the whole and the exported model is stated.

    \b
    ffc-id export mujoco -p result/params.toml -o axis.xml sine.csv
    """,
    None,
)
isaac = _target(
    "isaac",
    """Write an actuator's configuration for Isaac Lab and mjlab: armature, friction and gains.

    Gains come from [drive] of the parameter file, where a log held the goal. With logs, friction is fitted to
    their range of speeds, and the torque error of the whole and the exported model is stated.

    \b
    ffc-id export isaac -p result/params.toml -o actuator.py sine.csv
    """,
    "coulomb",
)
urdf = _target(
    "urdf",
    """Write a URDF of one joint with <dynamics damping friction>.

    With logs, the two numbers are fitted to their range of speeds, and the torque error of the whole and
    the exported model is stated.

    \b
    ffc-id export urdf -p result/params.toml -o axis.urdf sine.csv
    """,
)
ros2 = _target(
    "ros2",
    """Write every value as a ROS 2 parameter file (YAML), for a node of your own.

    \b
    ffc-id export ros2 -p result/params.toml -o axis.yaml
    """,
)
plain_json = _target(
    "json",
    """Write the whole parameter file as JSON, with errors and intervals.

    \b
    ffc-id export json -p result/params.toml -o params.json
    """,
)
bam = _target(
    "bam",
    """Write the parameters that mean the same in BAM (Rhoban's better actuator models), as its JSON.

    Coulomb, stiction, Stribeck and viscous friction, armature, torque constant and resistance: M1, or M2
    where there is a Stribeck curve. What M3 to M6 add is of another torque than ours, and is not written.

    \b
    ffc-id export bam -p result/params.toml -o bam.json
    """,
)
cogging = _target(
    "cogging",
    """Write what a motor controller adds at each angle against an identified ripple: 1024 rows over a turn.

    \b
    ffc-id export cogging -p result/params.toml -o cogging.csv
    """,
)
