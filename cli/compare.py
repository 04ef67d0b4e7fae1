"""`ffc-id compare`: two parameter files side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .axis import Given, axis_options
from .common import PATH, Output, output_options

if TYPE_CHECKING:
    from idtool.compare.comparison import Comparison
    from idtool.compare.paired_errors import ErrorLine
    from idtool.parameters import Parameter, Parameters

    from .screen import Screen


@click.command()
@click.argument("a", metavar="A", type=PATH)
@click.argument("b", metavar="B", type=PATH)
@click.argument("logs", nargs=-1, type=PATH, metavar="[LOG]...")
@axis_options
@output_options
def compare(a: Path, b: Path, logs: Sequence[Path], given: Given, output: Output) -> None:
    """Compare two parameter files: unit to unit, or before and after maintenance.

    Says which parameters differ beyond the standard errors of both fits, corrected for how many are
    compared. With logs, also which file predicts them better beyond chance; best give logs that neither
    was fitted to. How much one axis varies from day to day, two files cannot tell: see ffc-id fleet.

    \b
    ffc-id compare before/params.toml after/params.toml
    ffc-id compare before/params.toml after/params.toml validation.csv
    """
    from idtool.compare.comparison import compare as run
    from idtool.parameters import Parameters

    one, other = Parameters.read(a), Parameters.read(b)
    known = one.axis if one.axis.torque_constant is not None else other.axis
    comparison = run(one, other, given.read(logs, output, known))
    document = comparison.to_document() | {"a": str(a), "b": str(b)}
    output.result(document, lambda screen: _show(screen, comparison, a, b))
    if logs:
        output.next("fleet", "SESSIONS/", "-o", "fleet")
    else:
        output.next(*_with_logs(a, b, one, other))


def _with_logs(a: Path, b: Path, one: Parameters, other: Parameters) -> list[str | Path]:
    """The same with logs that are there, or the run that makes one."""
    from .onward import ANY_RIG, logs_beside, logs_of

    fitted = logs_of(one, other)
    if logs := logs_beside([a, b, *fitted], ("validation",)) or fitted:
        return ["compare", a, b, *logs]
    return ["run", "--recipe", "validation", "--rig", other.rig or one.rig or ANY_RIG, "-o", "validation.csv"]


def _show(screen: Screen, comparison: Comparison, a: Path, b: Path) -> None:
    from idtool.model.units import unit_text
    from idtool.presentation.text import number

    from .tables import print_table

    screen.print(comparison.sentence, bold=True)
    click.echo(f"\nA: {a}\nB: {b}\n")
    print_table(
        screen,
        ("parameter", ">A", ">B", ">B − A", ">z", "unit", ""),
        [
            (
                line.title,
                _value(line.a),
                _value(line.b),
                "" if line.difference is None else number(line.difference, 3),
                "" if line.z is None else f"{line.z:+.1f}".replace("-", "−"),
                line.unit,
                "differs" if line.differs else line.why,
            )
            for line in comparison.parameters
        ],
    )
    if comparison.errors:
        unit = unit_text("torque", comparison.kind)
        click.echo(f"\nprediction error, rms, {unit}")
        print_table(
            screen, ("logs", ">A", ">B", ">pairs", ">p", ""), [_error_row(line) for line in comparison.errors]
        )
    if comparison.positions is not None:
        one, other = comparison.positions
        click.echo(
            f"\nsimulated position, rms over windows of 1 s: {one['rms_1s_windows']:.4g} {one['unit']} (A), "
            f"{other['rms_1s_windows']:.4g} {other['unit']} (B)"
        )
    for note in comparison.notes:
        click.echo(f"note: {note}")


def _value(parameter: Parameter | None) -> str:
    """A value, cut where its standard error has its second digit."""
    from idtool.presentation.text import uncertain

    return "" if parameter is None else uncertain(parameter.value, parameter.stderr, None)[0]


def _error_row(line: ErrorLine) -> tuple[str, ...]:
    from idtool.presentation.text import number, p_text

    better = "" if line.better is None else f"{line.better.upper()} is better"
    return (
        line.experiment or "all",
        number(line.a),
        number(line.b),
        f"{line.pairs} {'blocks' if line.blocks else 'trials'}",
        p_text(line.corrected),
        better,
    )
