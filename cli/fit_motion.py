"""`ffc-id fit-motion`: fit the position that the effort makes, not the torque."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .axis import Given, axis_options
from .common import PATH, Output, logs_argument, output_options, params_option

if TYPE_CHECKING:
    from .screen import Screen


@click.command("fit-motion")
@logs_argument
@params_option("Parameter file to write; one that is there is started from, unless --start names another.")
@click.option(
    "--start", type=PATH, default=None, help="Parameter file to start from, of identify; it stays as it is."
)
@axis_options
@output_options
def fit_motion(logs: Sequence[Path], params: Path, start: Path | None, given: Given, output: Output) -> None:
    """Fit a parameter file to the motion: the position that the logged effort makes, over windows of 1 s.

    For servos that report duty in place of current, and wherever a model is judged by its position. Finds
    beside friction, gravity and inertia what bends the line from duty to torque, the friction that gears take
    of a load, and, where the logs hold the goal, the servo's own position loop ([drive]). Starts from a
    parameter file, whose effects are kept, or from a regression where there is none.

    \b
    ffc-id fit-motion *.csv -p motion.toml
    ffc-id fit-motion *.csv -p motion.toml --start result/params.toml
    ffc-id simulate other.csv -p motion.toml --from goal -o simulated.csv
    """
    from idtool.model.units import is_linear
    from idtool.parameters import Parameters
    from idtool.verbs.fit_motion import fit_motion as run

    from .progress import Progress
    from .tables import print_parameters

    there = Parameters.read(params) if params.exists() else None
    known = there if start is None else Parameters.read(start)
    read = given.read(logs, output, known.axis if known is not None else None)
    with Progress(output, "fitting the motion") as bar:
        result = run(read, known, progress=lambda share: bar.at(share, 1.0))
    result.parameters.write_over(params, there)
    unit = "mm" if is_linear(result.parameters.axis.units) else "mrad"

    def show(screen: Screen) -> None:
        print_parameters(screen, result.parameters, ("gravity", "static", "dynamic", "effects", "drive"))
        click.echo(
            f"rms over windows of 1 s: {1e3 * result.before:.4g} {unit} before, "
            f"{1e3 * result.after:.4g} after {result.evaluations} simulations"
        )
        for note in result.notes:
            click.echo(f"note: {note}")
        click.echo(f"written: {params}")

    document = {
        "params": str(params),
        f"rms_1s_windows_{unit}": {"before": 1e3 * result.before, "after": 1e3 * result.after},
        "evaluations": result.evaluations,
        "fit": result.outcome.value,
        "notes": list(result.notes),
        "parameters": result.parameters.to_document(),
    }
    output.result(document, show)
    output.next("simulate", *logs, "-p", params, "-o", "simulated.csv")
