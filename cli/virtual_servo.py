"""`ffc-id virtual-servo`: a servo to rehearse a session with, and its mishaps, without a device."""

from __future__ import annotations

import json
import os
import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .angles import radians
from .common import PATH, defaulted, seed_option
from .numbers import NumberRange, Tilt
from .words import Choice, complete_plant

if TYPE_CHECKING:
    from idtool.virtual_servo.rehearsal import Rehearsal

#: How often it is looked whether the device is gone, s.
_POLL_S = 0.2


@click.command("virtual-servo")
@defaulted(
    "--plant",
    default="paper",
    metavar="NAME|FILE",
    shell_complete=complete_plant,
    help="The axis behind it: a named rig, or a plant file of yours.",
)
@defaulted("--kind", default="dynamixel", type=Choice(["dynamixel", "feetech"]), help="Whose servo it is.")
@defaulted("--id", default=1, type=click.IntRange(0, 252), help="Its id.")
@click.option("--baud", type=int, help="Its baud rate [57600 or, of a Feetech, 1000000].")
@click.option("--model", type=int, metavar="NUMBER", help="Its model number [1150 or, of a Feetech, 777].")
@defaulted(
    "--scale",
    default=1.0,
    type=NumberRange(0.1, 100.0),
    help="Seconds of the servo per second here; give the rig the same scale=.",
)
@click.option(
    "--payload", default=0.0, type=NumberRange(0.0), metavar="KG", help="What the axis carries at the start."
)
@click.option("--tilt", nargs=2, type=Tilt(), metavar="ALPHA BETA", help="Its tilt at the start, rad [none].")
@click.option(
    "--tilt-deg", nargs=2, type=Tilt(), metavar="ALPHA BETA", help="Its tilt at the start, degrees."
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="WORD",
    help="What goes wrong: lost=0.01, corrupt=0.01, late=0.01, twice=0.01, burst@2=0.1, silent@2, "
    "unplugged@2, power@2, overload@2, error@2=4, stuck@2, watchdog@2 (seconds of torque).",
)
@click.option("--link", type=PATH, help="Make a symbolic link to the device here.")
@click.option("--json", "as_json", is_flag=True, help="Say where it is as one JSON document.")
@seed_option
def virtual_servo(
    *,
    plant: str,
    payload: float,
    tilt: tuple[float, float] | None,
    tilt_deg: tuple[float, float] | None,
    link: Path | None,
    as_json: bool,
    **how: Any,
) -> None:
    """Run a virtual servo: a serial device with a simulated axis behind it.

    It answers byte for byte as a DYNAMIXEL or a Feetech STS servo does. The first line of its output is its
    device; another terminal works with that as with a real servo. Meanwhile say here what you do to the axis
    (payload 0.4, tilt-deg 90 0, hand 0.2, fault silent@0, power, status). Ctrl-C ends it.

    \b
    ffc-id virtual-servo --plant bench --baud 1000000
    ffc-id run-sweep --rig dynamixel:/dev/pts/7,baud=1000000 -o sweep.csv
    ffc-id virtual-servo --kind feetech --plant sts3215
    """
    from idtool.errors import RigFault
    from idtool.rig.base import TrialSetup
    from idtool.rig.opening import read_plant

    try:
        from idtool.virtual_servo.rehearsal import COMMANDS, Rehearsal
    except ImportError as error:
        raise RigFault("a virtual servo needs the pseudo-terminals of Linux or macOS") from error

    alpha, beta = radians("tilt", tilt, tilt_deg) or (0.0, 0.0)
    setup = TrialSetup(payload_kg=payload, tilt_alpha_rad=alpha, tilt_beta_rad=beta)
    file = read_plant(plant)
    scaled = f",scale={how['scale']:g}" if how["scale"] != 1.0 else ""
    with (
        suppress(KeyboardInterrupt),
        Rehearsal(file, setup=setup, **how) as bench,
        _linked(link, bench.path),
    ):
        spec = f"{how['kind']}:{link or bench.path},id={how['id']},baud={bench.servo.baud}{scaled}"
        click.echo(json.dumps({"device": bench.path, "rig": spec}) if as_json else bench.path)
        sys.stdout.flush()
        click.echo(f"use it with --rig {spec}; Ctrl-C ends it. Commands here:", err=True)
        for text in COMMANDS.values():
            click.echo(f"  {text}", err=True)
        _converse(bench)


def _converse(bench: Rehearsal) -> None:
    """Do what the lines on standard input say, until Ctrl-C or until the device is gone."""
    from idtool.errors import InputError

    waiting, open_ = b"", True
    while not bench.mishaps.unplugged:
        if not open_:
            time.sleep(_POLL_S)
            continue
        if not select.select([sys.stdin], [], [], _POLL_S)[0]:
            continue
        # not readline(): it keeps further lines where select does not see them
        part = os.read(sys.stdin.fileno(), 4096)
        open_ = bool(part)
        *lines, waiting = (waiting + part).split(b"\n")
        for line in lines:
            if not line.strip():
                continue
            try:
                click.echo(bench.do(line.decode("utf-8", "replace")), err=True)
            except InputError as error:
                click.echo(str(error), err=True)
    click.echo("the device is unplugged.", err=True)


@contextmanager
def _linked(link: Path | None, device: str) -> Iterator[None]:
    """A symbolic link to the device for as long as there is one."""
    from idtool.io.atomic import cannot_write

    if link is None:
        yield
        return
    try:
        if link.is_symlink():
            link.unlink()
        link.symlink_to(device)
    except OSError as error:
        raise cannot_write(link, error) from error
    try:
        yield
    finally:
        link.unlink(missing_ok=True)
