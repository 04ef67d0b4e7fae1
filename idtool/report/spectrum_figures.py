"""Autocorrelation and spectrum of the residual: over lags, time and over the angle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from idtool.model.motion import Array
from idtool.model.units import Units, unit_text
from idtool.presentation import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from idtool.report.facts import CumulativePeriodogram


@style.styled
def autocorrelation_figure(step: float, before: Array, after: Array, *, rows: int) -> Figure:
    """Correlation of the residual with itself, lags up.

    Args:
        step: time between lags, s.
        before, after: correlation at lags 0, 1, ...
        rows: number of rows behind them, for the band that white noise keeps within.
    """
    figure, (panel,) = style.panels(height=3.5)
    style.title(figure, "Autocorrelation of the residual")
    bound = 1.96 / np.sqrt(max(rows, 1))
    panel.axhspan(-bound, bound, color=style.SHADE, lw=0, label="white noise, 95 %")
    panel.axhline(0.0, color=style.FAINT, lw=0.9)
    for values, (colour, name) in zip((before, after), style.PAIR, strict=True):
        panel.plot(step * np.arange(len(values)), values, color=colour, label=name)
    lowest = min(-0.25, float(np.min(before)), float(np.min(after))) - 0.05
    panel.set(xlim=(0.0, step * max(len(before) - 1, 1)), ylim=(lowest, 1.03))
    panel.set(xlabel="Lag, s", ylabel="Autocorrelation")
    style.legend(figure, panel)
    return figure


@style.styled
def periodogram_figure(frequency: Array, before: Array, after: Array, *, kind: Units = "rotary") -> Figure:
    """Power of the residual over frequency in time, log axes."""
    figure, (panel,) = style.panels(height=3.5, left=0.95)
    style.title(figure, "Spectrum of the residual in time")
    for values, (colour, name) in zip((before, after), style.PAIR, strict=True):
        panel.loglog(frequency, np.maximum(values, 1e-30), color=colour, lw=1.0, label=name)
    top = max(float(np.max(before)), float(np.max(after)))
    floor = max(float(np.quantile(np.maximum(after, 1e-30), 0.05)), 1e-7 * top)
    panel.set(xlim=(float(frequency[0]), float(frequency[-1])), ylim=(0.3 * floor, 3.0 * top))
    for axis in (panel.xaxis, panel.yaxis):
        style.powers_of_ten(axis)
    panel.set(xlabel="Frequency, Hz", ylabel=f"Power density, ({unit_text('torque', kind)})²/Hz")
    style.legend(figure, panel)
    return figure


@style.styled
def cumulative_figure(
    before: Sequence[CumulativePeriodogram], after: Sequence[CumulativePeriodogram]
) -> Figure:
    """Cumulative periodograms, a panel for time and one for the angle, with the band of noise."""
    figure, panels = style.panels(height=3.6, columns=len(after), gap=(0.55, 0.3))
    style.title(figure, "Does the power add up as that of noise?")
    for panel, old, new in zip(panels, before, after, strict=True):
        white, low = np.array(new.white), np.array(new.frequency)
        band = panel.fill_between(low, white - new.band, white + new.band, color=style.SHADE, lw=0)
        band.set_label("noise alone, 95 %")
        for curve, (colour, name) in zip((old, new), style.PAIR, strict=True):
            panel.plot(curve.frequency, curve.power, color=colour, label=name)
        panel.set(xlim=(0.0, 1.0), ylim=(-0.03, 1.03), xlabel=f"Frequency in {new.over} / highest")
    panels[0].set_ylabel("Share of the power below it")
    style.legend(figure, panels[0])
    return figure


@style.styled
def angle_spectrum_figure(
    frequency: Array, before: Array, after: Array, *, kind: Units = "rotary", found: Sequence[float] = ()
) -> Figure:
    """Amplitude of the residual over spatial frequency: what repeats with the angle stands out.

    Args:
        frequency: waves per turn (per metre).
        before, after: amplitudes, N m (N).
        found: spatial frequencies of an accepted ripple, marked.
    """
    figure, (panel,) = style.panels(height=3.5)
    style.title(figure, f"Spectrum of the residual over {'travel' if kind == 'linear' else 'angle'}")
    for index, line in enumerate(n for n in found if frequency[0] <= n <= frequency[-1]):
        label = "identified ripple" if index == 0 else None
        panel.axvline(line, color=style.THIRD, lw=5.0, alpha=0.3, label=label)
    for values, (colour, name) in zip((before, after), style.PAIR, strict=True):
        panel.plot(frequency, values, color=colour, lw=1.1, label=name)
    panel.set_xlim(float(frequency[0]), float(frequency[-1]))
    panel.set_ylim(bottom=0.0)
    waves = f"Spatial frequency, waves per {'metre' if kind == 'linear' else 'turn'}"
    panel.set(xlabel=waves, ylabel=f"Amplitude, {unit_text('torque', kind)}")
    style.legend(figure, panel)
    return figure
