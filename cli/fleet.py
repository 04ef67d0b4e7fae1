"""`ffc-id fleet`: many sessions at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .axis import Given, axis_options
from .common import PATH, Output, given_words, output_options, seed_option
from .diagnose import gravity_option, tolerance_option, without_option
from .fit import friction_option, optimizer_option
from .progress import Progress

if TYPE_CHECKING:
    from idtool.fleet import Fleet

    from .screen import Screen


@click.command()
@click.argument("sessions", type=PATH, metavar="SESSIONS/")
@click.option("-o", "--output", "out", required=True, type=PATH, help="Folder of the results.")
@click.option(
    "-j", "--workers", type=click.IntRange(1), help="Processes on this machine; all processors if not given."
)
@click.option("--scheduler", metavar="ADDRESS", help="Dask scheduler whose workers do it (tcp://HOST:8786).")
@click.option("--again", is_flag=True, help="Do sessions again that are done and unchanged.")
@friction_option
@gravity_option
@optimizer_option
@without_option
@tolerance_option
@axis_options
@seed_option
@output_options
def fleet(
    *,
    sessions: Path,
    out: Path,
    workers: int | None,
    scheduler: str | None,
    again: bool,
    given: Given,
    output: Output,
    **how: Any,
) -> None:
    """Identify every session of a folder in parallel; compare the units.

    Each folder in SESSIONS/ with logs in it is one session. Results go to OUT/sessions/NAME, then
    OUT/summary.csv, OUT/summary.json and OUT/fleet.html sum them up: spread between units, units that
    stand out, drift over dates. A session that fails stops no other; the command then ends with code 3.
    Run again, it does only what is missing, failed or changed.

    \b
    ffc-id fleet sessions/ -o fleet
    ffc-id fleet sessions/ -o fleet --scheduler tcp://10.0.0.5:8786
    """
    if scheduler and workers:
        raise click.UsageError("--workers is for this machine, --scheduler for a cluster; give one of them.")
    # ahead of the imports of the fleet, which take seconds that nobody should add to a silence
    from idtool.fleet.scheduler import greet

    greeted = greet(scheduler) if scheduler else None
    from idtool.fleet import Options, run_fleet
    from idtool.fleet.summary import document

    options = Options(torque_constant=given.constant, axis=given.axis(), **how)
    with Progress(output, "identifying") as progress:
        result = run_fleet(
            sessions,
            out,
            options,
            workers=workers,
            scheduler=greeted,
            again=again,
            tell=output.say,
            progress=progress.at,
        )
    output.result(document(result), lambda screen: _show(screen, result, out))
    if result.failed:
        output.next("fleet", *given_words("--again"))
        click.get_current_context().exit(3)
    files = [out / "sessions" / row.session / "params.toml" for row in result.sessions]
    if len(files) > 1:
        output.next("compare", *files[:2])
    else:
        output.next("tune", "-p", files[0], "--hand-force", "2")


def _show(screen: Screen, result: Fleet, out: Path) -> None:
    from idtool.fleet.page import label
    from idtool.presentation.text import number, percent

    from .tables import print_table

    rows = []
    for line in result.parameters:
        name, unit = label(line.key)
        spread = percent(line.spread / abs(line.median), 1) if line.spread and line.median else "–"
        remarks = [*line.outlying_units, *line.outlying_sessions]
        if line.drifts:
            remarks.append(f"drifts by {number(line.drift, 2)} a year")
        odd = f"stands out: {', '.join(remarks)}" if remarks else ""
        rows.append((name, number(line.median), spread, unit, odd))
    print_table(screen, ("parameter", ">median", ">spread", "unit", ""), rows)
    for row in result.failed:
        click.echo(f"failed: {row.error}")
    done = len(result.sessions) - len(result.failed)
    click.echo(f"{done} of {len(result.sessions)} sessions; page: {out / 'fleet.html'}")
