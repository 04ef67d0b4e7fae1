"""`--live` and `--live-udp` of every command that moves an axis."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

from .numbers import Address

if TYPE_CHECKING:
    from idtool.rig.base import Rig, Watch

    from .moving import Moving


def live_options(command: Any) -> Any:
    """Both, handed to a command as `live` and `live_udp`."""
    udp = "Send every sample there as a JSON datagram, as PlotJuggler's UDP server takes it: 127.0.0.1:9870."
    page = "Show the axis while it moves, on a page of this machine."
    command = click.option("--live-udp", type=Address(), metavar="HOST:PORT", help=udp)(command)
    return click.option("--live", is_flag=True, help=page)(command)


@contextmanager
def live_views(told: Moving, rig: Rig) -> Iterator[Watch | None]:
    """What shows a row wherever that was asked for; None if nobody did."""
    if not told.live and told.live_udp is None:
        yield None
        return
    from idtool.live.row import Row
    from idtool.live.udp import UdpStream
    from idtool.live.view import LiveView

    with ExitStack() as views:
        shows: list[Watch] = []
        row = Row.of(rig)
        if told.live:
            view = views.enter_context(LiveView(row))
            told.output.say(f"live: {view.address}")
            shows.append(view.show)
        if told.live_udp is not None:
            shows.append(views.enter_context(UdpStream(row, told.live_udp)).show)
        yield _in_turn(shows, rig.simulated)


def _in_turn(shows: list[Watch], simulated: bool) -> Watch:
    """Shows a row in every view; a simulated axis, which would be through before a browser opens, waits for
    the clock."""
    zero, last = math.nan, math.inf

    def show(time_s: float, *row: float) -> None:
        nonlocal zero, last
        if simulated:
            if time_s < last:  # the first row of a trial
                zero = time.monotonic() - time_s
            last = time_s
            time.sleep(max(zero + time_s - time.monotonic(), 0.0))
        for one in shows:
            one(time_s, *row)

    return show
