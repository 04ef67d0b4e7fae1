"""The picture of a hand-guiding run, after the paper's Figures 10 and 11."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from idtool.guiding.record import Record
from idtool.model.units import Kind, torque_name, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MODEL, _HAND, _PLACE = "#1f5fa8", "#c8502d", "#2d7d46"


def draw(record: Record, *, kind: Kind = "rotary", travel_ratio: float | None = None) -> Figure:
    """Two panels over time: estimated torque and hand; travel and hand.

    Args:
        record: the run.
        kind: of axis, for the units.
        travel_ratio: m of travel per rad: then the hand is drawn in N and the travel in mm.

    Returns:
        A figure that belongs to no window; `savefig` writes it.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    name, unit = torque_name(kind), unit_text("torque", kind)
    upper.plot(record.time, record.motor, color="0.65", lw=0.8, label=f"motor {name} K i")
    upper.plot(record.time, record.compensated, color=_MODEL, lw=1.2, label="gravity, friction and effects")
    upper.plot(record.time, record.estimated, color=_PLACE, lw=1.2, label="hand, estimated")
    upper.set_ylabel(f"{name} ({unit})")
    place = record.position - record.position[0]
    if travel_ratio is None:
        lower.plot(record.time, place, color=_PLACE, lw=1.4, label="travel")
        lower.set_ylabel(f"travel ({unit_text('position', kind)})")
    else:
        lower.plot(record.time, 1e3 * travel_ratio * place, color=_PLACE, lw=1.4, label="stroke")
        lower.set_ylabel("stroke (mm)")
    lower.set_xlabel("time (s)")
    for axes in (upper, lower):
        _hand(axes, record, kind, travel_ratio)
        axes.grid(alpha=0.25)
        axes.margins(x=0.0)
    return figure


def _hand(axes: Axes, record: Record, kind: Kind, travel_ratio: float | None) -> None:
    """The hand on an axis of its own at the right, and one legend for both."""
    twin = axes.twinx()
    if travel_ratio is None:
        values, label = record.hand, f"hand ({unit_text('torque', kind)})"
    else:
        values, label = record.hand / travel_ratio, "hand (N)"
    twin.plot(record.time, values, color=_HAND, lw=1.0, alpha=0.9, label=label)
    bound = 1.15 * max(float(np.max(np.abs(values))), 1e-9)
    twin.set_ylim(-bound, bound)
    twin.set_ylabel(label, color=_HAND)
    lines = [*axes.get_lines(), *twin.get_lines()]
    axes.legend(
        lines,
        [str(line.get_label()) for line in lines],
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(lines),
        frameon=False,
        fontsize=8,
    )
