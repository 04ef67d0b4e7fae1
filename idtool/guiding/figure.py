"""The picture of a hand-guiding run, after the paper's Figures 10 and 11, in the look of the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from idtool.guiding.record import Record
from idtool.model.motion import Array
from idtool.model.units import Kind
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Below and above zero there is at least this share of what the left axis spans, for the hand to be seen in.
_EDGE = 0.3


@style.styled
def draw(record: Record, *, kind: Kind = "rotary", travel_ratio: float | None = None) -> Figure:
    """Two panels over time: measured, modelled and estimated torque; travel. The hand, where it is
    known, on an axis of its own at the right, its zero beside the other one's.

    Args:
        record: the run.
        kind: of axis, for the units.
        travel_ratio: m of travel per rad: then the hand is drawn in N and the travel in mm.

    Returns:
        A figure that belongs to no window; `savefig` writes it.
    """
    figure, (upper, lower) = style.panels(
        2, 1, width=1.5 * style.WIDTH, height=6.2, right=0.85, gap=(0.3, 0.25), share="x"
    )
    style.title(figure, "Hand guiding")
    upper.plot(record.time, record.motor, color=style.UNDER, lw=0.9, label="motor, K i")
    upper.plot(record.time, record.compensated, color=style.AFTER, lw=1.2, label="model")
    upper.plot(record.time, record.estimated, color=style.THIRD, lw=1.2, label="hand, estimated")
    upper.set_ylabel(style.torque_label(kind))
    place = record.position - record.position[0]
    if travel_ratio is None:
        lower.plot(record.time, place, color=style.AFTER, lw=1.4)
        lower.set_ylabel(style.axis_label("Travel", "position", kind))
    else:
        lower.plot(record.time, 1e3 * travel_ratio * place, color=style.AFTER, lw=1.4)
        lower.set_ylabel("Stroke, mm")
    lower.set_xlabel("Time, s")
    for panel in (upper, lower):
        panel.axhline(0.0, color=style.UNDER, lw=0.6, zorder=0)
        panel.margins(x=0.0)
    if np.any(record.hand != 0.0):  # of a real hand nobody knows the force
        ratio, label = (
            (1.0, style.torque_label(kind, "hand")) if travel_ratio is None else (travel_ratio, "Hand, N")
        )
        for panel in (upper, lower):
            _beside(panel, record.time, record.hand / ratio, label)
        upper.plot([], [], color=style.BEFORE, lw=1.0, label="hand")
    style.legend(figure, upper)
    return figure


def _beside(panel: Axes, time: Array, values: Array, label: str) -> None:
    """Values on an axis of their own at the right, zero at the height of the left one's."""
    low, high = panel.get_ylim()
    span = high - low
    low, high = min(low, -_EDGE * span), max(high, _EDGE * span)
    panel.set_ylim(low, high)
    zero = -low / (high - low)
    need = 1.1 * max(float(values.max()) / (1.0 - zero), -float(values.min()) / zero, 1e-9)
    right = panel.twinx()
    right.plot(time, values, color=style.BEFORE, lw=1.0)
    right.set_ylim(-zero * need, (1.0 - zero) * need)
    right.set_ylabel(label, color=style.BEFORE)
    right.spines["right"].set_visible(True)
    right.grid(visible=False)
