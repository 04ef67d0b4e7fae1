"""How every figure looks: one size of letters, one set of colours, margins in inches.

Colours are Okabe and Ito's, which people with the common forms of colour blindness can tell apart;
measured is always dark grey, the base model vermilion, the extended model blue. Margins are set in
inches rather than by a layout engine, which keeps axes aligned between figures and drawing fast.
"""

from __future__ import annotations

import io
import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Literal

from idtool.errors import InputError
from idtool.io.atomic import write_whole
from idtool.model.units import Units, torque_name, unit_text
from idtool.presentation import text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure, SubFigure

#: Where `panels` draws in place of a figure of its own.
_PLACE: ContextVar[SubFigure | None] = ContextVar("_PLACE", default=None)

MEASURED = "#3a3f45"
BEFORE = "#d55e00"
AFTER = "#0072b2"
#: Base model and extended model: their colours and names.
PAIR = ((BEFORE, "base model"), (AFTER, "extended model"))
THIRD = "#009e73"
FAINT = "#8a9099"
UNDER = "#bfc5cc"
SHADE = "#e9ecf0"

#: Inches: of a figure in a page of text, of one that has the page to itself, and dots of each.
WIDTH, WIDE = 5.8, 12.0
DPI = 140
_LEAST_PANEL = 0.3  # inches, below which a panel shows nothing
_EDGE = 0.12  # inches from the left edge to headline and legend
#: More markers than this only cost time: the eye sees the same cloud.
MOST_MARKERS = 3000
_NARROW = 1.6  # decades

_RC: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 10,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "axes.labelcolor": "#24292f",
    "axes.edgecolor": "#8a9099",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    # a formula in every tick label doubles the drawing time, and a dollar sign in a name is no formula
    "axes.formatter.use_mathtext": False,
    "text.parse_math": False,
    "axes.formatter.limits": (-4, 5),
    "grid.color": "#dfe3e8",
    "grid.linewidth": 0.7,
    "xtick.color": "#6b727b",
    "ytick.color": "#6b727b",
    "xtick.labelcolor": "#3a3f45",
    "ytick.labelcolor": "#3a3f45",
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.frameon": False,
    "legend.fontsize": 9.5,
    "legend.handlelength": 1.6,
    "legend.columnspacing": 1.4,
    "lines.linewidth": 1.4,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    # text stays text in SVG: small files that can be searched and restyled
    "svg.fonttype": "none",
    "svg.hashsalt": "ffc-id",
}


@contextmanager
def look() -> Iterator[None]:
    """The look of our figures for as long as the block lasts; the user's own settings stay as they were."""
    from matplotlib import rc_context, rcdefaults, rcParams

    with rc_context():
        rcdefaults()
        for key, value in _RC.items():
            rcParams[key] = value  # type: ignore[index]  # known keys, typed as literals
        yield


#: Decorates a function that draws a figure in our look.
styled = look()


def placed(draw: Callable[[], Figure], axes: Axes | None) -> Figure:
    """A figure as `draw` makes it, or drawn into the place of these axes; the whole figure.

    Raises:
        InputError: the axes were not made by `subplots`, so that they have no cell to give.
    """
    if axes is None:
        return draw()
    given = getattr(axes, "get_subplotspec", None)
    cell = given() if given is not None else None
    if cell is None:
        raise InputError(
            "these axes have no cell in a grid", argument="ax", remedy="make them with matplotlib's subplots"
        )
    place = axes.figure.add_subfigure(cell)
    axes.remove()
    token = _PLACE.set(place)
    try:
        return draw().get_figure(root=True)
    finally:
        _PLACE.reset(token)


def size(figure: Figure | SubFigure) -> tuple[float, float]:
    """Width and height in inches, of a part of a figure too."""
    box, dpi = figure.bbox, figure.get_figure(root=True).dpi
    return box.width / dpi, box.height / dpi


