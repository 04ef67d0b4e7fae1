"""`ffc-id identify` and `ffc-id diagnose`."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .axis import Given, axis_options
from .common import (
    PATH,
    Output,
    defaulted,
    force_option,
    handed,
    logs_argument,
    output_options,
    params_option,
    seed_option,
)
from .fit import friction_option, optimizer_option
from .numbers import NumberRange
from .progress import Identifying, Progress
from .words import Choice, complete_effect

if TYPE_CHECKING:
    from idtool.parameters import Parameters
    from idtool.verbs.identification import Identification

    from .screen import Screen

gravity_option = defaulted(
    "--gravity", type=Choice(("auto", "slide", "arm", "none")), default="auto", help="Gravity model."
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
    type=PATH,
    help="Predict this log, which no fit sees, with the result; may be repeated.",
)
tolerance_option = click.option(
    "--tolerance",
    metavar="PERCENT",
    type=NumberRange(0.0, 100.0, max_open=True),
    help="An error of so many per cent of the torque is good enough: no further effect is looked for then.",
)


@dataclass(frozen=True)
class _Session:
    """What both are asked."""

    logs: Sequence[Path]
    folder: Path
    friction: str
    without: tuple[str, ...]
    tolerance: float | None
    validate: tuple[Path, ...]
    given: Given
    seed: int
    force: bool
    output: Output

    def run(self, find: Callable[..., Identification], known: Parameters | None = None, **more: Any) -> None:
        """Read the logs, find what is in them and write the folder; `known`: parameters to start from."""
        from idtool.report.result_folder import result_folder

        axis = None if known is None else known.axis
        read, unseen = (self.given.read(some, self.output, axis) for some in (self.logs, self.validate))
        with result_folder(self.folder, self.force):
            with Identifying(self.output) as progress:
                result = find(
                    read,
                    *([] if known is None else [known]),
                    friction=self.friction,
                    seed=self.seed,
                    without=self.without,
                    tolerance=self.tolerance,
                    validate=unseen,
                    tell=progress.say,
                    **more,
                )
            finish(result, self.folder, self.seed, self.output)


_shared = handed(
    "session",
    _Session,
    logs_argument,
    click.option("-o", "--output", "folder", required=True, type=PATH, help="Result folder."),
    friction_option,
    without_option,
    tolerance_option,
    validate_option,
    axis_options,
    seed_option,
    force_option,
    output_options,
)


@click.command()
@_shared
@gravity_option
@optimizer_option
@click.option(
    "--known-load",
    is_flag=True,
    help="Find the torque constant too, from the load: payload_kg, or [axis] mass_kg, on [axis] lever_m.",
)
@defaulted(
    "--weigh",
    type=Choice(("torque", "position")),
    default="torque",
    help="What the parameter file is fitted to at the end; position as in ffc-id fit-motion.",
)
def identify(session: _Session, gravity: str, optimizer: str, known_load: bool, weigh: str) -> None:
    """All fits and the diagnosis in one go: params.toml, diagnosis.json, report.html, figures.

    What each log is, its header says. `--friction coulomb` fits the textbook model (inertia, offset,
    Coulomb, viscous) to compare with published ones, and looks for nothing else.

    \b
    ffc-id identify gravity.csv sweep.csv sine.csv -o result
    ffc-id identify *.csv --validate other-day.csv --without backlash -o result
    """
    from idtool.verbs.identify import identify as run

    session.run(run, gravity=gravity, optimizer=optimizer, known_load=known_load, weigh=weigh)


@click.command()
@_shared
@params_option("Parameter file to start from.")
def diagnose(session: _Session, params: Path) -> None:
    """Find the effect that the model of a parameter file lacks; error before and after.

    The base model of the file is refitted on the training trials; effects that the file has already are
    looked for again like all others. The extended model is written to DIR/params.toml.

    \b
    ffc-id diagnose gravity.csv sweep.csv sine.csv -p params.toml -o result
    """
    from idtool.parameters import Parameters
    from idtool.verbs.identify import diagnose_from

    session.run(diagnose_from, Parameters.read(params))


def finish(result: Identification, folder: Path, seed: int, output: Output) -> None:
    """Write the folder and print the verdict."""
    from idtool.report import write_report
    from idtool.report.next_step import next_step_of
    from idtool.report.result_folder import write_results

    output.warn(*result.recording.contradictions)  # before any number
    write_results(result, folder, command=shlex.join(["ffc-id", *sys.argv[1:]]), seed=seed)
    with Progress(output, "drawing the report") as bar:
        page = write_report(folder, progress=bar.at)

    def show(screen: Screen) -> None:
        from .tables import print_parameters

        print_parameters(screen, result.parameters, ("gravity", "static", "dynamic", "effects"))
        print_verdict(screen, result.diagnosis)
        click.echo(f"report: {page}")

    output.result(result.diagnosis, show)
    output.next(*next_step_of(folder, result.recording.sources).words)


def print_verdict(screen: Screen, diagnosis: dict[str, Any]) -> None:
    """Verdict, effects, error before and after, notes."""
    from idtool.diagnosis.summary import summary_lines

    first, *rest = summary_lines(diagnosis)
    screen.print(f"\n{first}", bold=True)
    for line in rest:
        click.echo(f"  {line}")
