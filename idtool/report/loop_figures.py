"""Torque against velocity and against position, one panel per trial (paper Fig. 7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike

from idtool.model.motion import Array
from idtool.model.units import Units, torque_name
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: More panels than this are too small to read.
MOST_PANELS = 4


@dataclass(frozen=True)
class Loop:
    """One trial: what is on the horizontal axis, and the torque measured and predicted, (rows,) each."""

    label: str
    x: Array
    measured: Array
    predicted: Array


def main_frequency(time: ArrayLike, velocity: ArrayLike) -> float | None:
    """The frequency of a sine, Hz; None where the velocity is not one (less than 60 % of it in one line)."""
    clock = np.asarray(time, dtype=float)
    motion = np.asarray(velocity, dtype=float)
    if len(clock) < 16 or clock[-1] <= clock[0]:
        return None
    even = np.linspace(clock[0], clock[-1], len(clock))
    signal = np.interp(even, clock, motion)
    signal = (signal - signal.mean()) * np.hanning(len(signal))
    # padding to four times the length puts the peak's place well below the width of a line
    power = np.abs(np.fft.rfft(signal, 4 * len(signal))) ** 2
    peak = int(np.argmax(power))
    near = power[max(0, peak - 8) : peak + 9]
    if power.sum() <= 0 or near.sum() < 0.6 * power.sum():
        return None
    return _sharpen(peak / (4.0 * len(signal) * float(even[1] - even[0])), clock, motion)


def _sharpen(frequency: float, time: Array, motion: Array) -> float:
    """The frequency near the given one whose sine fits best: few periods bias the peak of a spectrum."""
    tries = frequency * np.linspace(0.85, 1.15, 61)
    errors = []
    for candidate in tries:
        angle = 2.0 * np.pi * candidate * time
        columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones(len(time))])
        error = motion - columns @ np.linalg.lstsq(columns, motion)[0]
        errors.append(float(error @ error))
    return float(tries[int(np.argmin(errors))])


def dynamic_figure(
    trial: ArrayLike,
    velocity: ArrayLike,
    torque: ArrayLike,
    predicted: ArrayLike,
    *,
    kind: Units = "rotary",
    time: ArrayLike | None = None,
) -> Figure:
    """Torque against velocity, measured and predicted, of the first few trials.

    Args:
        trial: number of each row's trial, shape (rows,).
        velocity, torque, predicted: rad/s and N m (m/s and N), shape (rows,) each.
        time: s; where given, panels are named by the frequency of their sine.
    """
    number = np.asarray(trial)
    loops = []
    for one in list(dict.fromkeys(number.tolist()))[:MOST_PANELS]:
        rows = number == one
        speed = np.asarray(velocity, dtype=float)[rows]
        frequency = None if time is None else main_frequency(np.asarray(time, dtype=float)[rows], speed)
        label = f"trial {one}" if frequency is None else f"{frequency:.2g} Hz"
        measured, model = (np.asarray(values, dtype=float)[rows] for values in (torque, predicted))
        loops.append(Loop(label, speed, measured, model))
    return loops_figure(loops, kind=kind)


@style.styled
def loops_figure(
    loops: Sequence[Loop], *, kind: Units = "rotary", against: Literal["velocity", "position"] = "velocity"
) -> Figure:
    """Up to four panels of torque against velocity or position, measured under predicted."""
    shown = list(loops)[:MOST_PANELS]
    columns = 1 if len(shown) == 1 else 2
    rows = -(-len(shown) // columns)
    figure, axes = style.panels(
        rows, columns, height=1.4 + 2.25 * rows, gap=(0.35, 0.55), top=0.88, share="y"
    )
    style.title(figure, f"{torque_name(kind).capitalize()} against {against}, trial by trial")
    for place, (panel, loop) in enumerate(zip(axes, shown, strict=False)):
        # a wide line under a thin one: both stay visible where they agree
        panel.plot(loop.x, loop.measured, color=style.UNDER, lw=4.2, rasterized=True)
        panel.plot(loop.x, loop.predicted, color=style.AFTER, lw=1.0, rasterized=True)
        panel.set_title(loop.label)
        if place % columns == 0:
            panel.set_ylabel(style.torque_label(kind))
        if place >= len(shown) - columns:
            panel.set_xlabel(style.axis_label(against.capitalize(), against, kind))
    for panel in axes[len(shown) :]:
        panel.set_visible(False)
    axes[0].plot([], [], color=style.UNDER, lw=5.0, label="measured")
    axes[0].plot([], [], color=style.AFTER, lw=1.6, label="predicted by the identified model")
    style.legend(figure, axes[0])
    return figure