def panels(
    rows: int = 1,
    columns: int = 1,
    *,
    width: float = WIDTH,
    height: float = 3.9,
    left: float = 0.82,
    right: float = 0.18,
    top: float = 0.74,
    bottom: float = 0.55,
    gap: tuple[float, float] = (0.3, 0.3),
    share: Literal["", "x", "y", "xy"] = "",
    heights: Sequence[float] | None = None,
) -> tuple[Figure, list[Axes]]:
    """A figure and its axes, row by row.

    Args:
        width, height: of the figure, inches.
        left, right, top, bottom: margins, inches.
        gap: between columns and between rows, inches.
        share: which axes the panels share.
        heights: relative heights of the rows.
    """
    from matplotlib.figure import Figure

    figure: Any = _PLACE.get()
    if figure is None:
        figure = Figure(figsize=(width, height))
    else:
        width, height = size(figure)
    panel_width = (width - left - right - gap[0] * (columns - 1)) / columns
    panel_height = (height - top - bottom - gap[1] * (rows - 1)) / rows
    if min(panel_width, panel_height) < _LEAST_PANEL:
        raise InputError(
            f"has no room for it ({width:.1f} by {height:.1f} inches)",
            argument="ax",
            remedy=f"make that part of the figure {WIDTH:g} by 4 inches or more",
        )
    axes = figure.subplots(
        rows,
        columns,
        squeeze=False,
        sharex="x" in share,
        sharey="y" in share,
        gridspec_kw={
            "left": left / width,
            "right": 1.0 - right / width,
            "bottom": bottom / height,
            "top": 1.0 - top / height,
            "wspace": gap[0] / panel_width,
            "hspace": gap[1] / panel_height,
            "height_ratios": heights,
        },
    )
    return figure, list(axes.flat)


def title(figure: Figure, headline: str) -> None:
    """The headline of a figure: what to see, at its top left."""
    width, height = size(figure)
    left, top = _EDGE / width, 1.0 - 0.14 / height
    figure.text(left, top, headline, fontsize=11.5, fontweight="bold", va="top")


def legend(figure: Figure, axes: Axes) -> None:
    """A legend in one line under the headline, where it hides no data."""
    width, height = size(figure)
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="upper left",
        bbox_to_anchor=(_EDGE / width, 1.0 - 0.38 / height),
        ncols=4,
        borderaxespad=0.0,
        borderpad=0.0,
    )


def axis_label(quantity: str, dimension: str, kind: Units) -> str:
    """ "Velocity, rad/s": a quantity with its unit."""
    unit = unit_text(dimension, kind)
    return f"{quantity}, {unit}" if unit else quantity


def torque_label(kind: Units, prefix: str = "") -> str:
    """ "Torque, N m" or "Force, N", with a word before it if wanted."""
    name = f"{prefix} {torque_name(kind)}".strip()
    return axis_label(name[:1].upper() + name[1:], "torque", kind)


def points(colour: str) -> dict[str, Any]:
    """How measured points with their error bars look, as keyword arguments of `Axes.errorbar`."""
    return {"fmt": "o", "ms": 4.5, "color": colour, "capsize": 2.5, "lw": 1.0, "zorder": 3}


def powers_of_ten(axis: Axis) -> None:
    """Label the decades of a logarithmic axis as 10⁻¹, 1, 10, 10² without the formula typesetter.

    Where it spans hardly more than one, 2 and 5 between them are labelled too. Call it last: it goes by
    what the axis shows.
    """
    from matplotlib.ticker import FuncFormatter, NullFormatter

    def decade(value: float, _: object) -> str:
        exponent = round(math.log10(value)) if value > 0 else 0
        return {0: "1", 1: "10"}.get(exponent, text.power(exponent))

    def between(value: float, _: object) -> str:
        mantissa = value / 10.0 ** math.floor(math.log10(value)) if value > 0 else 0.0
        return f"{value:g}" if round(mantissa, 3) in (2.0, 5.0) else ""

    low, high = axis.get_view_interval()
    narrow = 0 < low < high and math.log10(high / low) < _NARROW
    axis.set_major_formatter(FuncFormatter(decade))
    axis.set_minor_formatter(FuncFormatter(between) if narrow else NullFormatter())


def thin(count: int, most: int = MOST_MARKERS) -> slice:
    """Every k-th row, so that at most about `most` are drawn."""
    return slice(None, None, max(1, -(-count // most)))


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure whole or not at all, PNG or SVG by its name.

    Raises:
        InputError: it cannot be written.
    """
    form = "svg" if os.fspath(path).endswith(".svg") else "png"
    write_whole(path, render(figure, form))


@styled
def render(figure: Figure, form: str, dpi: int = DPI) -> bytes:
    """A figure as the bytes of a PNG or SVG file, the same bytes each time."""
    stream = io.BytesIO()
    metadata = {"Date": None, "Creator": None} if form == "svg" else {"Software": None}
    figure.savefig(stream, format=form, dpi=dpi, metadata=metadata)
    return stream.getvalue()


def few_colours(png: bytes, colours: int) -> bytes:
    """A PNG with so many colours at most: a page of text must not be outweighed by its pictures."""
    from PIL import Image

    small = io.BytesIO()
    with Image.open(io.BytesIO(png)) as image:
        few = image.convert("RGB").quantize(colours, dither=Image.Dither.NONE)
        few.save(small, format="png", optimize=True)
    return small.getvalue()
