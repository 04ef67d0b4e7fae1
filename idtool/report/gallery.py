"""Which figures a report has: each with its name, caption, text alternative and how to draw it.

A figure whose data are absent is left out. The captions say what to see, with the numbers at hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from idtool.model.units import torque_name, unit_text
from idtool.presentation import text
from idtool.report.evidence import Evidence, Segment
from idtool.report.facts import StribeckCurve, array
from idtool.report.friction_figures import stribeck_figure
from idtool.report.gravity_figures import arm_figure, average_error, gravity_figure
from idtool.report.loop_figures import MOST_PANELS, Loop, loops_figure, main_frequency
from idtool.report.prediction_figures import Trace, prediction_figure
from idtool.report.selection_figures import candidates_figure, correlation_figure, stiffness_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Trials that are drawn over time: more hide each other.
_MOST_TRACES = 3


@dataclass(frozen=True)
class Plate:
    """One figure of the report.

    Attributes:
        name: of its files in figures/.
        section: "model", "prediction", "residual" or "uncertainty".
        title: a few words, the heading over it.
        caption: what to see.
        alt: what the figure shows, for those who do not see it.
        draw: makes the figure.
        wide: takes the full width of the page.
    """

    name: str
    section: str
    title: str
    caption: str
    alt: str
    draw: Callable[[], Figure]
    wide: bool = False


def model_plates(evidence: Evidence) -> Iterator[Plate]:
    """Friction over speed, gravity, loops, and measured against predicted."""
    yield from _stribeck(evidence)
    yield from _gravity(evidence)
    yield from _loops(evidence)
    yield from _predictions(evidence)


def uncertainty_plates(evidence: Evidence) -> Iterator[Plate]:
    """Candidates, correlation of the parameters, cost over the bristle stiffness."""
    yield from _candidates(evidence)
    yield from _correlation(evidence)
    yield from _stiffness(evidence)


def _stribeck(evidence: Evidence) -> Iterator[Plate]:
    points, curve = evidence.facts.stribeck_points, evidence.facts.stribeck_curve or StribeckCurve()
    if not points and not curve.velocity:
        return
    kind = evidence.kind
    unsteady = sum(not point.steady for point in points)
    caption = (
        _friction_shape(evidence)
        + "Dots are constant-speed windows with 95 % intervals; the band holds the curve with 95 % "
        "confidence."
    )
    if unsteady:
        caption += f" Hollow dots ({unsteady}) were not steady and did not count."
    caption += " In the folded panel, two curves apart mean that the directions differ."
    yield Plate(
        "stribeck",
        "model",
        "Friction against speed",
        caption,
        f"Friction {torque_name(kind)} over velocity in both directions: "
        f"{text.counted(len(points), 'measured point')}, "
        "the fitted curve with its band, and below it both directions folded onto each other.",
        lambda: stribeck_figure(
            [point.velocity for point in points],
            [point.torque for point in points],
            kind=kind,
            stderr=array(tuple(point.stderr for point in points)),
            steady=[point.steady for point in points],
            curve_velocity=array(curve.velocity),
            curve_torque=array(curve.torque),
            low=array(curve.low),
            high=array(curve.high),
        ),
    )


def _friction_shape(evidence: Evidence) -> str:
    static = evidence.parameters.static
    if not static or evidence.facts.friction == "coulomb":
        return "Coulomb and viscous friction: a level and a slope. "
    speed = f"{text.number(static['stribeck_velocity'].value, 2)} {unit_text('velocity', evidence.kind)}"
    if static["static"].value < static["coulomb"].value:
        where, what = "below", f"rises from standstill up to about {speed}"
    else:
        where, what = "above", f"falls until about {speed}, then rises"
    return f"The stiction lies {where} the Coulomb level: friction {what}. "


def _gravity(evidence: Evidence) -> Iterator[Plate]:
    gravity, model, kind = evidence.parameters.gravity, evidence.parameters.gravity_model, evidence.kind
    over = "position" if model == "arm" else "payload"
    place = "position" if model == "arm" else "payload_kg"
    points = [point for point in evidence.facts.gravity_points if getattr(point, place) is not None]
    if not points or not gravity:
        return
    x = array(tuple(getattr(point, place) for point in points))
    torque = array(tuple(point.torque for point in points))
    stderr = array(tuple(point.stderr for point in points))
    values = {name: parameter.value for name, parameter in gravity.items()}
    if model == "arm":
        model_torque = values["sin"] * np.sin(x) + values["cos"] * np.cos(x)
    else:
        model_torque = values["base"] + values["per_payload"] * x
    error = average_error(torque, model_torque)
    caption = "Each dot is measured moving both ways, so that friction cancels. "
    if np.isfinite(error):
        caption += f"The model is off by {text.number(error, 2)} % on average. "
    caption += (
        f"Below: what is left; a bend there would mean that gravity does not follow the {over} as modelled."
    )

    draw = arm_figure if model == "arm" else gravity_figure
    yield Plate(
        "gravity",
        "model",
        f"Gravity against {over}",
        caption,
        f"Gravity {torque_name(kind)} at {text.counted(len(points), over + ' step')} with the fitted line "
        "and, below, the difference between them.",
        partial(draw, x, torque, **values, kind=kind, stderr=stderr),
    )


def _loops(evidence: Evidence) -> Iterator[Plate]:
    rows, kind = evidence.rows, evidence.kind
    trials = _loop_trials(evidence)
    if not trials:
        return
    labels = []
    for segment in trials:
        frequency = main_frequency(rows.time[segment.rows], rows.velocity[segment.rows])
        trial = f"trial {segment.trial}"
        labels.append(trial if frequency is None else f"{frequency:.2g} Hz ({trial})")
    effort = torque_name(kind)
    for against, x, see in (
        (
            "velocity",
            rows.velocity,
            "The width of a loop is what velocity alone does not explain: the bristle, inertia and delay",
        ),
        (
            "position",
            rows.position,
            "A tilt of a loop is a spring, a wave along it is ripple, and its rounded corners are presliding",
        ),
    ):
        if x is None:
            continue
        loops = [
            Loop(label, x[s.rows], rows.torque[s.rows], rows.after[s.rows])
            for label, s in zip(labels, trials, strict=True)
        ]  # fmt: skip
        yield Plate(
            f"loops_{against}",
            "model",
            f"{effort.capitalize()} against {against}",
            f"{see}. Grey is measured, blue is what the identified model predicts; they should lie on "
            "each other.",
            f"Loops of {effort} over {against}, measured and predicted, for {text.listed(labels)}.",
            partial(loops_figure, loops, kind=kind, against=against),  # type: ignore[arg-type]
        )


def _loop_trials(evidence: Evidence) -> list[Segment]:
    """The sine trials; without any, the longest trials that go both ways."""
    rows = evidence.rows
    sines = [segment for segment in rows.segments if "sin" in segment.experiment.lower()]
    if len(sines) > MOST_PANELS:
        # one of each frequency tells more than four of the first
        sines = [sines[round(k)] for k in np.linspace(0, len(sines) - 1, MOST_PANELS)]
    if sines:
        return sines
    both = [s for s in rows.segments if rows.velocity[s.rows].min() < 0 < rows.velocity[s.rows].max()]
    both.sort(key=lambda segment: segment.rows.start - segment.rows.stop)
    return sorted(both[:MOST_PANELS], key=lambda segment: segment.rows.start)


def _predictions(evidence: Evidence) -> Iterator[Plate]:
    rows, kind = evidence.rows, evidence.kind
    held_out = rows.held_out_spans
    shown = _one_of_each(held_out or rows.segments)
    traces = []
    for segment in shown:
        name = f"trial {segment.trial}"
        traces.append(
            Trace(
                f"{segment.experiment}, {name}" if segment.experiment else name,
                rows.time[segment.rows] - rows.time[segment.rows.start],
                rows.torque[segment.rows],
                rows.after[segment.rows],
                rows.before[segment.rows] if rows.extended else None,
            )
        )
    start = (
        "None of these rows was used to fit parameters or to choose effects. "
        if held_out
        else "Nothing was held out, so this is how well the model fits, not how well it predicts. "
    )
    if rows.extended:
        models = "the base and the extended model"
        see = (
            "The blue line (extended model) should lie on the wide grey one (measured); where the orange "
            "line (base model) leaves it, the added effects do their work."
        )
    else:
        models, see = "the model", "The blue line (model) should lie on the wide grey one (measured)."
    yield Plate(
        "prediction",
        "prediction",
        "Measured and predicted",
        start + see,
        f"{torque_name(kind).capitalize()} over time, measured and predicted by {models}, for "
        f"{text.listed([trace.label for trace in traces])}.",
        lambda: prediction_figure(traces, kind=kind, held_out=bool(held_out)),
        wide=True,
    )


def _one_of_each(segments: tuple[Segment, ...]) -> list[Segment]:
    """Up to three segments, of different experiments where there are any, in the order of the file."""
    first: dict[str, Segment] = {}
    for segment in segments:
        first.setdefault(segment.experiment, segment)
    chosen = list(first.values())[:_MOST_TRACES]
    chosen += [segment for segment in segments if segment not in chosen][: _MOST_TRACES - len(chosen)]
    return sorted(chosen, key=lambda segment: segment.rows.start)


def _candidates(evidence: Evidence) -> Iterator[Plate]:
    error = evidence.diagnosis.error
    scored = [(c, c.held_out) for c in evidence.diagnosis.tried if c.held_out is not None]
    if not scored:
        return
    taken = [text.effect_title(c.name) for c, _ in scored if c.accepted]
    caption = f"Accepted: {text.listed(taken)}. " if taken else "None was accepted. "
    caption += (
        "A shorter bar is a better prediction; an effect is taken only if it also passes its significance "
        "test and no simpler one does as well (the reasons are in the table)."
    )
    yield Plate(
        "candidates",
        "uncertainty",
        "Candidate effects",
        caption,
        f"Bar chart of the held-out error with each of {text.counted(len(scored), 'candidate effect')}.",
        lambda: candidates_figure(
            [text.effect_title(candidate.name) for candidate, _ in scored],
            np.array([value for _, value in scored]),
            [candidate.accepted for candidate, _ in scored],
            base=error.held_out.before,
            noise_floor=error.noise_floor,
            kind=evidence.kind,
        ),
    )


def _correlation(evidence: Evidence) -> Iterator[Plate]:
    correlation = evidence.facts.correlation
    if correlation is None or len(correlation.names) < 2:
        return
    count = len(correlation.names)
    if len(correlation.matrix) != count or any(len(row) != count for row in correlation.matrix):
        return
    matrix = np.nan_to_num(np.array([array(row) for row in correlation.matrix]))
    names = [_of_effect(name) for name in correlation.names]
    size = np.abs(np.triu(matrix, 1))
    row, column = np.unravel_index(int(np.argmax(size)), size.shape)
    strongest = f"{names[row]} and {names[column]} ({text.number(float(matrix[row, column]), 2)})"
    yield Plate(
        "correlation",
        "uncertainty",
        "Correlation of the parameters",
        f"The strongest pair is {strongest}. Near ±1, the data fix only a combination of the two: a run "
        "that moves one without the other would separate them.",
        f"Heat map of the correlation between {count} parameter estimates; the strongest is {strongest}.",
        lambda: correlation_figure(names, matrix),
    )


def _of_effect(name: str) -> str:
    """A parameter as words: "position_ripple.cycles" as "position ripple: cycles", an inertia as itself."""
    effect, _, own = name.rpartition(".")
    return f"{text.words(effect)}: {text.words(own)}" if effect not in ("", own) else text.quantity(own)


def _stiffness(evidence: Evidence) -> Iterator[Plate]:
    cost, kind = evidence.facts.cost_over_sigma0, evidence.kind
    if cost is None or len(cost.sigma0) < 3 or len(cost.sigma0) != len(cost.rmse):
        return
    sigma0, rmse = array(cost.sigma0), array(cost.rmse)
    good = np.isfinite(sigma0) & np.isfinite(rmse) & (sigma0 > 0)
    if np.count_nonzero(good) < 3:
        return
    stiffness = evidence.parameters.dynamic.get("bristle_stiffness")
    if stiffness is not None and not stiffness.identified:
        caption = "The data do not determine the stiffness: the curve is flat on at least one side. "
    else:
        caption = "A clear valley means that the data determine the stiffness. "
    best = f", with its minimum at {text.number(cost.best, 3)} {unit_text('stiffness', kind)}"
    yield Plate(
        "bristle_stiffness",
        "uncertainty",
        "Error over the bristle stiffness",
        caption
        + "Flat to the right, only a lower bound is known: the bristle is stiffer than the sensors resolve.",
        f"Rms error of the fit over the bristle stiffness on a logarithmic axis{best if cost.best else ''}.",
        lambda: stiffness_figure(sigma0[good], rmse[good], best=cost.best, kind=kind),
    )
