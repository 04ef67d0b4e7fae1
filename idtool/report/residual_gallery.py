"""The figures of the residual: against everything that was logged, its autocorrelation and its spectra."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from idtool.model.units import is_linear, radians_per_unit, torque_name, unit_text
from idtool.presentation import text
from idtool.presentation.style import axis_label
from idtool.report import spectra
from idtool.report.evidence import Evidence
from idtool.report.facts import ResidualTest
from idtool.report.gallery import Plate
from idtool.report.residual_figures import (
    histogram_figure,
    residual_against_figure,
    residual_time_figure,
    rms,
)
from idtool.report.spectrum_figures import (
    angle_spectrum_figure,
    autocorrelation_figure,
    cumulative_figure,
    periodogram_figure,
)

#: Below this, a test counts as having found a dependence ...
SIGNIFICANT = 0.01
#: ... unless it explains less of the residual's variance: no picture shows that, however certain it is.
_VISIBLE = 0.01

#: variable -> (dimension, what to look for)
_AGAINST = {
    "position": (
        "position",
        "A wave is ripple, a slope is a spring, and a step where the direction changes is hysteresis.",
    ),
    "velocity": (
        "velocity",
        "A difference between left and right is a matter of direction; a bend, of speed.",
    ),
    "acceleration": ("acceleration", "A slope is inertia that is missing or too much."),
    "load": ("torque", "A fan that opens with the load is friction that grows with it."),
    "payload": ("mass", "A slope is a wrong payload coefficient or torque constant."),
    "temperature": ("temperature", "A slope is friction that changes as the axis warms up."),
}


def residual_plates(evidence: Evidence) -> Iterator[Plate]:
    """Residual over time, against each logged quantity, as a whole, and its correlation and spectra."""
    yield _over_time(evidence)
    for variable, (dimension, hint) in _AGAINST.items():
        values = getattr(evidence.rows, variable)
        # a sensor that only flickers by its last digit shows nothing against temperature
        least = 1.0 if variable == "temperature" else 0.0
        if values is None or float(np.nanmax(values) - np.nanmin(values)) <= least:
            continue
        rows, kind = evidence.rows, evidence.kind
        yield Plate(
            f"residual_{variable}",
            "residual",
            f"Residual against {variable}",
            f"{_tested(evidence, variable)}{hint} The dark line is the mean.",
            f"Residual over {variable}, base model on the left and extended model on the right, with the "
            "mean.",
            partial(
                residual_against_figure,
                values,
                rows.residual_before,
                rows.residual_after,
                label=axis_label(variable.capitalize(), dimension, kind),
                what=variable,
                fine=variable == "position",
                kind=kind,
            ),
        )
    yield _histogram(evidence)
    yield from _spectra_over(evidence)


def _tested(evidence: Evidence, variable: str) -> str:
    """What the residual tests say about one variable, as a sentence; nothing if it was not tested."""
    tests = evidence.facts.residual_tests
    if tests is None:
        return ""
    before = next((test for test in tests.before if test.variable == variable), None)
    after = next((test for test in tests.after if test.variable == variable), None)
    if before is None or after is None:
        return ""
    if not depends(before) and not depends(after):
        return "No dependence found, before or after. "
    if not depends(after):
        return f"Before: {_strength(before)}. After: gone (p = {text.p_text(after.p_value)}). "
    if not depends(before):
        return f"After: {_strength(after)}, which was not so before. "
    return f"Before: {_strength(before)}. After: still {_strength(after)}. "


def depends(test: ResidualTest) -> bool:
    """Whether a test found a dependence that is worth a look."""
    certain = test.p_value is not None and test.p_value < SIGNIFICANT
    return certain and (test.share is None or test.share >= _VISIBLE)


def _strength(test: ResidualTest) -> str:
    share = "" if test.share is None else f"{text.percent(test.share)} of the variance, "
    p_value = text.p_text(test.p_value)
    return f"depends on it ({share}p {'' if p_value.startswith('below') else '= '}{p_value})"


def _over_time(evidence: Evidence) -> Plate:
    rows = evidence.rows
    clock = rows.clock
    spans = [(float(clock[s.rows.start]), float(clock[s.rows.stop - 1])) for s in rows.held_out_spans]
    parts: list[tuple[float, float, str]] = []
    for segment in rows.segments:
        start, end = float(clock[segment.rows.start]), float(clock[segment.rows.stop - 1])
        if parts and parts[-1][2] == segment.experiment:
            parts[-1] = (parts[-1][0], end, segment.experiment)
        else:
            parts.append((start, end, segment.experiment))
    unit = unit_text("torque", evidence.kind)
    errors = (
        f"{text.number(rms(rows.residual_before), 3)} {unit} before and "
        f"{text.number(rms(rows.residual_after), 3)} {unit} after"
    )
    return Plate(
        "residual_time",
        "residual",
        "Residual over the session",
        f"Measured minus predicted {torque_name(evidence.kind)}, rms over all rows {errors}, both behind the "
        "fit's low-pass filter. A drift along the session points to temperature; a trial that stands out, to "
        "something that happened in it. Shaded: held out.",
        f"Residual over time before and after the effects were added; rms {errors}.",
        partial(
            residual_time_figure,
            clock,
            rows.residual_before,
            rows.residual_after,
            kind=evidence.kind,
            spans=spans,
            parts=parts,
            breaks=[segment.rows.start for segment in rows.segments],
        ),
        wide=True,
    )


def _histogram(evidence: Evidence) -> Plate:
    rows = evidence.rows
    return Plate(
        "residual_histogram",
        "residual",
        "Size of the residual",
        "Narrower is better. Two humps or a shoulder mean that something with two states (direction, a "
        "gap, stick and slip) is left; tails far beyond the dashed curve, single events.",
        "Histogram of the residual before and after, with a normal curve of the same spread.",
        partial(histogram_figure, rows.residual_before, rows.residual_after, kind=evidence.kind),
    )


def _spectra_over(evidence: Evidence) -> Iterator[Plate]:
    rows, kind = evidence.rows, evidence.kind
    trials = [segment.rows for segment in rows.segments]
    step, before = spectra.even_pieces(rows.time, rows.residual_before, trials)
    _, after = spectra.even_pieces(rows.time, rows.residual_after, trials)
    if before:
        most = max(8, min(int(1.5 / step), max(len(piece) for piece in before) // 2))
        correlation = (spectra.autocorrelation(before, most), spectra.autocorrelation(after, most))
        yield Plate(
            "residual_autocorrelation",
            "residual",
            "Autocorrelation of the residual",
            "What falls into the grey band at once is noise. The first few lags are the filter's own; a "
            "tail or a swing beyond them is structure that is left.",
            "Autocorrelation of the residual over the lag, before and after.",
            partial(autocorrelation_figure, step, *correlation, rows=sum(map(len, after))),
        )
        frequency, power_before = spectra.periodogram(before, step)
        _, power_after = spectra.periodogram(after, step)
        yield Plate(
            "spectrum_time",
            "residual",
            "Spectrum over time",
            "A sharp peak is a vibration from outside (breathing, a pump, mains) or a resonance; the fall at "
            "the right end is the filter.",
            "Power of the residual over frequency on logarithmic axes, before and after.",
            partial(periodogram_figure, frequency, power_before, power_after, kind=kind),
        )
    yield from _over_angle(evidence)
    curves = evidence.facts.cumulative_periodograms
    if curves is not None and curves.after and len(curves.after) == len(curves.before):
        said = " and ".join(f"{text.p_text(curve.p_value)} over {curve.over}" for curve in curves.after)
        yield Plate(
            "cumulative_periodogram",
            "residual",
            "Does the power add up as that of noise?",
            "A residual of noise alone stays in the grey band. A rise at the left is slow structure, a "
            f"step a periodic part. Chance of the extended model's curve if it were noise: {said}.",
            "Cumulative periodogram of the residual in time and over the angle, before and after.",
            partial(cumulative_figure, curves.before, curves.after),
        )


def _over_angle(evidence: Evidence) -> Iterator[Plate]:
    rows = evidence.rows
    if rows.position is None or not np.all(np.isfinite(rows.position)):
        return
    frequencies = spectra.angle_frequencies(rows.position, [segment.rows for segment in rows.segments])
    if len(frequencies) < 8:
        return
    before = spectra.angle_amplitudes(rows.position, rows.residual_before, frequencies)
    after = spectra.angle_amplitudes(rows.position, rows.residual_after, frequencies)
    ripple = evidence.parameters.effect("position_ripple")
    unit, per = unit_text("torque", evidence.kind), unit_text("spatial_frequency", evidence.kind)
    waves = frequencies / radians_per_unit("spatial_frequency", evidence.kind)
    found = [] if ripple is None else [k * ripple.parameters["cycles"].value for k in (1, 2)]
    peak = int(np.argmax(before))
    where = f"{text.number(float(before[peak]), 2)} {unit} at {text.number(float(waves[peak]), 3)} {per}"
    over = "travel" if is_linear(evidence.kind) else "angle"
    yield Plate(
        "spectrum_angle",
        "residual",
        f"Spectrum over {over}",
        f"A peak repeats with the {over}: gear mesh, pulley run-out, cogging. The highest before is {where}; "
        "once the ripple is in the model, it should be gone.",
        f"Amplitude of the residual over spatial frequency, before and after; the highest before is {where}.",
        partial(angle_spectrum_figure, waves, before, after, kind=evidence.kind, found=found),
    )
