"""`ffc-id identify` and `ffc-id diagnose`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .axis import Given, axis_options
from .common import Output, force_option, output_options, seed_option
from .fit import friction_option, optimizer_option
from .numbers import NumberRange
from .progress import Progress
from .words import Choice, complete_effect

if TYPE_CHECKING:
    from rich.console import Console

    from idtool.verbs.identify import Identification

gravity_option = click.option(
    "--gravity",
    type=Choice(("auto", "slide", "arm", "none")),
    default="auto",
    show_default=True,
    help="Gravity model.",
)
without_option = click.option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    shell_complete=complete_effect,
    help="Do not consider this effect; may be repeated.",
)
validate_option = click.option(
    "--validate",
    multiple=True,
    metavar="LOG",
    type=click.Path(path_type=Path),
    help="Predict this log, which no fit sees, with the result; may be repeated.",
)
tolerance_option = click.option(
    "--tolerance",
    metavar="PERCENT",
    type=NumberRange(0.0, 100.0, max_open=True),
    help="An error of so many per cent of the torque is good enough: no further effect is looked for then.",
)


@click.command()
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@click.option(
    "-o", "--output", "folder", required=True, type=click.Path(path_type=Path), help="Result folder."
)
@friction_option
@gravity_option
@optimizer_option
@without_option
@tolerance_option
@validate_option
@click.option(
    "--known-load",
    is_flag=True,
    help="Find the torque constant too, from the load: payload_kg, or [axis] mass_kg, on [axis] lever_m.",
)
@click.option(
    "--weigh",
    type=Choice(("torque", "position")),
    default="torque",
    show_default=True,
    help="What the parameter file is fitted to at the end; position as in ffc-id fit-motion.",
)
@axis_options
@seed_option
@force_option
@output_options
def identify(
    logs: Sequence[Path],
    folder: Path,
    friction: str,
    gravity: str,
    optimizer: str,
    without: tuple[str, ...],
    tolerance: float | None,
    validate: tuple[Path, ...],
    known_load: bool,
    weigh: str,
    given: Given,
    seed: int,
    force: bool,
    output: Output,
) -> None:
    """All fits and the diagnosis in one go: params.toml, diagnosis.json, report.html, figures.

    What each log is, its header says. `--friction coulomb` fits the textbook model (inertia, offset,
    Coulomb, viscous) to compare with published ones, and looks for nothing else.

    \b
    ffc-id identify gravity.csv sweep.csv sine.csv -o result
    ffc-id identify *.csv --validate other-day.csv --without backlash -o result
    """
    from idtool.report.result_folder import result_folder
    from idtool.verbs.identify import identify as run

    read, unseen = given.read(logs, output), given.read(validate, output)
    with result_folder(folder, force):
        with Progress(output) as progress:
            result = run(
                read,
                seed=seed,
                friction=friction,
                gravity=gravity,
                optimizer=optimizer,
                without=without,
                tolerance=tolerance,
                validate=unseen,
                known_load=known_load,
                weigh=weigh,
                tell=progress.say,
            )
        finish(result, folder, seed, output)


@click.command()
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@click.option(
    "-p", "--params", required=True, type=click.Path(path_type=Path), help="Parameter file to start from."
)
@click.option(
    "-o", "--output", "folder", required=True, type=click.Path(path_type=Path), help="Result folder."
)
@friction_option
@without_option
@tolerance_option
@validate_option
@axis_options
@seed_option
@force_option
@output_options
def diagnose(
    logs: Sequence[Path],
    params: Path,
    folder: Path,
    friction: str,
    without: tuple[str, ...],
    tolerance: float | None,
    validate: tuple[Path, ...],
    given: Given,
    seed: int,
    force: bool,
    output: Output,
) -> None:
    """Find the effect that the model of a parameter file lacks; error before and after.

    The base model of the file is refitted on the training trials; effects that the file has already are
    looked for again like all others. The extended model is written to DIR/params.toml.

    \b
    ffc-id diagnose gravity.csv sweep.csv sine.csv -p params.toml -o result
    """
    from idtool.parameters import Parameters
    from idtool.report.result_folder import result_folder
    from idtool.verbs.identify import diagnose_from

    known = Parameters.read(params)
    read, unseen = (given.read(some, output, known.axis) for some in (logs, validate))
    with result_folder(folder, force):
        with Progress(output) as progress:
            result = diagnose_from(
                read,
                known,
                friction=friction,
                seed=seed,
                without=without,
                tolerance=tolerance,
                validate=unseen,
                tell=progress.say,
            )
        finish(result, folder, seed, output)


def finish(result: Identification, folder: Path, seed: int, output: Output) -> None:
    """Write the folder and print the verdict."""
    from idtool.report import write_report
    from idtool.report.next_step import next_step_of
    from idtool.report.result_folder import write_results

    output.warn(*result.recording.contradictions)  # before any number
    write_results(result, folder, command=command_line(), seed=seed)
    with Progress(output, "drawing the report"):
        page = write_report(folder)

    def show(console: Console) -> None:
        from .tables import print_parameters

        print_parameters(console, result.parameters, ("gravity", "static", "dynamic", "effects"))
        print_verdict(console, result.diagnosis)
        click.echo(f"report: {page}")

    output.result(result.diagnosis, show)
    output.next(*next_step_of(folder, result.recording.sources).words)


def command_line() -> str:
    """The command as it was typed, for the report."""
    import shlex

    return shlex.join(["ffc-id", *sys.argv[1:]])


def print_verdict(console: Console, diagnosis: dict[str, Any]) -> None:
    """Verdict, effects, error before and after, notes."""
    from idtool.diagnosis.summary import summary_lines

    first, *rest = summary_lines(diagnosis)
    console.print(f"\n{first}", style="bold", markup=False)
    for line in rest:
        click.echo(f"  {line}")
