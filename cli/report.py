"""`ffc-id report`: draw the report of a result folder again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .common import Output, output_options
from .progress import Progress

if TYPE_CHECKING:
    from rich.console import Console


@click.command()
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@output_options
def report(folder: Path, output: Output) -> None:
    """Make the fit report of DIR, a folder that `identify` or `diagnose` wrote.

    Writes DIR/report.html, one page that needs no network and no other file, and its figures as PNG
    and SVG in DIR/figures. An earlier report there is replaced.

    \b
    ffc-id identify *.csv -o result
    ffc-id report result
    """
    from idtool.report import write_report

    with Progress(output, "drawing the figures"):
        page = write_report(folder)
    figures = sorted((folder / "figures").glob("*.png"))

    def show(console: Console) -> None:
        # plain text: a path must stay on one line and is not markup
        click.echo(f"report: {page}")
        click.echo(f"figures: {len(figures)} in {folder / 'figures'}, as PNG and SVG")

    output.result({"report": str(page), "figures": [str(figure) for figure in figures]}, show)
