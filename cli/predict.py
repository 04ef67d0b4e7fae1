"""`ffc-id predict`: predict the torque of logs with a parameter file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from .axis import Given, axis_options
from .common import PATH, Output, force_option, logs_argument, output_options, params_option


@click.command()
@logs_argument
@params_option()
@click.option("-o", "--output", "out", required=True, type=PATH, help="CSV to write.")
@click.option(
    "--correction",
    type=PATH,
    help="Add the smooth correction of a diagnosis that left something unexplained (DIR/correction.toml).",
)
@axis_options
@force_option
@output_options
def predict(
    logs: Sequence[Path],
    params: Path,
    out: Path,
    correction: Path | None,
    given: Given,
    force: bool,
    output: Output,
) -> None:
    """Predict the torque of logs: per row trial, time, measured and predicted torque.

    Prints the error per experiment over all rows. One number per trial and rest, the start deflection of
    the bristle, is taken from the measured torque. With several logs the rows follow one another and the
    trial numbers run on.

    \b
    ffc-id predict validation.csv -p result/params.toml -o predicted.csv
    """
    from idtool.io.atomic import refuse_existing, write_table
    from idtool.parameters import Parameters
    from idtool.parameters.correction import Correction
    from idtool.verbs.predict import predict as run

    parameters = Parameters.read(params)
    read = given.read(logs, output, parameters.axis)
    refuse_existing(out, force, params, correction, *logs)
    result = run(read, parameters, None if correction is None else Correction.read(correction))
    output.warn(*result.contradictions)
    write_table(out, result.frame)
    notes = [*result.contradictions, *result.notes]
    document = {"file": str(out), "errors": result.errors, "unit": result.unit, "notes": notes}
    output.result(document, (*result.lines, f"written: {out}"))
    if result.poor:
        output.next("check", *logs, odd=result.odd)
    else:
        output.next("tune", "-p", params, "--hand-force", "2", odd=result.odd)
