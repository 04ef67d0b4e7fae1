"""An accepted effect in these data, and beside it the picture of its page in docs/effects/.

Small files of few colours: two for each effect, so that the page does not grow with them.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from idtool.effects.base import Effect
from idtool.model.motion import Array, since_reversal
from idtool.presentation.html import embedded
from idtool.presentation.style import axis_label, few_colours, render
from idtool.report.evidence import Evidence
from idtool.report.residual_figures import residual_against_figure

#: Small pictures inside a page; few colours keep them small.
_DPI = 100
_COLOURS = 48
#: What shows after a reversal is over after so many times the effect's own length.
_LENGTHS = 3.0
_TRAVEL = "travel since the last reversal"
#: Over these the mean may wave, so that it needs many bins.
_WAVY = ("position", "time", _TRAVEL)
#: What the effects follow -> the column of the evidence and its dimension.
_OVER = {
    "position": ("position", "position"),
    "velocity": ("velocity", "velocity"),
    "direction": ("velocity", "velocity"),
    "acceleration": ("acceleration", "acceleration"),
    "load": ("load", "torque"),
    "temperature": ("temperature", "temperature"),
    "time": ("time", "time"),
}


@dataclass(frozen=True)
class Beside:
    """A picture of a card: data address, size in pixels, what it is."""

    address: str
    width: int
    height: int
    caption: str


def found_picture(evidence: Evidence, effect: Effect) -> Beside | None:
    """The residual before and after over what the effect follows; None where that was not logged."""
    rows = evidence.rows
    sign = np.ones(len(rows.velocity))
    if effect.after_reversal and rows.position is not None:
        x = _near(evidence, effect, since_reversal(rows.position, rows.velocity, rows.trial))
        sign = np.sign(rows.velocity)
        what, dimension = _TRAVEL, "position"
    else:
        there = (_OVER[name] for name in effect.follows if name in _OVER)
        column, dimension = next((one for one in there if getattr(rows, one[0]) is not None), ("", ""))
        if not column:
            return None
        x, what = rows.clock if column == "time" else getattr(rows, column), column
    if np.count_nonzero(np.isfinite(x)) < 2:
        return None
    figure = residual_against_figure(
        x,
        rows.residual_before * sign,
        rows.residual_after * sign,
        label=axis_label(what.capitalize(), dimension, evidence.kind),
        what=what,
        fine=what in _WAVY,
        kind=evidence.kind,
    )
    turned = ", turned so that what brakes points one way" if effect.after_reversal else ""
    return _beside(
        few_colours(render(figure, "png", _DPI), _COLOURS),
        f"In these data: what the base model and the extended model leave over the {what}{turned}.",
    )


def typical_picture(effect: Effect) -> Beside | None:
    """The picture that comes with the effect's page; None for an effect of another package."""
    picture = files("idtool.data") / "effects" / f"{effect.name}.png"
    if not picture.is_file():
        return None
    return _beside(picture.read_bytes(), f"How {effect.title.lower()} looks on a simulated axis.")


def _near(evidence: Evidence, effect: Effect, travel: Array) -> Array:
    """The travel, NaN where an effect that has a length, as a gap has, is long over."""
    entry = evidence.parameters.effect(effect.name)
    names = [one.name for one in effect.parameters if one.dimension == "position"]
    lengths = [entry.parameters[name].value for name in names if entry and name in entry.parameters]
    return np.where(travel <= _LENGTHS * max(lengths, default=np.inf), travel, np.nan)


def _beside(content: bytes, caption: str) -> Beside:
    return Beside(*embedded(content), caption)
