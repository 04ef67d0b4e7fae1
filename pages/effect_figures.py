"""One small picture for each effect: the residual without it in the model, and with it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.presentation import style
from pages.effect_cases import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DPI = 110
_COLOURS = 48
_BINS = 48
_LEAST_IN_BIN = 8
#: Enough dots to show the spread, few enough for a small file.
_DOTS = 700
#: A line is averaged over so many rows: enough to see it through the noise of the current.
_AVERAGED = 5


def draw(path: Path, title: str, view: View, without: JointFit, with_it: JointFit) -> None:
    """Write the picture.

    Args:
        path: where it goes, PNG.
        title: the effect.
        view: what the residual is drawn over.
        without, with_it: fits of the same recording.
    """
    rows = _rows(view, without)
    motion = without.model.recording.motion
    x = view.of(motion)[rows]
    if view.between is not None:
        inside = (x >= view.between[0]) & (x <= view.between[1])
        rows, x = rows[inside], x[inside]
    turn = np.sign(motion.velocity[rows]) if view.way == "friction" else np.ones(len(rows))
    residuals = [1e3 * turn * fit.full_residual[rows] for fit in (without, with_it)]
    parts = [np.ones(len(rows), dtype=bool)]
    if view.parts is not None:
        first = view.parts(motion)[rows]
        parts = [first, ~first]
    with style.look():
        figure, axes = style.panels(
            1, 2, width=7.6, height=2.7, left=0.62, top=0.62, bottom=0.5, gap=(0.2, 0.2), share="xy"
        )
        style.title(figure, title)
        for panel, residual, word, colour in zip(
            axes, residuals, ("without it", "with it"), (style.BEFORE, style.AFTER), strict=True
        ):
            _panel(panel, view, x, residual, parts, colour)
            error = float(np.sqrt(np.mean(residual**2)))
            panel.set_title(f"{word}: {error:.1f} mN m", color=colour)
            panel.set_xlabel(view.label)
            panel.axhline(0.0, color=style.MEASURED, linewidth=0.8)
        axes[0].set_ylabel("residual × direction, mN m" if view.way == "friction" else "residual, mN m")
        high = max(_reach(view, x, residual, parts) for residual in residuals)
        axes[0].set_ylim(-high, high)
        if view.parts is not None:
            axes[1].legend(loc="best", fontsize=8.5)
        path.write_bytes(style.few_colours(style.render(figure, "png", _DPI), _COLOURS))


def _rows(view: View, fit: JointFit) -> NDArray[np.intp]:
    recording = fit.model.recording
    motion = recording.motion
    trials = [k for k, name in enumerate(recording.experiment) if view.experiment in ("", name)]
    if view.trial is not None:
        trials = [trials[view.trial]]
    wanted = np.isin(motion.trial, trials) & (np.abs(motion.velocity) >= view.least_speed)
    return np.flatnonzero(wanted & recording.usable)


def _panel(
    axes: Axes, view: View, x: Array, y: Array, parts: Sequence[NDArray[np.bool_]], colour: str
) -> None:
    if view.way == "line":
        kernel = np.full(_AVERAGED, 1.0 / _AVERAGED)
        axes.plot(x, np.convolve(y, kernel, "same"), color=colour, linewidth=0.9)
        return
    some = style.thin(len(x), _DOTS)
    axes.plot(x[some], y[some], ".", color=style.UNDER, markersize=1.8, zorder=1)
    for part, mark, face, label in zip(parts, "os", (colour, "white"), view.part_names, strict=False):
        axes.plot(
            *means(x[part], y[part]), mark, color=colour, markerfacecolor=face, markersize=3.8, label=label
        )


def _reach(view: View, x: Array, y: Array, parts: Sequence[NDArray[np.bool_]]) -> float:
    """Half the height of the panels: the means fill it; of the dots, nearly all if these are not weak."""
    dots = float(np.quantile(np.abs(y), 0.985))
    if view.way == "line":
        return dots
    return max(0.45 * dots, *(1.35 * float(np.max(np.abs(means(x[p], y[p])[1]))) for p in parts))


def means(x: Array, y: Array) -> tuple[Array, Array]:
    """Mean of y in equal parts of x, and where they are; parts with hardly a row are left out."""
    edges = np.linspace(float(np.min(x)), float(np.max(x)) + 1e-12, _BINS + 1)
    index = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, _BINS - 1)
    count = np.bincount(index, minlength=_BINS)
    full = count >= _LEAST_IN_BIN
    centre = np.bincount(index, weights=x, minlength=_BINS)[full] / count[full]
    return centre, np.bincount(index, weights=y, minlength=_BINS)[full] / count[full]
