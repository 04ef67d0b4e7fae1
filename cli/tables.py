"""Tables that several commands print."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from idtool.parameters import Parameters

    from .screen import Screen

#: Between two columns; and what a column of remarks is folded to, if need be.
_GAP = 2
_REMARK_WIDTH = 16


def print_table(
    screen: Screen, headings: Sequence[str], rows: Sequence[Sequence[str]], title: str | None = None
) -> None:
    """A table, or where the terminal is too narrow for it, each row as a few short lines.

    Args:
        screen: where.
        headings: one a column; a leading ">" sets the column to the right. A last one that is empty is
            for remarks, which may be folded.
        rows: plain text.
        title: above it.
    """
    names = [heading.removeprefix(">") for heading in headings]
    widths = [max(map(len, column)) for column in zip(names, *rows, strict=True)]
    room = screen.width - sum(widths[:-1]) - _GAP * (len(widths) - 1)
    if not names[-1]:
        widths[-1] = max(min(widths[-1], room), min(widths[-1], _REMARK_WIDTH))
    if widths[-1] > room:
        _print_stacked(screen, names, rows, title)
        return
    right = [heading.startswith(">") for heading in headings]
    if title is not None:
        screen.print(title, bold=True)
    screen.print(_line(names, widths, right), bold=True)
    for row in rows:
        first, *more = wrap(row[-1], max(widths[-1], 1)) or [""]
        screen.print(_line([*row[:-1], first], widths, right))
        for rest in more:
            screen.print(_line([""] * (len(row) - 1) + [rest], widths, right))


def _line(cells: Sequence[str], widths: Sequence[int], right: Sequence[bool]) -> str:
    padded = zip(cells, widths, right, strict=True)
    return (" " * _GAP).join(cell.rjust(width) if end else cell.ljust(width) for cell, width, end in padded)


def _print_stacked(
    screen: Screen, names: Sequence[str], rows: Sequence[Sequence[str]], title: str | None
) -> None:
    """Each row's first cell, and under it the others, as many on a line as fit."""
    if title is not None:
        screen.print(title, bold=True)
    for first, *cells in rows:
        screen.print(first, bold=True)
        line = ""
        for name, cell in zip(names[1:], cells, strict=True):
            piece = f"{name} {cell}".strip() if cell else ""
            if piece and line and len(line) + len(piece) + 4 > screen.width:
                screen.print(f"  {line},")
                line = piece
            elif piece:
                line = f"{line}, {piece}" if line else piece
        if line:
            screen.print(f"  {line}")


def print_parameters(screen: Screen, parameters: Parameters, parts: tuple[str, ...]) -> None:
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
    print_table(screen, ("parameter", ">value", ">std error", ">95 % interval", "unit", ""), rows)


def document_of(parameters: Parameters, part: str) -> Any:
    """A part of the parameter file as JSON."""
    document = parameters.to_document()
    if part in ("static", "dynamic"):
        return document["friction"][part]
    return document[part]
