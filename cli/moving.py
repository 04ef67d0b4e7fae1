"""What commands that move an axis share: `--rig` and the other options of all of them."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from idtool.errors import UsageError

from .angles import radians
from .common import Decorator, Output, force_option, handed, output_options, seed_option
from .live import live_options
from .numbers import Tilt
from .words import complete_rig

if TYPE_CHECKING:
    from .screen import Screen

#: The rig of examples; no command takes it by itself.
EXAMPLE_RIG = "sim:paper"


#: What an angle of half a turn may be off by for its rounding, rad.
_ROUNDED = 0.01


@dataclass(frozen=True)
class Moving:
    """What every such command is told.

    Attributes:
        rig: its word; None where none was given.
        tilt_deg: how the axis stands, degrees.
        live: show it on a page.
        live_udp: send its samples to this host and port.
        seed: of a simulation.
        force: overwrite what is there.
        output: where words go.
    """

    rig: str | None
    tilt_deg: tuple[float, float] | None
    live: bool
    live_udp: tuple[str, int] | None
    seed: int
    force: bool
    output: Output

    def told_rig(self) -> str:
        """The rig: as given, or asked for on a terminal.

        Raises:
            UsageError: no option, and nobody to ask.
        """
        if self.rig is not None:
            return self.rig
        if sys.stdin.isatty() and not self.output.json:
            return click.prompt(
                "which rig (sim:paper, dynamixel:DEVICE, ...; ffc-id rigs lists them)", err=True
            )
        raise UsageError(
            f"--rig is missing; name the axis, as --rig {EXAMPLE_RIG} (simulated) or --rig dynamixel:DEVICE."
        )

    def told_tilt(self, tilt: tuple[float, float] | None = None) -> tuple[float, float] | None:
        """Tilt of `--tilt-deg`, or of `--tilt`, rad.

        Raises:
            UsageError: both were given, or one of them is no tilt.
        """
        for angle in self.tilt_deg or ():
            if not abs(angle) <= 180.0:
                raise UsageError(f"--tilt-deg: {angle:g} degrees is beyond half a turn; give -180 to 180.")
            if any(math.isclose(abs(angle), part * math.pi, abs_tol=1e-3) for part in (0.5, 1.0)):
                self.output.warn(
                    f"--tilt-deg takes degrees, and {angle:g} looks like a part of a turn in rad."
                )
        for angle in tilt or ():
            if not abs(angle) <= math.pi + _ROUNDED:
                raise UsageError(f"--tilt: {angle:g} rad is beyond half a turn; --tilt-deg takes degrees.")
        return radians("tilt", tilt, self.tilt_deg)


def rig_words(rig: str, simulated: bool) -> str:
    """On what a command ran, for a person."""
    return f"{rig} (simulated)" if simulated else rig


def result_on(
    rig: str, simulated: bool, output: Output, document: dict[str, Any], show: Callable[[Screen], None]
) -> None:
    """What a run came to, and on what rig."""

    def told(screen: Screen) -> None:
        screen.print(f"rig: {rig_words(rig, simulated)}", folded=False)
        show(screen)

    output.result({**document, "rig": rig, "simulated": simulated}, told)


_rig_option = click.option(
    "--rig",
    metavar="SPEC",
    shell_complete=complete_rig,
    help="sim:NAME, sim:FILE.toml, dynamixel:DEVICE, feetech:DEVICE or replay:LOG; asked for where it is left"
    " out.",
)
_tilt_deg_option = click.option(
    "--tilt-deg", nargs=2, type=Tilt(), metavar="ALPHA BETA", help="Tilt of the axis, degrees; both: 30 0."
)


def moving_options(kind: type[Moving], *more: Decorator) -> Decorator:
    """Those options and `more`, handed to a command as `told`, which is of that kind."""
    ended = (live_options, seed_option, force_option, output_options)
    return handed("told", kind, _rig_option, _tilt_deg_option, *more, *ended)
