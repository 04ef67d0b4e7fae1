"""`ffc-id jog`: move an axis by the arrow keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .guiding import Watched, setup_of, tell_end, travel_of, watched_options
from .live import live_views
from .numbers import POSITIVE
from .progress import Progress

if TYPE_CHECKING:
    from idtool.model.units import Kind


@click.command()
@watched_options
@click.option(
    "--step",
    metavar="MM",
    type=POSITIVE,
    help="A tap moves so far [0.5 mm]; in mrad where nothing says how the part moves [10 mrad].",
)
@click.option(
    "--speed",
    metavar="MM_S",
    type=POSITIVE,
    help="A key that is held moves so fast [5 mm/s; else 100 mrad/s].",
)
def jog(told: Watched, step: float | None, speed: float | None) -> int:
    """Move the axis by the arrow keys of a terminal, for fine positioning.

    Up and right are forwards, down and left backwards. A tap moves by one step; a key that is held moves on
    slowly until it is released (0.15 s later, as a terminal tells no release). q ends it. The axis stays
    inside the rig's position, speed and current, and stops where it meets something (exit code 4). With -o
    the way is a taught path, which `play` repeats.

    \b
    ffc-id jog --rig sim:bench -p result/params.toml --step 0.1 -o way.csv
    """
    from idtool.guiding.jog import SPEED_M_S, SPEED_RAD_S, STEP_M, STEP_RAD, ArrowKeys
    from idtool.guiding.jog import jog as run
    from idtool.guiding.keys import TerminalKeys
    from idtool.guiding.player import BEHIND_SHARE
    from idtool.rig import open_rig
    from idtool.rig.clock import HostClock

    output, log, watching = told.output, told.log, told.watching()
    parameters, tilted = watching["parameters"], told.tilted
    rig = told.told_rig()
    with open_rig(rig, seed=told.seed) as device:
        load = told.load(parameters, device)
        kind: Kind = device.axis.kind
        ratio = travel_of(parameters, kind)
        usual_step, usual_speed = (STEP_RAD, SPEED_RAD_S) if ratio is None else (STEP_M, SPEED_M_S)
        scale = 1.0 if ratio is None else 1.0 / ratio
        low, high = device.limits.position
        where, remedy = "jog", "run it in a terminal, or move the axis by `play` and a file of waypoints"
        with TerminalKeys(where, remedy):  # no keys: told before anything is asked or moves
            pass
        setup = setup_of(load, tilted, device, told.inside(device))
        with (
            TerminalKeys(where, remedy) as keys,
            live_views(told, device) as watch,
            Progress(output, "hands off, it listens", timed=False) as bar,
        ):
            output.say("arrow keys move the axis, q ends it")

            def tell(position: float) -> None:
                bar.say(_place(position, ratio, kind))
                bar.at(position - low, high - low)

            jogged = run(
                device,
                setup,
                ArrowKeys(keys.read, lambda: keys.gone),
                step=scale * (usual_step if step is None else 1e-3 * step),
                speed=scale * (usual_speed if speed is None else 1e-3 * speed),
                tell=tell,
                clock=HostClock() if device.simulated else None,
                **watching | {"behind": BEHIND_SHARE * (high - low), "watch": watch},
            )
    key, factor = ("moved_mrad", 1e3) if ratio is None else ("moved_mm", 1e3 * ratio)
    document = {
        "schema": "ffc-id/jog/1",
        "position": jogged.position,
        key: factor * (jogged.position - jogged.start),
    }
    place = _place(jogged.position, ratio, kind)
    code = tell_end(told, rig, device, jogged, document, lambda screen: screen.print(f"at {place}."))
    if code == 0 and log is not None:
        output.next("play", log, "--rig", rig)
    elif code == 0:
        output.next("jog", "--rig", rig, "-o", "way.csv")
    return code


def _place(position: float, ratio: float | None, kind: Kind) -> str:
    from idtool.model.units import unit_text

    mm = "" if ratio is None else f", {1e3 * ratio * position:+z.2f} mm"
    return f"{position:+z.4f} {unit_text('position', kind)}{mm}"
