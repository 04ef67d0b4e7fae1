"""`ffc-id init`: an axis file, by asking or from options."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .angles import radians, range_options
from .common import PATH, Output, defaulted, force_option, output_options
from .numbers import Number
from .words import Choice

if TYPE_CHECKING:
    from idtool.model.units import Kind

_KINDS = ("rotary", "linear")


@click.command()
@defaulted("-o", "--output", "target", default="axis.toml", type=PATH, help="The file to write.")
@click.option("--kind", type=Choice(_KINDS), help="Kind of axis.")
@click.option(
    "--torque-constant",
    "constant",
    type=Number(),
    metavar="K",
    help="Torque per current at the output shaft, N m/A (N/A on a linear axis).",
)
@click.option(
    "--name", metavar="TEXT", help="What this unit is called; ffc-id fleet tells units apart by it."
)
@range_options("Positions it may take, rad (m).")
@click.option("--max-speed", "speed", type=Number(), metavar="W", help="Highest speed, rad/s (m/s).")
@click.option("--max-current", "current", type=Number(), metavar="A", help="Highest current, A.")
@force_option
@output_options
def init(
    *,
    target: Path,
    reach: tuple[float, float] | None,
    reach_deg: tuple[float, float] | None,
    force: bool,
    output: Output,
    **told: Any,
) -> None:
    """Write an axis file: what is known of an axis before anything is measured on it.

    In a terminal it asks for what no option says; --kind alone is enough elsewhere. Commands that read
    logs take the file as --axis, and a servo as dynamixel:DEVICE,axis=FILE.

    \b
    ffc-id init
    ffc-id init --kind rotary --torque-constant 2.67 --name elbow -o elbow.toml
    """
    from idtool.errors import UsageError
    from idtool.io.atomic import refuse_existing
    from idtool.parameters.axis import Axis, check_constant
    from idtool.parameters.axis_file import AxisFile

    from .onward import logs_beside

    reach = radians("range", reach, reach_deg)
    if reach_deg is not None and told["kind"] == "linear":
        raise UsageError("--range-deg is for a rotary axis; pass --range in m.")
    refuse_existing(target, force)
    told["lowest"], told["highest"] = reach or (None, None)
    if told["kind"] is None:
        if not sys.stdin.isatty():
            raise UsageError("nobody is there to be asked; pass --kind rotary or --kind linear.")
        told = _ask(told)
    constant = told["constant"]
    if constant is not None:
        constant = check_constant(constant, argument="torque_constant")
    chosen: Kind = "linear" if told["kind"] == "linear" else "rotary"
    axis = Axis(chosen, constant, {"unit": told["name"]} if told["name"] else {})
    limits = {key: told[key] for key in ("lowest", "highest", "speed", "current") if told[key] is not None}
    file = AxisFile(axis, limits)
    file.write(target, force=force)

    lines = [f"written: {target}"]
    if chosen == "rotary":
        lines.append(f"a servo takes it too: --rig dynamixel:DEVICE,axis={target}")
    output.result(file.to_document() | {"file": str(target)}, lines)
    if logs := logs_beside([target], ("gravity", "sweep", "sine")):
        output.next("identify", "--axis", target, *logs, "-o", "result")
    else:
        output.next("import", "recording.csv", "-o", "log.csv")


def _ask(told: dict[str, Any]) -> dict[str, Any]:
    """What no option said, from a person; an empty answer leaves it out."""
    kind = click.prompt("kind of axis", type=Choice(_KINDS), default="rotary", err=True)
    turns = kind == "rotary"
    torque, position, ends = ("N m/A", "rad", "degrees") if turns else ("N/A", "m", "m")
    questions = {
        "constant": f"torque constant at the output, {torque}" if turns else f"force constant, {torque}",
        "name": "name of this unit",
        "lowest": f"lowest position, {ends}",
        "highest": f"highest position, {ends}",
        "speed": f"highest speed, {position}/s",
        "current": "highest current, A",
    }
    click.echo("Leave empty what you do not know.", err=True)
    answers: dict[str, Any] = {"kind": kind}
    for key, question in questions.items():
        if told[key] is not None:
            answers[key] = told[key]
            continue
        answers[key] = _answer(question, number=key != "name")
        if turns and key in ("lowest", "highest") and answers[key] is not None:
            answers[key] = math.radians(answers[key])
    return answers


def _answer(question: str, *, number: bool) -> Any:
    """One answer; None for an empty one."""

    def convert(text: str) -> Any:
        if not text.strip():
            return None
        try:
            return float(text) if number else text.strip()
        except ValueError as error:
            raise click.BadParameter(f'"{text}" is no number') from error

    return click.prompt(question, default="", show_default=False, value_proc=convert, err=True)
