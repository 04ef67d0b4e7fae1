"""`ffc-id export c`: the force-free controller for a microcontroller."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from .angles import radians, range_options
from .common import PATH, Output, defaulted, force_option, output_options, params_option
from .guiding import idle_option, max_speed_option, period_option, session_limits
from .numbers import NumberRange
from .onward import ANY_RIG
from .words import complete_effect


@click.command()
@params_option()
@click.option("-o", "--output", "folder", required=True, type=PATH, help="Folder, made if missing.")
@defaulted("--name", default="ffc", metavar="PREFIX", help="Begins symbols and files.")
@click.option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    shell_complete=complete_effect,
    help="Leave this effect out; may be repeated.",
)
@period_option
@range_options("Positions that may be commanded, rad or m; must be told, or --any-position.")
@click.option("--any-position", is_flag=True, help="Let it command any position: an axis without ends.")
@click.option(
    "--path", type=PATH, help="A path to play from flash: the log of `teach -o`, or a file of waypoints."
)
@defaulted(
    "--path-speed",
    default=1.0,
    type=NumberRange(0.0, 10.0, min_open=True),
    help="Speed of the path, relative to how it was taught.",
)
@max_speed_option
@idle_option
@force_option
@output_options
def export_c(
    *,
    params: Path,
    folder: Path,
    period: float | None,
    reach: tuple[float, float] | None,
    reach_deg: tuple[float, float] | None,
    any_position: bool,
    path: Path | None,
    max_speed: float,
    idle: float,
    output: Output,
    **how: Any,
) -> None:
    """The force-free controller as C99: PREFIX.h, PREFIX.c and an Arduino sketch.

    Single precision, no allocation, nothing but libm. It carries gravity, friction and effects of the
    parameter file and does, sample by sample, what `ffc-id teach` does. How to put it on a board:
    docs/board.md.

    \b
    ffc-id export c -p result/params.toml -o guide --range -1.5 1.5
    ffc-id export c -p result/params.toml -o guide --range-deg -85 85
    """
    from idtool.control import Limits
    from idtool.errors import UsageError
    from idtool.export.c_controller import export_c as run
    from idtool.guiding.path import read_path
    from idtool.parameters import Parameters

    reach = radians("range", reach, reach_deg)
    if (reach is None) is not any_position:
        raise UsageError(
            "say what the board may command: --range LOW HIGH (rad or m), --range-deg LOW HIGH, or "
            "--any-position for an axis without ends."
        )
    parameters = Parameters.read(params)
    if reach_deg is not None and parameters.axis.kind == "linear":
        raise UsageError("--range-deg is for a rotary axis, and this one is linear; pass --range in m.")
    low, high = reach or (-math.inf, math.inf)
    limits = session_limits(parameters, Limits(low, high), max_speed, idle)
    result = run(
        parameters,
        folder,
        period_s=period,
        limits=limits,
        path=read_path(path)[0] if path is not None else None,
        source=params.name,
        **how,
    )
    for note in result.notes:
        output.say(f"note: {note}.")
    files = [str(file) for file in result.files]
    lines = [f"effects: {', '.join(result.effects) or 'none'}", *(f"written: {file}" for file in files)]
    output.result({"files": files, "effects": result.effects, "notes": result.notes}, lines)
    output.next("teach", "-p", params, "--rig", parameters.rig or ANY_RIG, "--tare")
