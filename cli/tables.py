"""Tables that several commands print."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

    from idtool.parameters import Parameters

#: Between two columns; and what a column of remarks is folded to, if need be.
_GAP = 2
_REMARK_WIDTH = 16


def print_table(
    console: Console, headings: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None
) -> None:
    """A table, or where the terminal is too narrow for it, each row as a few short lines.

    Args:
        console: where.
        headings: one a column; a leading ">" sets the column to the right. A last one that is empty is
            for remarks, which may be folded.
        rows: plain text, not markup.
        title: above it.
    """
    from rich.cells import cell_len
    from rich.markup import escape
    from rich.table import Table

    names = [heading.removeprefix(">") for heading in headings]
    widths = [max(map(cell_len, column)) for column in zip(names, *rows, strict=True)]
    if not names[-1]:
        widths[-1] = min(widths[-1], _REMARK_WIDTH)
    if sum(widths) + _GAP * (len(widths) - 1) > console.width:
        _print_stacked(console, names, rows, title)
        return
    table = Table(box=None, pad_edge=False, header_style="bold", title=title, title_justify="left")
    for heading, name in zip(headings, names, strict=True):
        if heading.startswith(">"):
            table.add_column(name, justify="right", no_wrap=True)
        else:
            table.add_column(name, no_wrap=bool(name))
    for row in rows:
        table.add_row(*map(escape, row))
    console.print(table)


def _print_stacked(
    console: Console, names: Sequence[str], rows: Sequence[Sequence[str]], title: str | None
) -> None:
    """Each row's first cell, and under it the others, as many on a line as fit."""
    from rich.cells import cell_len

    if title is not None:
        console.print(title, style="bold", markup=False)
    for first, *cells in rows:
        console.print(first, style="bold", markup=False)
        line = ""
        for name, cell in zip(names[1:], cells, strict=True):
            piece = f"{name} {cell}".strip() if cell else ""
            if piece and line and cell_len(line) + cell_len(piece) + 4 > console.width:
                console.print(f"  {line},", markup=False)
                line = piece
            elif piece:
                line = f"{line}, {piece}" if line else piece
        if line:
            console.print(f"  {line}", markup=False)


def print_parameters(console: Console, parameters: Parameters, parts: tuple[str, ...]) -> None:
    """Value, unit, standard error, 95 % interval, and what to think of it."""
    from idtool.parameters.rows import rows_of
    from idtool.presentation.text import quantity

    rows = []
    for row in rows_of(parameters, parts):
        one = row.parameter
        interval = f"{one.ci95[0]:.5g} to {one.ci95[1]:.5g}" if one.ci95 else one.limits("{:.2g}".format)
        error = f"{one.stderr:.2g}" if one.stderr is not None else ""
        name = quantity(row.name)
        base = row.part in ("gravity", "static", "dynamic", "inertia")
        name = name if base else f"{row.part}: {name}"
        rows.append((name, f"{one.value:.5g}", error, interval, row.unit, row.remark))
    print_table(console, ("parameter", ">value", ">std error", ">95 % interval", "unit", ""), rows)


def document_of(parameters: Parameters, part: str) -> Any:
    """A part of the parameter file as JSON."""
    document = parameters.to_document()
    if part in ("static", "dynamic"):
        return document["friction"][part]
    return document[part]
