"""`ffc-id plot`: a first look at a log."""

from __future__ import annotations

from pathlib import Path

import click

from .axis import Given, axis_options
from .common import PATH, Output, force_option, output_options, picture_name


@click.command()
@click.argument("log", type=PATH, metavar="LOG")
@click.option(
    "-o", "--output", "target", type=PATH, callback=picture_name, help="The picture, PNG or SVG [LOG.png]."
)
@axis_options
@force_option
@output_options
def plot(log: Path, target: Path | None, given: Given, force: bool, output: Output) -> None:
    """Draw a log before any fit: position, speed and effort over time, and effort over speed and position.

    On an axis without gravity the effort changes its sign with the speed; a cloud that does not is a
    recording with a lost sign, or a commanded value in place of a measured one.

    \b
    ffc-id plot sweep.csv -o sweep.png
    """
    from idtool.io.atomic import refuse_existing
    from idtool.presentation.style import save

    (read,) = given.read([log], output)
    path = target or Path(f"{log.name.removesuffix('.gz').removesuffix('.csv')}.png")
    refuse_existing(path, force, log)
    save(read.plot(), path)
    output.result({"figure": str(path)}, [f"figure: {path}"])
    output.next("check", log)
