"""`ffc-id simulate`: simulate the position of logs with a parameter file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import click

from .axis import Given, axis_options
from .common import PATH, Output, defaulted, force_option, logs_argument, output_options, params_option
from .progress import Progress
from .words import Choice


@click.command()
@logs_argument
@params_option()
@defaulted(
    "--from",
    "source",
    type=Choice(["effort", "goal"]),
    default="effort",
    help="What drives it: the logged effort, or the logged goal through the servo's position loop.",
)
@click.option("-o", "--output", "out", required=True, type=PATH, help="CSV to write.")
@axis_options
@force_option
@output_options
def simulate(
    logs: Sequence[Path],
    params: Path,
    source: Literal["effort", "goal"],
    out: Path,
    given: Given,
    force: bool,
    output: Output,
) -> None:
    """Simulate the position of logs: per row trial, time, measured and simulated position.

    Each trial starts from its measured state. Prints the mean absolute error of the position, its rms, and
    its rms over windows of one second that each start from the measured state (as MuJoCo's identification
    counts). --from goal closes the position loop of [drive] around the axis; where the file has none, the
    loop is identified from these logs.

    \b
    ffc-id simulate validation.csv -p result/params.toml --from goal -o simulated.csv
    """
    from idtool.io.atomic import refuse_existing, write_table
    from idtool.parameters import Parameters
    from idtool.verbs.simulate import simulate as run

    parameters = Parameters.read(params)
    read = given.read(logs, output, parameters.axis)
    refuse_existing(out, force, params, *logs)
    with Progress(output, "simulating") as bar:
        result = run(read, parameters, source, progress=lambda share: bar.at(share, 1.0))
    write_table(out, result.frame)
    document = {"file": str(out), "from": source, **result.to_document()}
    output.result(document, (*result.lines, f"written: {out}"))
    output.next("fit-motion", *logs, "-p", "motion.toml", "--start", params)
