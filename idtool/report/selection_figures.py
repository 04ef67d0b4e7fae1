"""How sure the result is: how the parameters correlate, and which effects were weighed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from idtool.model.motion import Array
from idtool.model.units import Units, torque_name, unit_text
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Numbers are written into the cells of the heat map up to this many parameters.
_MOST_NUMBERS = 12
_LETTER = 0.082  # inches that a letter of 9 points takes, about


@style.styled
def correlation_figure(names: Sequence[str], matrix: Array) -> Figure:
    """Correlation of the parameter estimates as a heat map, with the numbers where they fit."""
    count = len(names)
    margin = 0.35 + _LETTER * min(max(len(name) for name in names), 34)
    side = min(max(0.36 * count, 2.2), style.WIDTH - margin - 1.0)
    below = 0.25 + 0.75 * _LETTER * min(max(len(name) for name in names), 34)
    figure, (panel,) = style.panels(
        height=side + 0.55 + below, left=margin, right=style.WIDTH - margin - side, top=0.55, bottom=below
    )
    style.title(figure, "Correlation of the parameters")
    panel.grid(False)
    image = panel.imshow(matrix, cmap="RdBu", vmin=-1.0, vmax=1.0, aspect="auto")
    shown = [name if len(name) <= 34 else name[:32] + "…" for name in names]
    panel.set_xticks(range(count), shown, rotation=48, ha="right", rotation_mode="anchor")
    panel.set_yticks(range(count), shown)
    panel.spines[:].set_visible(False)
    panel.tick_params(length=0)
    if count <= _MOST_NUMBERS:
        for row in range(count):
            for column in range(count):
                value = float(matrix[row, column])
                if row != column and abs(value) >= 0.095:
                    colour = "white" if abs(value) > 0.6 else "#24292f"
                    text = f"{value:.1f}".replace("0.", ".").replace("-", "−")
                    panel.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
    left = (margin + side + 0.18) / style.WIDTH
    scale = figure.add_axes((left, panel.get_position().y0, 0.14 / style.WIDTH, panel.get_position().height))
    figure.colorbar(image, cax=scale, ticks=[-1, -0.5, 0, 0.5, 1])
    scale.grid(False)
    return figure


@style.styled
def stiffness_figure(
    sigma0: Array, rmse: Array, *, best: float | None = None, kind: Units = "rotary"
) -> Figure:
    """Error of the fit along the bristle stiffness (log axis), everything else fitted at each point."""
    figure, (panel,) = style.panels(height=3.5)
    style.title(figure, "How sharply the data determine the bristle stiffness")
    order = np.argsort(sigma0)
    panel.semilogx(sigma0[order], rmse[order], color=style.AFTER, marker="o", ms=3, label="error of the fit")
    if best is not None:
        label = f"σ0 = {best:.3g} {unit_text('stiffness', kind)}"
        panel.axvline(best, color=style.BEFORE, lw=1.4, ls=(0, (4, 2)), label=label)
    style.powers_of_ten(panel.xaxis)
    error = f"Rms {torque_name(kind)} error, {unit_text('torque', kind)}"
    panel.set(xlabel=f"Bristle stiffness σ0, {unit_text('stiffness', kind)}", ylabel=error)
    style.legend(figure, panel)
    return figure


@style.styled
def candidates_figure(
    names: Sequence[str],
    held_out: Array,
    accepted: Sequence[bool],
    *,
    base: float | None = None,
    noise_floor: float | None = None,
    kind: Units = "rotary",
) -> Figure:
    """Held-out error that each candidate effect leads to, lowest on top.

    Args:
        names: of the effects.
        held_out: error on held-out trials with that effect, N m (N).
        accepted: whether it was taken.
        base: the base model's error.
        noise_floor: error that measurement noise alone would leave.
    """
    order = np.argsort(held_out)[::-1]
    margin = 0.3 + _LETTER * max(len(name) for name in names)
    figure, (panel,) = style.panels(height=1.45 + 0.27 * len(names), left=min(margin, 3.0), top=0.8)
    style.title(figure, "Held-out error with each candidate effect")
    kinds = ((True, style.AFTER, "accepted"), (False, "#b9c0c9", "rejected"))
    for taken, colour, label in kinds:
        rows = [place for place, index in enumerate(order) if bool(accepted[index]) is taken]
        if rows:
            panel.barh(rows, held_out[order][rows], height=0.66, color=colour, label=label)
    panel.set_yticks(range(len(names)), [names[index] for index in order])
    panel.tick_params(axis="y", length=0)
    panel.grid(False, axis="y")
    if base is not None:
        panel.axvline(base, color=style.BEFORE, lw=1.4, label="base model")
    if noise_floor is not None:
        panel.axvline(noise_floor, color=style.MEASURED, lw=1.2, ls=(0, (4, 2)), label="noise floor")
    panel.margins(x=0.06)
    panel.locator_params(axis="x", nbins=6)
    panel.set_xlabel(f"Rms {torque_name(kind)} error on held-out trials, {unit_text('torque', kind)}")
    style.legend(figure, panel)
    return figure
