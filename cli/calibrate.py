"""`ffc-id calibrate`: the torque constant from a load that is known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from .axis import Given, axis_options
from .common import Output, logs_argument, output_options, params_option
from .numbers import POSITIVE, NumberRange
from .progress import Progress

#: As `tune` takes one: a longer one is in millimetres.
_LEVER = NumberRange(0.0, 10.0, min_open=True)


@click.command()
@logs_argument
@click.option("--mass", type=POSITIVE, metavar="KG", help="Mass of the load; else payload_kg tells it.")
@click.option("--lever", type=_LEVER, metavar="M", help="From the axis to the mass; not on a linear axis.")
@params_option("Parameter file to put into N m by it, in place.", required=False)
@axis_options
@output_options
def calibrate(
    logs: Sequence[Path],
    mass: float | None,
    lever: float | None,
    params: Path | None,
    given: Given,
    output: Output,
) -> None:
    """Find the torque constant (or the torque per volt) from a load that is known.

    The load must move: swing a mass on a lever, slowly, over a good part of a turn and both ways, or move
    payloads up and down (payload_kg). With logs with and without the load the axis' own weight need not be
    known. A constant that the logs tell is not used.

    \b
    ffc-id calibrate swing.csv --mass 0.49 --lever 0.1
    ffc-id calibrate with.csv without.csv --lever 0.1 -p result/params.toml
    """
    from idtool.errors import UsageError
    from idtool.fit.known_load import calibrate as run
    from idtool.parameters import Parameters
    from idtool.parameters.scaling import in_torque

    read = given.read(logs, output)
    if lever is None and read[0].axis.kind == "rotary":
        raise UsageError("--lever is missing; say how far from the axis the mass is, in m.")
    if lever is not None and mass is None and not any(log.column("payload") is not None for log in read):
        raise UsageError("--lever without --mass; say how heavy the load is, or log payload_kg.")
    known = Parameters.read(params) if params is not None else None
    with Progress(output, "finding the constant"):
        result = run(read, lever=1.0 if lever is None else lever, mass=mass)
    if known is not None and params is not None:
        in_torque(known, result.constant, result.unit).write_over(params, known)
    low, high = result.constant.ci95 or (result.constant.value, result.constant.value)
    force = "N" if result.kind == "linear" else "N m"
    per = "A" if result.unit == "current" else "V"

    lines = [
        f"{result.key}: {result.constant.value:.5g} {force}/{per}, 95 % {low:.5g} to {high:.5g}",
        f"the load, {result.load:.4g} {force} at its most, takes {result.effort:.4g} {per}",
        *(f"note: {note}" for note in result.notes),
        *([] if params is None else [f"written: {params}, now in {force}"]),
    ]
    document = {
        "key": result.key,
        **result.constant.to_table(),
        "load": result.load,
        "effort": result.effort,
        "unit": f"{force}/{per}",
        "notes": list(result.notes),
        "file": None if params is None else str(params),
    }
    output.result(document, lines)
    if params is not None:
        output.next("tune", "-p", params, "--hand-force", "2")
    elif result.unit == "current" and all(log.axis.torque_constant is None for log in read):
        output.next("identify", *logs, "--torque-constant", f"{result.constant.value:.5g}", "-o", "result")
    elif not (written := Path("result", "params.toml")).is_file():
        output.next("identify", *(logs if mass else logs[:1]), "-o", "result")  # of one payload
    else:  # a parameter file of these logs is put into N m by the constant
        load = [*(["--mass", f"{mass:g}"] if mass else []), *(["--lever", f"{lever:g}"] if lever else [])]
        output.next("calibrate", *logs, *load, "-p", written)
