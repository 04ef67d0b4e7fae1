"""`ffc-id tune`: gains of the light mode for a wanted feel."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .common import Output, defaulted, given_words, output_options, params_option
from .guiding import period_option
from .numbers import POSITIVE, NumberRange
from .onward import ANY_RIG
from .screen import Screen

if TYPE_CHECKING:
    from idtool.control.admittance.tuning import Tuning
    from idtool.parameters import Parameters


@click.command()
@params_option("Parameter file of the axis.")
@click.option(
    "--hand-force",
    required=True,
    metavar="N",
    type=NumberRange(1e-3, 1e3),
    help="Force of the hand at the moving part.",
)
@defaulted(
    "--speed",
    default=19.2,
    metavar="MM_S",
    type=NumberRange(1e-3, 1e4),
    help="Speed that it shall give there.",
)
@click.option(
    "--lever",
    metavar="M",
    type=NumberRange(0.0, 10.0, min_open=True),
    help="How far from the shaft the hand holds it; an arm needs it, a slide's file says it.",
)
@period_option
@defaulted(
    "--servo-bandwidth",
    default=20.0,
    metavar="HZ",
    type=POSITIVE,
    help="Of the drive's velocity loop, for the margins.",
)
@click.option("--write", is_flag=True, help="Write the gains into the parameter file without asking.")
@output_options
def tune(
    output: Output,
    params: Path,
    hand_force: float,
    speed: float,
    lever: float | None,
    period: float | None,
    servo_bandwidth: float,
    write: bool,
) -> int:
    """Find the gains for a wanted feel, show them, and write them into the parameter file if that is wanted.

    The hand shall move the part at so many mm/s with so many N in the light mode, after a tare. Gain
    margins are stated for soft and stiff hands and readings up to 20 ms late; what cannot be stable, or
    what the file is not certain enough for, is refused with the least force that can be had.

    \b
    ffc-id tune -p params.toml --hand-force 2 --speed 19.2
    ffc-id tune -p params.toml --hand-force 2 --write
    """
    from idtool.control.admittance.tuning import tune as find
    from idtool.control.admittance.tuning import tuned
    from idtool.control.force_free import DEFAULT_PERIOD_S, gains
    from idtool.errors import InputError, UsageError
    from idtool.guiding.hand import travel_per_position
    from idtool.parameters import Parameters

    parameters = Parameters.read(params)
    ratio = lever or travel_per_position(parameters)
    if ratio is None:
        raise UsageError(
            "the gravity model does not say how far the moving part goes per radian: add --lever M"
        )
    step = period or gains(parameters, DEFAULT_PERIOD_S).period
    try:
        tuning = find(
            parameters,
            force=hand_force,
            speed=1e-3 * speed,
            ratio=ratio,
            period=step,
            servo_bandwidth=servo_bandwidth,
        )
    except InputError as error:
        raise InputError(str(error).removesuffix("."), file=params) from error
    if not output.json:
        _show(Screen(), tuning, parameters)
        write = write or (
            sys.stdin.isatty() and click.confirm(f"write them into {params}?", default=True, err=True)
        )
    if write:
        tuned(parameters, tuning).write_over(params, parameters)
    output.result(
        tuning.to_document() | {"file": str(params), "written": write},
        lambda _: click.echo(f"{'written' if write else 'not written'}: {params}"),
    )
    if write:
        output.next("teach", "-p", params, "--rig", parameters.rig or ANY_RIG, "--tare")
    else:
        output.next("tune", *given_words(), "--write")
    return 0


def _show(screen: Screen, tuning: Tuning, parameters: Parameters) -> None:
    from idtool.model.units import unit_text

    from .tables import print_table

    kind = parameters.axis.kind
    unit = f"{unit_text('velocity', kind)} per {unit_text('torque', kind)}"
    ratio, controller = tuning.ratio, tuning.controller
    screen.print(
        f"K_c {controller.loop_gain:.4g} {unit}, K_r {controller.command_gain:g} s, mode light, period"
        f" {1e3 * controller.period:g} ms"
    )
    screen.print(
        f"{tuning.torque / ratio:.2f} N at {1e3 * tuning.speed * ratio:.1f} mm/s, of which"
        f" {tuning.uncertainty / ratio:.2f} N because the model is not certain (after a tare);"
        f" it starts at {tuning.break_away / ratio:.2f} N at most."
    )
    rows = []
    for delay in sorted({m.delay for m in tuning.margins}):
        cells = []
        for hand in ("soft", "stiff"):
            least = min(
                (m for m in tuning.margins if (m.hand, m.delay) == (hand, delay)), key=lambda m: m.gain
            )
            cells.append(f"{least.gain:.2f} at {least.frequency:.1f} Hz")
        rows.append((f"{1e3 * delay:.0f} ms", *cells))
    for note in tuning.notes:
        screen.print(f"note: {note}")
    title = "gain margin, least over damping off by 15 %"
    print_table(screen, ("readings late by", ">soft hand", ">stiff hand"), rows, title=title)
