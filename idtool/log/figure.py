"""A first look at a log, before any fit."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from idtool.log.format import columns_of
from idtool.model.motion import Array
from idtool.presentation import style
from idtool.presentation.text import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from idtool.log.log import Log

#: What stands for the effort (the first of them that was logged), and its unit where it is no torque.
_EFFORTS = {"torque": "", "current": "A", "bus_current": "A", "duty": ""}
_HEIGHT = 1.7  # inches a panel


@style.styled
def log_figure(log: Log) -> Figure:
    """Position, speed and effort over time, one colour a trial, and effort over speed beside them.

    A log that lacks one of them lacks its panel.

    Args:
        log: at least one row.
    """
    shown = [
        (name, values)
        for name in ("position", "velocity", *_EFFORTS)
        if (values := _column(log, name)) is not None
    ]
    efforts = [name for name, _ in shown if name in _EFFORTS]
    shown = [(name, values) for name, values in shown if name not in efforts[1:]]
    time = log.values_of("time_s")
    rows = len(shown)
    figure, panels = style.panels(
        rows, 2, width=style.WIDE, height=1.1 + _HEIGHT * rows, top=0.5, gap=(0.85, 0.55)
    )
    trials = counted(log.trial_of_rows[-1] + 1, "trial")
    style.title(figure, f"{Path(log.source).name}: {log.row_count} rows, {trials}")
    over_time, beside = panels[::2], panels[1::2]
    for panel, (name, values) in zip(over_time, shown, strict=True):
        _over_time(panel, log, time, values)
        panel.set_ylabel(_label(log, name))
        panel.sharex(over_time[0])
        panel.tick_params(labelbottom=panel is over_time[-1])
    over_time[-1].set_xlabel("Time, s")
    _effort_over(beside, log, dict(shown), efforts[0] if efforts else None)
    return figure


def _column(log: Log, role: str) -> Array | None:
    return log.column(role) if role in columns_of(log.axis.kind) else None


def _label(log: Log, role: str) -> str:
    kind = log.axis.kind
    if role == "torque":
        return style.torque_label(kind)
    name = "Speed" if role == "velocity" else role.capitalize().replace("_", " ")
    if role in _EFFORTS:
        return f"{name}, {_EFFORTS[role]}".removesuffix(", ")
    return style.axis_label(name, role, kind)


def _over_time(panel: Axes, log: Log, time: Array, values: Array) -> None:
    """One line a trial, two colours in turn, so that where one ends is seen."""
    trial = log.trial_of_rows
    edges = [0, *(np.flatnonzero(np.diff(trial)) + 1).tolist(), len(trial)]
    step = style.thin(len(trial), 20 * style.MOST_MARKERS).step
    for k, (start, stop) in enumerate(pairwise(edges)):
        rows = slice(start, stop, step)
        panel.plot(time[rows], values[rows], color=(style.AFTER, style.BEFORE)[k % 2], lw=0.8)


def _effort_over(panels: list[Axes], log: Log, shown: dict[str, Array], effort: str | None) -> None:
    """Effort over speed and over position, a point a row; panels that stay empty are hidden."""
    left = list(panels)
    if effort is not None:
        for role in ("velocity", "position"):
            if role in shown:
                panel = left.pop(0)
                rows = style.thin(len(shown[role]))
                panel.plot(
                    shown[role][rows], shown[effort][rows], ".", ms=2.5, color=style.MEASURED, alpha=0.5
                )
                panel.set_ylabel(_label(log, effort))
                panel.set_xlabel(_label(log, role))
    for panel in left:
        panel.set_visible(False)
