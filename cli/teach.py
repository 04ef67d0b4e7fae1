"""`ffc-id teach`: run the force-free controller; on a simulated rig a simulated hand pushes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .common import PATH, Output, defaulted, given_words, params_option, picture_name
from .guiding import (
    Guiding,
    check_axis,
    guiding_options,
    idle_option,
    max_speed_option,
    session_limits,
    setup_of,
)
from .live import live_views
from .moving import result_on
from .numbers import POSITIVE, NumberRange
from .progress import Progress

if TYPE_CHECKING:
    from idtool.control import ForceFreeController, Limits
    from idtool.guiding import Hand, TeachFigures
    from idtool.parameters import Parameters
    from idtool.parameters.correction import Correction
    from idtool.rig.base import Rig


@click.command()
@params_option("Parameter file of the axis.")
@guiding_options
@click.option(
    "--correction", type=PATH, help="Compensate this smooth correction too (correction.toml of `identify`)."
)
@click.option("--figure", type=PATH, callback=picture_name, help="Draw the run into this PNG or SVG.")
@click.option(
    "--told-payload",
    metavar="KG",
    type=NumberRange(0.0),
    help="Simulated: what the controller is told instead of the payload that hangs there.",
)
@click.option(
    "--button",
    "button_spec",
    metavar="SPEC",
    help="Teach button: key (space bar held), key:toggle, gpio:PIN, serial:DEVICE, none; "
    "sim presses it after 0.5 s [default: key on a real axis; simulated: none, sim with --told-payload].",
)
@max_speed_option
@idle_option
@click.option("--no-hand", is_flag=True, help="Simulated: nobody touches the axis (with --duration).")
@defaulted(
    "--hand-speed",
    default=19.2,
    metavar="MM_S",
    type=POSITIVE,
    help="How fast the simulated hand wants to move.",
)
@click.option("--hand-force", metavar="N", type=POSITIVE, help="Push with this constant force instead.")
@click.option(
    "--duration",
    metavar="S",
    type=POSITIVE,
    help="Stop after so long (default: the simulated hand's sequence; on a real rig, Ctrl-C).",
)
@click.option(
    "--tare", is_flag=True, help="Learn load and friction first: the axis moves 9 mm to and fro, hands off."
)
def teach(
    told: Guiding,
    params: Path,
    correction: Path | None,
    figure: Path | None,
    told_payload: float | None,
    button_spec: str | None,
    max_speed: float,
    idle: float,
    no_hand: bool,
    hand_speed: float,
    hand_force: float | None,
    duration: float | None,
    tare: bool,
) -> int:
    """Run the force-free controller: a hand moves the axis.

    On a simulated rig a simulated hand pushes both ways and lets go while moving, then again with a
    pause before it lets go. Force and speed are means over the second half of each push, at the moving
    part where the gravity model says how it moves; the stop is timed from the instant the hand lets go
    until it stays within one encoder count. On a real rig push by hand and end with Ctrl-C. The first
    0.2 s must be without a hand.

    The axis follows only while the teach button is down; up, it is braked and held, and a load that is hung
    on or taken off is taken in. On a real axis the button is the space bar unless another one is named.

    The paper's axis with the paper's gains yields 19.20 mm/s to 5.56 N and stops within 48 ms.

    \b
    ffc-id teach -p result/params.toml --rig sim:bench --tare
    """
    from idtool.errors import UsageError
    from idtool.guiding.button import open_button
    from idtool.guiding.figure import draw
    from idtool.guiding.hand import travel_per_position
    from idtool.guiding.session import limits_of
    from idtool.guiding.session import teach as run
    from idtool.io.atomic import refuse_existing
    from idtool.parameters import Parameters
    from idtool.parameters.correction import Correction
    from idtool.presentation.style import save
    from idtool.rig import open_rig

    from .taught import Taught

    output, log = told.output, told.log
    parameters = Parameters.read(params)
    smooth = Correction.read(correction) if correction is not None else None
    for path in (log, figure):
        if path is not None:
            refuse_existing(path, told.force, params, correction)
    tilted, rig = told.tilted, told.told_rig()
    with open_rig(rig, seed=told.seed) as axis:
        check_axis(parameters, params, axis, output)
        usual = "key" if not axis.simulated else "none" if told_payload is None else "sim"
        spec = button_spec or usual
        own = limits_of(axis)
        limits = session_limits(parameters, own, max_speed, idle if spec != "none" else math.inf)
        controller = _controller(parameters, params, axis, limits, smooth)
        if told_payload is not None and not axis.simulated:
            raise UsageError("--told-payload is for simulated axes; a real one is told its --payload.")
        payload = told.told_payload(parameters, axis)
        hand = _hand(parameters, hand_speed, hand_force) if axis.simulated and not no_hand else None
        if axis.simulated and hand is None and duration is None:
            raise UsageError("--no-hand: nothing ends the run; say how long with --duration.")
        if hand is None and figure is None and log is None:
            output.say("nothing will be kept: pass -o LOG.csv to record the run")
        if tare and controller.mode != "light":
            raise UsageError("only the light mode has a tare: write it into the file with `ffc-id tune`")
        simulated = axis.simulated
        with open_button(spec):  # one that cannot be had is told before anything moves
            pass
        start = told.inside(axis)
        with open_button(spec) as button, live_views(told, axis) as watch:
            if button is not None:
                output.say(f"{button.hint}; up, the axis is held")
            with _shown(axis, output) as progress:
                result = run(
                    parameters,
                    controller,
                    axis,
                    setup_of(payload, tilted, axis, start),
                    hand=hand,
                    duration_s=duration,
                    log=log,
                    force=told.force,
                    progress=progress,
                    tare=tare,
                    button=button,
                    told_payload_kg=told_payload,
                    watch=watch,
                )
    if figure is not None:
        ratio = travel_per_position(parameters)
        save(draw(result.record, kind=parameters.axis.kind, travel_ratio=ratio), figure)
    bare = None
    if result.figures is not None and hand is not None and duration is None:
        bare = _without_effects(
            parameters, params, rig, hand, payload, tilted, tare, told.seed, smooth is not None
        )
    taught = Taught(parameters, controller, result, log, figure, bare, smooth is not None)
    result_on(rig, simulated, output, taught.document(), taught.show)
    if log is not None and not result.interrupted:
        output.next("play", log, "--rig", rig, "-p", params, "--speed", "0.5")
    elif not result.interrupted:
        output.next("teach", *given_words(), "-o", "taught.csv")
    return 130 if result.interrupted and simulated else 0


def _controller(
    parameters: Parameters, file: Path, axis: Rig, limits: Limits, correction: Correction | None = None
) -> ForceFreeController:
    from idtool.control import ForceFreeController
    from idtool.control.force_free import DEFAULT_PERIOD_S, gains
    from idtool.control.online import check_complete

    check_complete(parameters, file)
    period = max(axis.period_s, gains(parameters, DEFAULT_PERIOD_S).period)
    return ForceFreeController(parameters, period, limits=limits, correction=correction)


def _hand(parameters: Parameters, speed: float, force: float | None) -> Hand:
    from idtool.errors import InputError
    from idtool.guiding import ConstantForceHand, ImpedanceHand
    from idtool.guiding.hand import travel_per_position

    if force is None:
        return ImpedanceHand.at_slide(parameters, speed_mm_s=speed)
    ratio = travel_per_position(parameters)
    if ratio is None:
        raise InputError(
            "the gravity model does not say how far the moving part goes per radian",
            place="--hand-force",
            remedy="leave it out: the hand is then told in rad and N m",
        )
    return ConstantForceHand(force * ratio)


@contextmanager
def _shown(axis: Rig, output: Output) -> Iterator[Callable[[float], None] | None]:
    """What shows how far a simulated hand is; a real one needs a word of how it ends."""
    if not axis.simulated:
        output.say("push the axis by hand; Ctrl-C ends the run")
        yield None
        return
    with Progress(output, "hand guiding") as bar:
        yield lambda share: bar.at(share, 1.0)


def _without_effects(
    parameters: Parameters,
    file: Path,
    rig: str,
    hand: Hand,
    payload: float,
    tilt: tuple[float, float],
    tare: bool,
    seed: int,
    corrected: bool,
) -> TeachFigures | None:
    """The same hand on the same simulated axis, effects and correction left out; None if there are none."""
    from idtool.errors import RigFault
    from idtool.guiding.session import limits_of
    from idtool.guiding.session import teach as run
    from idtool.rig import open_rig

    kept = tuple(entry for entry in parameters.effects if entry.name == "inertia")
    if kept == parameters.effects and not corrected:
        return None
    bare = replace(parameters, effects=kept)
    with open_rig(rig, seed=seed) as axis:
        setup = setup_of(payload, tilt, axis)
        controller = _controller(bare, file, axis, limits_of(axis))
        try:
            return run(bare, controller, axis, setup, hand=hand, tare=tare).figures
        except RigFault:  # without them it may not work at all; the run that counts is over
            return None
