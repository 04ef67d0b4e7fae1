"""`ffc-id teach`: run the force-free controller; on a simulated rig a simulated hand pushes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .common import (
    Output,
    force_option,
    given_words,
    output_options,
    picture_name,
    radians,
    rig_option,
    seed_option,
    tilt_deg_option,
    told_rig,
)
from .guiding import (
    check_axis,
    idle_option,
    inside,
    log_option,
    max_speed_option,
    move_inside_option,
    payload_option,
    session_limits,
    setup_of,
    tilt_option,
)
from .guiding import told_payload as ask_payload
from .live import live_option, live_page
from .numbers import NumberRange
from .progress import Progress

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from idtool.control import ForceFreeController, Limits
    from idtool.guiding import Hand, TeachFigures, TeachResult
    from idtool.parameters import Parameters
    from idtool.parameters.correction import Correction
    from idtool.rig.base import Rig, TrialSetup, Watch


@click.command()
@click.option(
    "-p", "--params", required=True, type=click.Path(path_type=Path), help="Parameter file of the axis."
)
@rig_option
@click.option(
    "--correction",
    type=click.Path(path_type=Path),
    help="Compensate this smooth correction too (correction.toml of `identify`).",
)
@log_option
@click.option(
    "--figure",
    type=click.Path(path_type=Path),
    callback=picture_name,
    help="Draw the run into this PNG or SVG.",
)
@payload_option
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
@move_inside_option
@tilt_option
@tilt_deg_option
@click.option(
    "--hand-speed",
    default=19.2,
    show_default=True,
    metavar="MM_S",
    type=NumberRange(0.0, min_open=True),
    help="How fast the simulated hand wants to move.",
)
@click.option(
    "--hand-force",
    metavar="N",
    type=NumberRange(0.0, min_open=True),
    help="Push with this constant force instead.",
)
@click.option(
    "--duration",
    metavar="S",
    type=NumberRange(0.0, min_open=True),
    help="Stop after so long (default: the simulated hand's sequence; on a real rig, Ctrl-C).",
)
@click.option(
    "--tare", is_flag=True, help="Learn load and friction first: the axis moves 9 mm to and fro, hands off."
)
@live_option
@seed_option
@force_option
@output_options
def teach(
    output: Output,
    live: bool,
    params: Path,
    rig: str | None,
    correction: Path | None,
    log: Path | None,
    figure: Path | None,
    payload: float | None,
    told_payload: float | None,
    button_spec: str | None,
    max_speed: float,
    idle: float,
    move_inside: bool,
    no_hand: bool,
    tilt: tuple[float, float] | None,
    tilt_deg: tuple[float, float] | None,
    hand_speed: float,
    hand_force: float | None,
    duration: float | None,
    tare: bool,
    seed: int,
    force: bool,
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
    from idtool.guiding.session import limits_of
    from idtool.io.atomic import refuse_existing
    from idtool.parameters import Parameters
    from idtool.parameters.correction import Correction
    from idtool.rig import open_rig

    parameters = Parameters.read(params)
    smooth = Correction.read(correction) if correction is not None else None
    for path in (log, figure):
        if path is not None:
            refuse_existing(path, force, params, correction)
    tilted = radians(tilt_deg, tilt) or (0.0, 0.0)
    rig = told_rig(rig, output)
    with open_rig(rig, seed=seed) as axis:
        check_axis(parameters, params, axis, output)
        usual = "key" if not axis.simulated else "none" if told_payload is None else "sim"
        spec = button_spec or usual
        own = limits_of(axis)
        limits = session_limits(parameters, own, max_speed, idle if spec != "none" else math.inf)
        controller = _controller(parameters, params, axis, limits, smooth)
        if told_payload is not None and not axis.simulated:
            raise UsageError("--told-payload is for simulated axes; a real one is told its --payload.")
        payload = ask_payload(payload, parameters, axis)
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
        start = inside(axis, output, move=move_inside)
        with open_button(spec) as button, live_page(live, axis, output) as watch:
            if button is not None:
                output.say(f"{button.hint}; up, the axis is held")
            result = _run(
                parameters,
                controller,
                axis,
                hand,
                setup_of(payload, tilted, axis, start),
                told_payload,
                button,
                duration,
                log,
                force,
                tare,
                watch,
                output,
            )
    if figure is not None:
        _draw(parameters, result, figure)
    bare = None
    if result.figures is not None and hand is not None and duration is None:
        bare = _without_effects(
            parameters, params, rig, hand, payload, tilted, tare, seed, smooth is not None
        )
    output.result(
        _document(controller, result, log, figure)
        | {"without_effects": bare.to_document() if bare else None},
        lambda screen: _show(screen, parameters, controller, result, log, figure, bare, smooth is not None),
    )
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


def _run(
    parameters: Parameters,
    controller: ForceFreeController,
    axis: Rig,
    hand: Hand | None,
    setup: TrialSetup,
    told_payload: float | None,
    button: Callable[[float], bool] | None,
    duration: float | None,
    log: Path | None,
    force: bool,
    tare: bool,
    watch: Watch | None,
    output: Output,
) -> TeachResult:
    from idtool.guiding.session import teach as run

    def go(progress: Callable[[float], None] | None) -> TeachResult:
        return run(
            parameters,
            controller,
            axis,
            setup,
            hand=hand,
            duration_s=duration,
            log=log,
            force=force,
            progress=progress,
            tare=tare,
            button=button,
            told_payload_kg=told_payload,
            watch=watch,
        )

    if not axis.simulated:
        output.say("push the axis by hand; Ctrl-C ends the run")
        return go(None)
    with Progress(output, "hand guiding") as bar:
        return go(lambda share: bar.at(share, 1.0))


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
    from dataclasses import replace

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


def _draw(parameters: Parameters, result: TeachResult, path: Path) -> None:
    from idtool.guiding.figure import draw
    from idtool.guiding.hand import travel_per_position
    from idtool.io.atomic import atomic_write

    picture = draw(result.record, kind=parameters.axis.kind, travel_ratio=travel_per_position(parameters))
    with atomic_write(path, "wb") as stream:
        picture.savefig(stream, dpi=130, format="png")


def _document(
    controller: ForceFreeController, result: TeachResult, log: Path | None, figure: Path | None
) -> dict[str, Any]:
    return {
        "schema": "ffc-id/teach/1",
        "gains": {
            "command_gain_s": controller.command_gain,
            "loop_gain": controller.loop_gain,
            "period_s": controller.period,
        },
        "seconds": float(result.record.time[-1] - result.record.time[0]),
        "figures": result.figures.to_document() if result.figures else None,
        "notes": list(result.notes),
        "interrupted": result.interrupted,
        "log": str(log) if log else None,
        "figure": str(figure) if figure else None,
    }


def _show(
    screen: Console,
    parameters: Parameters,
    controller: ForceFreeController,
    result: TeachResult,
    log: Path | None,
    figure: Path | None,
    bare: TeachFigures | None,
    corrected: bool,
) -> None:
    from idtool.model.units import torque_name, unit_text

    from .tables import print_table

    kind = parameters.axis.kind
    torque, speed = unit_text("torque", kind), unit_text("velocity", kind)
    if result.figures is not None:
        rows = [
            (
                f"{index} {'+' if push.direction > 0 else '−'}{'' if push.from_motion else ' held'}",
                f"{push.torque:.4f}",
                _maybe(push.force_n),
                f"{push.speed:.4f}",
                _maybe(push.speed_mm_s),
                f"{push.stop_ms:.0f}" if push.from_motion else "",
                f"{push.overshoot_counts:.1f}",
                f"{push.ripple_counts:.1f}",
                f"{1e3 * push.energy_to_hand:.1f}",
            )
            for index, push in enumerate(result.figures.pushes, start=1)
        ]
        headings = (
            "push", f">{torque_name(kind)} ({torque})", ">force (N)", f">speed ({speed})", ">mm/s",
            ">stop (ms)", ">overshoot", ">ripple", ">to hand (mJ)",
        )  # fmt: skip
        print_table(screen, headings, rows, title="Hand guiding")
        screen.print(_summary(result.figures, torque, speed))
        if bare is not None and bare.force_n is not None and result.figures.force_n is not None:
            what = "effects of the file and correction" if corrected else "the file's effects"
            screen.print(
                f"{what} are worth: {bare.force_n:.2f} ± {bare.uneven_n:.2f} N without them,"
                f" {result.figures.force_n:.2f} ± {result.figures.uneven_n:.2f} N with them (mean of the hand"
                " and how far it strays from it, rms)."
            )
    else:
        seconds = float(result.record.time[-1] - result.record.time[0])
        moved = float(result.record.position[-1] - result.record.position[0])
        screen.print(
            f"{seconds:.1f} s of hand guiding, from {result.record.position[0]:.4f} by {moved:+.4f}"
            f" {unit_text('position', kind)}; no simulated hand, so no figures of it."
        )
    unit = f"{speed} per {torque}"
    screen.print(
        f"gains: K_r {controller.command_gain:g} s, K_c {controller.loop_gain:g} {unit},"
        f" period {1e3 * controller.period:g} ms"
    )
    for note in result.notes:
        screen.print(f"note: {note}")
    for path in (log, figure):
        if path is not None:
            screen.print(f"written: {path}", soft_wrap=True)


def _summary(figures: TeachFigures, torque: str, speed: str) -> str:
    at_part = (
        f"{figures.force_n:.2f} N moves it at {figures.speed_mm_s:.2f} mm/s"
        if figures.force_n is not None and figures.speed_mm_s is not None
        else f"{figures.torque:.4f} {torque} moves it at {figures.speed:.4f} {speed}"
    )
    return (
        f"{at_part}; it stops within {figures.stop_ms:.0f} ms of letting go, overshoots by"
        f" {figures.overshoot_counts:.1f} encoder counts and then stands still to"
        f" {figures.ripple_counts:.1f} counts."
    )


def _maybe(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
