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
from .progress import Progress
from .words import Choice

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


@click.command()
@click.argument("logs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="LOG...")
@click.option(
    "-o", "--output", "folder", required=True, type=click.Path(path_type=Path), help="Result folder."
)
@friction_option
@gravity_option
@optimizer_option
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
    """
    from idtool.report.result_folder import result_folder
    from idtool.verbs.identify import identify as run

    read = given.read(logs, output)
    with result_folder(folder, force):
        with Progress(output) as progress:
            result = run(
                read,
                seed=seed,
                friction=friction,
                gravity=gravity,
                optimizer=optimizer,
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
@axis_options
@seed_option
@force_option
@output_options
def diagnose(
    logs: Sequence[Path],
    params: Path,
    folder: Path,
    friction: str,
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
    read = given.read(logs, output, known.axis)
    with result_folder(folder, force):
        with Progress(output) as progress:
            result = diagnose_from(read, known, friction=friction, seed=seed, tell=progress.say)
        finish(result, folder, seed, output)


def finish(result: Identification, folder: Path, seed: int, output: Output) -> None:
    """Write the folder and print the verdict."""
    from idtool.report import write_report
    from idtool.report.result_folder import NEXT_RECIPE, write_results

    for sentence in (one for log in result.recording.wiring for one in log):
        output.warn(sentence)  # before any number
    write_results(result, folder, command=command_line(), seed=seed)
    with Progress(output, "drawing the report"):
        page = write_report(folder)

    def show(console: Console) -> None:
        from .tables import print_parameters

        print_parameters(console, result.parameters, ("gravity", "static", "dynamic", "effects"))
        print_verdict(console, result.diagnosis)
        if result.diagnosis["next_experiment"]:
            click.echo(f"  ffc-id run --recipe {folder / NEXT_RECIPE} -o next.csv makes it")
        click.echo(f"report: {page}")

    output.result(result.diagnosis, show)


def command_line() -> str:
    """The command as it was typed, for the report."""
    import shlex

    return shlex.join(["ffc-id", *sys.argv[1:]])


_VERDICTS = {
    "adequate": "the base model is adequate: no effect is missing",
    "effect_found": "effect found, and nothing structured is left",
    "ambiguous": "ambiguous: two explanations fit these data equally well",
    "unexplained": "something is left that no effect of the library accounts for",
}


def print_verdict(console: Console, diagnosis: dict[str, Any]) -> None:
    """Verdict, effects, error before and after, notes."""
    unit = "N" if diagnosis["error"]["metric"].endswith("_n") else "N m"
    console.print(f"\n[bold]verdict: {diagnosis['verdict']}[/bold] ({_VERDICTS[diagnosis['verdict']]})")
    for effect in diagnosis["effects"]:
        also = f" (or {', '.join(effect['alternatives'])})" if effect["alternatives"] else ""
        click.echo(f"  effect: {effect['name']}{also}")
    held_out = diagnosis["error"]["held_out"]
    click.echo(
        f"  error on held-out trials: {held_out['before']:.4g} {unit} before, "
        f"{held_out['after']:.4g} {unit} after; sensor noise {diagnosis['error']['noise_floor']:.2g} {unit}"
    )
    if diagnosis["unexplained"]:
        click.echo(f"  unexplained: {diagnosis['unexplained']['note']}")
    if diagnosis["next_experiment"]:
        click.echo(f"  next experiment: {diagnosis['next_experiment']['why']}")
    for note in diagnosis["notes"]:
        click.echo(f"  note: {note}")
