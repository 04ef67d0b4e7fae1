"""`--live` of every command that moves an axis."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from .common import Output

if TYPE_CHECKING:
    from idtool.rig.base import Rig, Watch

live_option = click.option(
    "--live", is_flag=True, help="Show the axis while it moves, on a page of this machine."
)


@contextmanager
def live_page(wanted: bool, rig: Rig, output: Output) -> Iterator[Watch | None]:
    """What shows a row on the live page; None if nobody asked for one."""
    if not wanted:
        yield None
        return
    from idtool.live.view import LiveView

    with LiveView(rig.axis.kind, rig.axis.per_reading) as view:
        output.say(f"live: {view.address}")
        yield _in_real_time(view.show) if rig.simulated else view.show


def _in_real_time(show: Watch) -> Watch:
    """A simulated axis would be through before a browser opens: it waits for the clock."""
    zero, last = math.nan, math.inf

    def wait(time_s: float, *row: float) -> None:
        nonlocal zero, last
        if time_s < last:  # the first row of a trial
            zero = time.monotonic() - time_s
        last = time_s
        time.sleep(max(zero + time_s - time.monotonic(), 0.0))
        show(time_s, *row)

    return wait
