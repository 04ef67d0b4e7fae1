"""The gravity torque over payload (paper Fig. 5) or, for an arm, over angle."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from idtool.model.motion import Array
from idtool.model.units import Units, unit_text
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def average_error(measured: ArrayLike, model: ArrayLike) -> float:
    """Mean of |measured - model| / |model|, in per cent, as the paper states it; NaN if undefined."""
    target = np.asarray(model, dtype=float)
    usable = np.abs(target) > 0
    if not np.any(usable):
        return float("nan")
    error = np.abs(np.asarray(measured, dtype=float) - target)[usable] / np.abs(target)[usable]
    return 100.0 * float(np.mean(error))


@style.styled
def gravity_figure(
    payload: ArrayLike,
    torque: ArrayLike,
    *,
    base: float,
    per_payload: float,
    kind: Units = "rotary",
    stderr: ArrayLike | None = None,
) -> Figure:
    """Measured gravity torque at each payload, the line base + per_payload m, and the difference.

    Args:
        payload: kg, one entry per payload step.
        torque: gravity torque at zero tilt with friction removed, N m (N).
        base, per_payload: the fitted coefficients, N m and N m/kg (N and N/kg).
        stderr: standard error of each torque.
    """
    return _draw(
        payload,
        torque,
        lambda mass: base + per_payload * mass,
        stderr,
        kind,
        title=f"Gravity {'force' if kind == 'linear' else 'torque'} against payload",
        label="Payload, kg",
        model=f"line: {base:.4g} + {per_payload:.4g} · payload",
    )


@style.styled
def arm_figure(
    position: ArrayLike,
    torque: ArrayLike,
    *,
    sin: float,
    cos: float,
    kind: Units = "rotary",
    stderr: ArrayLike | None = None,
) -> Figure:
    """Measured gravity torque over the position of an arm, the fitted curve, and the difference.

    Args:
        position: rad, one entry per measured place.
        torque: gravity torque with friction removed, N m.
        sin, cos: the fitted coefficients, N m.
        stderr: standard error of each torque.
    """
    return _draw(
        position,
        torque,
        lambda q: sin * np.sin(q) + cos * np.cos(q),
        stderr,
        kind,
        title="Gravity torque against position",
        label=style.axis_label("Position", "position", kind),
        model=f"curve: {sin:.4g} sin q + {cos:.4g} cos q",
    )


def _draw(
    places: ArrayLike,
    torque: ArrayLike,
    line: Callable[[Array], Array],
    stderr: ArrayLike | None,
    kind: Units,
    *,
    title: str,
    label: str,
    model: str,
) -> Figure:
    x, measured = np.asarray(places, dtype=float), np.asarray(torque, dtype=float)
    error = np.zeros(len(x)) if stderr is None else 1.96 * np.nan_to_num(np.asarray(stderr, dtype=float))
    figure, (upper, lower) = style.panels(2, height=5.7, gap=(0.3, 0.25), share="x", heights=(2.4, 1))
    style.title(figure, title)
    span = float(np.ptp(x)) or 1.0
    fine = np.linspace(float(x.min()) - 0.03 * span, float(x.max()) + 0.03 * span, 200)
    upper.plot(fine, line(fine), color=style.AFTER, label=model)
    points = style.points(style.MEASURED)
    upper.errorbar(x, measured, error, label="measured, 95 % interval", **points)
    upper.set_ylabel(style.torque_label(kind, "gravity"))
    style.legend(figure, upper)
    lower.axhline(0.0, color=style.AFTER)
    lower.errorbar(x, measured - line(x), error, **points)
    lower.set(xlabel=label, ylabel=f"Difference, {unit_text('torque', kind)}")
    figure.align_ylabels()
    return figure
