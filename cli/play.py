"""`ffc-id play`: a taught path, played back."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .common import PATH, defaulted, given_words
from .guiding import Watched, setup_of, tell_end, travel_of, watched_options
from .live import live_views
from .numbers import NumberRange
from .progress import Progress

if TYPE_CHECKING:
    from idtool.guiding.playback import Played

    from .screen import Screen


@click.command()
@click.argument("taught", type=PATH)
@watched_options
@defaulted("--speed", default=1.0, type=NumberRange(1e-3, 10.0), help="Speed, relative to how it was taught.")
@defaulted("--loop", default=1, metavar="N", type=click.IntRange(1), help="How often.")
@click.option("--waypoints", type=PATH, help="Write the path as points to edit, and play those.")
def play(told: Watched, taught: Path, speed: float, loop: int, waypoints: Path | None) -> int:
    """Play a taught path back: the log of `teach -o`, or a file of waypoints.

    The path is smoothed and kept inside the rig's position, speed and current; the axis moves to its start
    slowly, from wherever it is. It stops where it meets something, and says where (exit code 4).

    \b
    ffc-id teach -p result/params.toml --rig sim:bench -o taught.csv
    ffc-id play taught.csv --rig sim:bench -p result/params.toml --speed 0.5
    ffc-id play taught.csv --waypoints points.toml --rig sim:bench
    """
    from idtool.errors import InputError
    from idtool.guiding.path import cut_by, limited, read_path, write_waypoints
    from idtool.guiding.playback import play as run
    from idtool.guiding.player import BEHIND_SHARE
    from idtool.io.atomic import refuse_existing
    from idtool.rig import open_rig

    output, log, force = told.output, told.log, told.force
    path, axis = read_path(taught)
    if waypoints is not None:
        refuse_existing(waypoints, force, taught, told.params)
        points = write_waypoints(waypoints, path, force=force)
        output.say(f"{points} waypoints written: {waypoints}")
        path, axis = read_path(waypoints)
    watching = told.watching(taught, waypoints)
    parameters, tilted = watching["parameters"], told.tilted
    rig = told.told_rig()
    with open_rig(rig, seed=told.seed) as device:
        if axis.kind != device.axis.kind:
            raise InputError(
                f"was taught on a {axis.kind} axis and the rig is {device.axis.kind}",
                file=taught,
                place="axis.kind",
            )
        load = told.load(parameters, device)
        low, high = device.limits.position
        if cut := cut_by(path, low, high):
            output.warn(f"{cut}.")
        path, scale = limited(path, low=low, high=high, speed=device.limits.speed, scale=speed)
        if scale < speed:
            output.warn(f"played at {scale:.2g} of the taught speed: faster is beyond the limits of the rig.")
        setup = setup_of(load, tilted, device, told.inside(device))
        with live_views(told, device) as watch, Progress(output, "playing") as bar:
            played = run(
                path,
                device,
                setup,
                loops=loop,
                progress=lambda share: bar.at(share, 1.0),
                **watching | {"behind": BEHIND_SHARE * (high - low), "watch": watch},
            )
    ratio = travel_of(parameters, axis.kind)
    key, factor = ("rms_error_mrad", 1e3) if ratio is None else ("rms_error_mm", 1e3 * ratio)
    document = {
        "schema": "ffc-id/play/1",
        key: played.rms_error * factor,
        "speed": scale,
        "lag_s": played.lag_s,
    }
    code = tell_end(told, rig, device, played, document, lambda screen: _show(screen, played, ratio))
    if code == 0 and log is not None:
        output.next("plot", log)
    elif code == 0:
        output.next("play", *given_words(), "-o", "played.csv")
    return code


def _show(screen: Screen, played: Played, ratio: float | None) -> None:
    error = (
        f"{1e3 * played.rms_error:.2f} mrad" if ratio is None else f"{1e3 * ratio * played.rms_error:.3f} mm"
    )
    lag = f"(loop's lag {1e3 * played.lag_s:.0f} ms, led by that)"
    if not len(played.time):
        screen.print("ended on the way to the path.")
    elif played.interrupted or played.stopped is not None:
        screen.print(f"played in part; position off by {error} rms {lag}.")
    else:
        screen.print(f"played; position off by {error} rms {lag}.")
