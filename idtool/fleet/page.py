"""The page of a fleet: self-contained HTML with spread, outliers and drift."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from idtool.fleet.statistics import DAYS_PER_YEAR
from idtool.fleet.summary import Fleet, ParameterLine
from idtool.model.units import SUFFIXES, unit_text
from idtool.presentation import style, text
from idtool.presentation.html import embedded, environment, resource
from idtool.version import __version__

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Panels beside each other.
_COLUMNS = 2
#: Room below a panel for a line of words, and for slanting names, inches.
_WORDS, _NAMES = 0.6, 0.75
#: Units are named under a panel up to this many.
_MOST_NAMES = 12
#: Failures, and what stands out, that a tile tells; the table has all.
_MOST_TOLD = 8


def page(fleet: Fleet, name: str) -> str:
    """The page as text; it needs no network and no other file."""
    script = resource("idtool.fleet", "page.js")
    template = environment().from_string(resource("idtool.fleet", "page.html.jinja"))
    done = [row for row in fleet.sessions if not row.error]
    return template.render(
        style=resource("idtool.report", "page.css"),
        script=script,
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii"),
        most=_MOST_TOLD,
        name=name,
        version=__version__,
        units=len({row.unit for row in done}),
        done=done,
        failed=fleet.failed,
        sessions=[(row, text.number(row.before, 3), text.number(row.after, 3)) for row in fleet.sessions],
        lines=[_line(line) for line in fleet.parameters],
        odd=_odd(fleet),
        drifting=[label(line.key)[0] for line in fleet.parameters if line.drifts],
        pictures=_pictures(fleet),
    )


def label(key: str) -> tuple[str, str]:
    """What a parameter is called, and its unit.

    >>> label("position_ripple.phase_1_rad"), label("inertia.inertia_kg_m2")
    (('position ripple: phase 1', 'rad'), ('inertia', 'kg m²'))
    """
    effect, _, base = key.rpartition(".")
    endings = [(suffix, dim, k) for dim, pair in SUFFIXES.items() for k, suffix in enumerate(pair) if suffix]
    fitting = [one for one in endings if base.endswith(f"_{one[0]}")]
    unit = ""
    if fitting:
        suffix, dimension, linear = max(fitting, key=lambda one: len(one[0]))
        unit = unit_text(dimension, "linear" if linear else "rotary")
        base = base.removesuffix(f"_{suffix}")
    name = text.quantity(base)
    return (f"{text.words(effect)}: {name}" if effect not in ("", base) else name), unit


def _line(line: ParameterLine) -> dict[str, str]:
    name, unit = label(line.key)
    relative = line.spread / abs(line.median) if line.spread is not None and line.median else None
    drift = "–"
    if line.drift is not None:
        drift = f"{text.number(line.drift, 2)} (p {text.p_text(line.drift_p)})"
    return {
        "name": name,
        "unit": unit,
        "units": str(line.units),
        "median": text.number(line.median),
        "spread": text.number(line.spread, 2),
        "relative": text.percent(relative, 1),
        "range": f"{text.number(line.lowest)} to {text.number(line.highest)}",
        "repeatability": text.number(line.repeatability, 2),
        "drift": drift,
        "drifts": "yes" if line.drifts else "",
        "odd": text.listed([*line.outlying_units, *line.outlying_sessions]),
    }


def _odd(fleet: Fleet) -> list[tuple[str, str]]:
    """Unit or session that stands out -> in which parameters."""
    found: dict[str, list[str]] = {}
    for line in fleet.parameters:
        for name in line.outlying_units:
            found.setdefault(f"unit {name}", []).append(label(line.key)[0])
        for name in line.outlying_sessions:
            found.setdefault(f"session {name}", []).append(label(line.key)[0])
    return [(name, text.listed(keys)) for name, keys in sorted(found.items())]


def _pictures(fleet: Fleet) -> list[dict[str, Any]]:
    pictures = []
    if fleet.parameters:
        alt = "Each parameter by unit, with standard errors; the median as a line, outliers in orange"
        pictures.append(_embed("units", "Every parameter by unit", alt, _units_figure(fleet)))
    dated = [line for line in fleet.parameters if line.drift is not None]
    if dated:
        alt = "Each parameter over time, as its difference from the median of its unit"
        pictures.append(_embed("drift", "Change over time, units apart", alt, _drift_figure(fleet, dated)))
    return pictures


def _embed(name: str, title: str, alt: str, figure: Figure) -> dict[str, Any]:
    address, width, height = embedded(style.render(figure, "png"))
    return {"name": name, "title": title, "alt": alt, "address": address, "width": width, "height": height}


@style.styled
def _units_figure(fleet: Fleet) -> Figure:
    def draw(panel: Axes, line: ParameterLine, points: pd.DataFrame) -> None:
        units = sorted(points["unit"].unique())
        place = points["unit"].map({unit: index for index, unit in enumerate(units)})
        odd = points["unit"].isin(line.outlying_units) | points["session"].isin(line.outlying_sessions)
        panel.axhline(line.median, color=style.FAINT, lw=1.0)
        for mask, colour in ((~odd, style.AFTER), (odd, style.BEFORE)):
            panel.errorbar(
                place[mask],
                points["value"][mask],
                points["stderr"][mask].fillna(0.0),
                fmt="o",
                ms=4,
                color=colour,
                lw=1.0,
            )
        named = len(units) <= _MOST_NAMES
        panel.set_xticks(range(len(units)) if named else [], units if named else [], rotation=30, ha="right")
        if not named:
            panel.set_xlabel(f"{len(units)} units, by name")
        panel.set_xlim(-0.5, len(units) - 0.5)

    many = len({row.unit for row in fleet.sessions}) > _MOST_NAMES
    below = _WORDS if many else _NAMES
    return _grid(fleet, list(fleet.parameters), "Every parameter by unit", draw, below=below)


@style.styled
def _drift_figure(fleet: Fleet, lines: list[ParameterLine]) -> Figure:
    first = min(fleet.points(line.key)["day"].min() for line in lines)

    def draw(panel: Axes, line: ParameterLine, points: pd.DataFrame) -> None:
        dated = points.dropna(subset="day")
        years = (dated["day"].astype(float) - first) / DAYS_PER_YEAR
        for _, rows in dated.groupby("unit"):
            if len(rows) > 1:
                order = np.argsort(rows["day"].to_numpy(dtype=float), kind="stable")
                x = years[rows.index].to_numpy()[order]
                y = (rows["value"] - rows["value"].median()).to_numpy()[order]
                panel.plot(x, y, color=style.UNDER, marker="o", ms=3, mfc=style.AFTER, mec="none", lw=1.0)
        span = np.array(panel.get_xlim())
        middle = float(years.median())
        colour = style.BEFORE if line.drifts else style.FAINT
        panel.plot(span, (line.drift or 0.0) * (span - middle), color=colour, lw=1.6)
        panel.set_xlim(*span)
        panel.set_xlabel("Years since the first session")

    return _grid(fleet, lines, "Difference from the unit's median over time", draw, below=_WORDS)


def _grid(
    fleet: Fleet,
    lines: list[ParameterLine],
    headline: str,
    draw: Callable[[Axes, ParameterLine, pd.DataFrame], None],
    *,
    below: float,
) -> Figure:
    """One panel per parameter; `below` each is so much room for its words, inches."""
    rows = -(-len(lines) // _COLUMNS)
    figure, panels = style.panels(
        rows,
        _COLUMNS,
        width=style.WIDE,
        height=0.55 + (2.05 + below) * rows,
        left=0.9,
        top=0.75,
        bottom=below,
        gap=(1.0, 0.2 + below),
    )
    style.title(figure, headline)
    for panel, line in zip(panels, lines, strict=False):
        draw(panel, line, fleet.points(line.key))
        name, unit = label(line.key)
        panel.set_title(f"{name}, {unit}" if unit else name)
        panel.ticklabel_format(axis="y", useOffset=False)  # what a whole tick says, nobody has to add up
    for panel in panels[len(lines) :]:
        panel.set_visible(False)
    return figure
