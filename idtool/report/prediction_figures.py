"""Measured and predicted torque over time, on trials that the fit did not see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from idtool.model.motion import Array
from idtool.model.units import Units, torque_name
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Trace:
    """One stretch of time: seconds since its start and torques, (rows,) each; `before` of the base model, if
    that is another."""

    label: str
    time: Array
    measured: Array
    after: Array
    before: Array | None = None


@style.styled
def prediction_figure(traces: Sequence[Trace], *, kind: Units = "rotary", held_out: bool = True) -> Figure:
    """Measured torque with what the base and the extended model predict, a panel per trace."""
    height = 1.4 + 1.9 * len(traces)
    figure, axes = style.panels(len(traces), width=style.WIDE, height=height, gap=(0.3, 0.56), top=0.88)
    where = "on trials the fit did not see" if held_out else "on the trials of the fit"
    style.title(figure, f"Measured and predicted {torque_name(kind)} {where}")
    for panel, trace in zip(axes, traces, strict=True):
        every = style.thin(len(trace.time), 2500)
        time = trace.time[every]
        panel.plot(time, trace.measured[every], color=style.UNDER, lw=4.2, label="measured")
        name = "model"
        if trace.before is not None:
            name = "extended model"
            panel.plot(time, trace.before[every], color=style.BEFORE, lw=1.1, label="base model")
        panel.plot(time, trace.after[every], color=style.AFTER, lw=1.1, label=name)
        panel.set(title=trace.label, ylabel=style.torque_label(kind))
        panel.margins(x=0.01)
    axes[-1].set_xlabel("Time since the start of the trial, s")
    style.legend(figure, axes[0])
    figure.align_ylabels()
    return figure
