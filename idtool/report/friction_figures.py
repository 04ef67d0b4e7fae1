"""The friction level over speed, in both directions (paper Fig. 6)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from idtool.model.units import Units
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@style.styled
def stribeck_figure(
    velocity: ArrayLike,
    torque: ArrayLike,
    *,
    kind: Units = "rotary",
    stderr: ArrayLike | None = None,
    steady: ArrayLike | None = None,
    curve_velocity: ArrayLike = (),
    curve_torque: ArrayLike = (),
    low: ArrayLike = (),
    high: ArrayLike = (),
) -> Figure:
    """Measured friction with its error bars, the fitted curve and its 95 % band.

    The upper panel shows it as it is, the lower one folds both directions onto each other, which shows
    the Stribeck dip and any difference between the directions.

    Args:
        velocity, torque: one entry per constant-speed window, rad/s and N m (m/s and N), signed.
        stderr: standard error of each torque.
        steady: False where a window was not steady (left out of the fit, drawn hollow).
        curve_velocity, curve_torque, low, high: fitted curve and band; any may be empty.
    """
    points = _Points(velocity, torque, stderr, steady)
    curve = _Curve(curve_velocity, curve_torque, low, high)
    figure, (signed, folded) = style.panels(2, height=5.9, gap=(0.3, 0.82))
    style.title(figure, "Friction against speed, both directions")

    for part in curve.parts():
        curve.draw(signed, part, style.AFTER, fold=False)
    points.draw(signed, np.ones(len(points.velocity), dtype=bool), style.MEASURED, "measured", fold=False)
    signed.axhline(0.0, color=style.FAINT, lw=0.8)
    signed.axvline(0.0, color=style.FAINT, lw=0.8)
    friction = style.torque_label(kind, "friction")
    signed.set(xlabel=style.axis_label("Velocity", "velocity", kind), ylabel=friction)
    style.legend(figure, signed)

    for sign, name, colour in ((1.0, "forward", style.AFTER), (-1.0, "backward", style.BEFORE)):
        for part in curve.parts():
            if sign * curve.velocity[part][-1] + sign * curve.velocity[part][0] > 0:
                curve.draw(folded, part, colour, fold=True)
        points.draw(folded, np.sign(points.velocity) == sign, colour, name, fold=True)
    folded.set_xlim(left=0.0)
    folded.set(xlabel=style.axis_label("Speed", "velocity", kind), ylabel=friction)
    folded.set_title("folded: size of the friction, per direction")
    if len(points.velocity):
        folded.legend(loc="best")
    return figure


class _Points:
    def __init__(
        self, velocity: ArrayLike, torque: ArrayLike, stderr: ArrayLike | None, steady: ArrayLike | None
    ) -> None:
        self.velocity, self.torque = np.asarray(velocity, dtype=float), np.asarray(torque, dtype=float)
        count = len(self.velocity)
        error = np.zeros(count) if stderr is None else np.asarray(stderr, dtype=float)
        self.error = np.where(np.isfinite(error), 1.96 * error, 0.0)
        self.steady = np.ones(count, dtype=bool) if steady is None else np.asarray(steady, dtype=bool)

    def draw(self, axes: Axes, which: NDArray[np.bool_], colour: str, label: str, *, fold: bool) -> None:
        sign = np.sign(self.velocity) if fold else 1.0
        x, y = self.velocity * sign, self.torque * sign
        for chosen, face, name in (
            (which & self.steady, colour, label),
            (which & ~self.steady, "white", f"{label}, not steady"),
        ):
            if np.any(chosen):
                look = style.points(colour) | {"mfc": face, "label": name}
                axes.errorbar(x[chosen], y[chosen], self.error[chosen], **look)


class _Curve:
    def __init__(self, velocity: ArrayLike, torque: ArrayLike, low: ArrayLike, high: ArrayLike) -> None:
        raw = np.asarray(velocity, dtype=float)
        order = np.argsort(raw, kind="stable")
        self.velocity = raw[order]
        self.torque = np.asarray(torque, dtype=float)[order]
        band = [np.asarray(edge, dtype=float) for edge in (low, high)]
        self.band = (band[0][order], band[1][order]) if all(len(edge) == len(raw) for edge in band) else None

    def parts(self) -> list[NDArray[np.intp]]:
        """Rows below and above standstill: friction jumps there, and no line should cross the jump."""
        halves = (np.flatnonzero(self.velocity < 0), np.flatnonzero(self.velocity > 0))
        return [half for half in halves if len(half)]

    def draw(self, axes: Axes, part: NDArray[np.intp], colour: str, *, fold: bool) -> None:
        sign = float(np.sign(self.velocity[part][-1])) if fold else 1.0
        first = not any(line.get_label() == "fitted curve" for line in axes.get_lines())
        if self.band is not None:
            edges = (self.band[0][part] * sign, self.band[1][part] * sign)
            label = "95 % band" if first and not fold else None
            axes.fill_between(self.velocity[part] * sign, *edges, color=colour, alpha=0.18, lw=0, label=label)
        label = "fitted curve" if first and not fold else None
        # dashed backward, so that two equal directions both show
        dashes = (0, (5, 3)) if sign < 0 else "-"
        axes.plot(self.velocity[part] * sign, self.torque[part] * sign, color=colour, ls=dashes, label=label)
