"""What the model leaves over, before and after the effects: over time, against anything, as a whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from idtool.model.motion import Array
from idtool.model.units import Units, torque_name, unit_text
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Points of a mean that is drawn through a cloud: as many as an eye follows as one line.
_BINS = 26
#: More changes of experiment than this are a fence, not a help.
_MOST_PARTS = 16
#: Enough over the position to show a ripple of a dozen periods.
_FINE_BINS = 80
#: A mean of fewer rows is mostly their noise.
_LEAST_IN_BIN = 8


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def binned_mean(x: Array, y: Array, most: int = _BINS) -> tuple[Array, Array]:
    """Mean of y at each value of x (few values, such as payloads) or in up to `most` equal bins of x."""
    values = np.unique(x)
    bins = min(max(len(x) // 100, 12), most)
    if len(values) <= _BINS:
        index = np.searchsorted(values, x)
        count = np.bincount(index, minlength=len(values))
        return values, np.bincount(index, weights=y, minlength=len(values)) / np.maximum(count, 1)
    edges = np.linspace(values[0], values[-1], bins + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1)
    count = np.bincount(index, minlength=bins)
    full = count >= _LEAST_IN_BIN
    mean = np.bincount(index, weights=y, minlength=bins)[full] / count[full]
    centre = np.bincount(index, weights=x, minlength=bins)[full] / count[full]
    return centre, mean


def _limit(*residuals: Array) -> float:
    """Half the height of a panel: nearly all rows, but not the last outlier."""
    return 1.15 * max((float(np.quantile(np.abs(values), 0.998)) for values in residuals), default=0.0) or 1.0


def _residual_label(kind: Units) -> str:
    return f"Residual, {unit_text('torque', kind)}"


@style.styled
def residual_time_figure(
    clock: Array,
    before: Array,
    after: Array,
    *,
    kind: Units = "rotary",
    spans: Sequence[tuple[float, float]] = (),
    parts: Sequence[tuple[float, float, str]] = (),
    breaks: Sequence[int] = (),
) -> Figure:
    """Residual over the session, base model above and extended model below, on one scale.

    Args:
        clock: s, rising over all rows, shape (rows,).
        before, after: residuals, N m (N), shape (rows,).
        spans: start and end of what was held out, s.
        parts: start, end and name of each experiment, s.
        breaks: first row of each trial; no line is drawn across.
    """
    figure, axes = style.panels(2, width=style.WIDE, height=4.3, gap=(0.3, 0.2), top=0.72, share="xy")
    style.title(figure, "Residual over the session")
    gaps = np.asarray([row for row in breaks if row > 0], dtype=int)
    time = np.insert(clock, gaps, clock[gaps])
    limit = _limit(before, after)
    for panel, values, (colour, name) in zip(axes, (before, after), style.PAIR, strict=True):
        for index, (start, end) in enumerate(spans):
            label = "held out" if index == 0 and panel is axes[0] else None
            panel.axvspan(start, end, color=style.SHADE, lw=0, label=label)
        cut = np.insert(values, gaps, np.nan)
        panel.plot(time, cut, color=colour, lw=0.6, label=name, rasterized=True)
        panel.set_ylabel(_residual_label(kind))
        for start, _, _ in parts[1:] if len(parts) <= _MOST_PARTS else ():
            panel.axvline(start, color=style.FAINT, lw=0.8, ls=(0, (2, 2)))
    axes[0].set(xlim=(float(clock[0]), float(clock[-1])), ylim=(-limit, limit))
    whole = float(clock[-1] - clock[0]) or 1.0
    for start, end, name in parts:
        if (end - start) / whole > 0.012 * len(name):  # a name that would run into the next one is left out
            axes[0].annotate(
                name, (start, limit), (3, 2), textcoords="offset points", size=9, color="#6b727b", va="bottom"
            )
    axes[-1].set_xlabel("Time in the session, s")
    corner = (0.985, 1 - 0.13 / 4.3)
    figure.legend(loc="upper right", ncols=3, borderaxespad=0.0, bbox_to_anchor=corner)
    return figure


@style.styled
def residual_against_figure(
    x: Array,
    before: Array,
    after: Array,
    *,
    label: str,
    what: str,
    kind: Units = "rotary",
    fine: bool = False,
) -> Figure:
    """Residual against one quantity, base model left and extended model right, with its mean.

    Args:
        x: the quantity, shape (rows,); rows where it is not finite are left out.
        before, after: residuals, N m (N), shape (rows,).
        label: of the horizontal axis, with its unit.
        what: the quantity in the headline ("position").
        fine: many bins for the mean, where it may wave.
    """
    there = np.isfinite(x)
    x, before, after = x[there], before[there], after[there]
    figure, axes = style.panels(1, 2, height=3.15, gap=(0.3, 0.3), top=0.72, share="y")
    style.title(figure, f"Residual against {what}")
    every = style.thin(len(x))
    for panel, values, (colour, name) in zip(axes, (before, after), style.PAIR, strict=True):
        panel.plot(x[every], values[every], ".", ms=3.2, mew=0, color=colour, alpha=0.28, rasterized=True)
        panel.axhline(0.0, color=style.FAINT, lw=0.9)
        panel.plot(*binned_mean(x, values, _FINE_BINS if fine else _BINS), color="#16191d", lw=1.6)
        panel.set(title=name, xlabel=label)
    limit = _limit(before, after)
    axes[0].set(ylim=(-limit, limit), ylabel=_residual_label(kind))
    return figure


@style.styled
def histogram_figure(before: Array, after: Array, *, kind: Units = "rotary") -> Figure:
    """How large the residuals are, with the normal curve of the extended model's spread."""
    figure, (panel,) = style.panels(height=3.5)
    style.title(figure, f"How far the predicted {torque_name(kind)} is off")
    limit = _limit(before, after)
    edges = np.linspace(-limit, limit, 121)
    for values, (colour, name) in zip((before, after), style.PAIR, strict=True):
        density, _ = np.histogram(np.clip(values, -limit, limit), edges, density=True)
        panel.stairs(density, edges, fill=True, color=colour, alpha=0.22)
        panel.stairs(density, edges, color=colour, lw=1.4, label=name)
    spread, mean = float(np.std(after)), float(np.mean(after))
    if spread > 0:
        x = np.linspace(-limit, limit, 300)
        normal = np.exp(-0.5 * ((x - mean) / spread) ** 2) / (spread * np.sqrt(2.0 * np.pi))
        panel.plot(x, normal, color=style.MEASURED, lw=1.1, ls=(0, (4, 2)), label="normal, same spread")
    unit = unit_text("torque", kind)
    density_label = f"Density, 1/({unit})" if " " in unit else f"Density, 1/{unit}"
    panel.set(xlim=(-limit, limit), xlabel=_residual_label(kind), ylabel=density_label)
    style.legend(figure, panel)
    return figure
