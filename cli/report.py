"""`ffc-id report`: draw the report of a result folder again."""

from __future__ import annotations

from pathlib import Path

import click

from .common import PATH, Output, output_options
from .progress import Progress


@click.command()
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("--svg", is_flag=True, help="Draw each figure as SVG too, for a paper.")
@output_options
def report(folder: Path, svg: bool, output: Output) -> None:
    """Make the fit report of DIR, a folder that `identify` or `diagnose` wrote.

    Writes DIR/report.html, one page that needs no network and no other file, and its figures as PNG
    in DIR/figures. An earlier report there is replaced.

    \b
    ffc-id identify *.csv -o result
    ffc-id report result
    """
    from idtool.report import write_report
    from idtool.report.next_step import next_step_of

    with Progress(output, "drawing the figures") as bar:
        page = write_report(folder, svg=svg, progress=bar.at)
    figures = sorted((folder / "figures").glob("*.png"))
    forms = "PNG and SVG" if svg else "PNG"

    lines = [f"report: {page}", f"figures: {len(figures)} in {folder / 'figures'}, as {forms}"]
    output.result({"report": str(page), "figures": [str(figure) for figure in figures]}, lines)
    output.next(*next_step_of(folder).words)
