"""The diagnosis: which effect the base model lacks, and the error before and after."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.diagnosis.candidates import LEAST_GAIN, Selection
from idtool.diagnosis.next_experiment import NextExperiment, between_models, for_parameter
from idtool.diagnosis.pruning import drop_impossible, drop_what_may_be_unknown, of_the_readings, veto
from idtool.diagnosis.remainder import Remainder, doubted, remainder
from idtool.diagnosis.residual import ResidualTest, autocorrelation, test_residual
from idtool.diagnosis.selection import absorbed, begun, extend, good_enough
from idtool.diagnosis.shapes import Unnamed
from idtool.diagnosis.smoothing import fit_correction
from idtool.diagnosis.split import Split, split
from idtool.diagnosis.summary import LOOKS_LIKE
from idtool.diagnosis.weights import weighed
from idtool.diagnosis.whiteness import cumulative_periodograms
from idtool.effects.base import Effect
from idtool.fit.choose import step_down, with_load
from idtool.fit.joint import JointFit, on_recording, refit, torque_of
from idtool.fit.left_out import left_out_error, predicts_better
from idtool.fit.model import JointModel
from idtool.fit.results import dynamic_parameters, effect_entry, static_parameters
from idtool.fit.shortcoming import Shortcoming
from idtool.model.motion import Array
from idtool.model.units import file_key, unit_suffix
from idtool.parameters.correction import Correction
from idtool.presentation.text import quantity
from idtool.signals import Recording
from idtool.signals.thin import thin

SCHEMA = "ffc-id/diagnosis/1"
#: Sentences on what is going on that say how far it is (`idtool.verbs.expected`).
BASE, FINAL = "fitting the base model", "fitting the final model on all trials"
#: A row stands out of the others by so many standard deviations of them.
_STANDS_OUT = 3.0
#: Blocks into which the held-out rows are parted, to tell what is chance.
_BLOCKS = 30


@dataclass(frozen=True)
class Diagnosis:
    """What the residual of the base model was traced to.

    Attributes:
        split: the trials, and which were held out.
        base: the base model, fitted on the training trials.
        selection: the search for effects on the training rows.
        final: the extended model fitted on all trials; its parameters are the result.
        tests_before, tests_after: dependence of the residual on what was measured.
        remainder: what the final model leaves and is still structured.
        start: place of the first fit that led here among those that were given.
        next_experiment: the run that would tell what these logs leave open.
        notes: sentences for the reader.
        stepped_down: what the data lack for the friction law of the base model, beside the effects.
    """

    split: Split
    base: JointFit
    selection: Selection
    final: JointFit
    tests_before: list[ResidualTest]
    tests_after: list[ResidualTest]
    next_experiment: NextExperiment | None = None
    remainder: Remainder | None = None
    start: int = 0
    notes: list[str] = field(default_factory=list)
    stepped_down: list[Shortcoming] = field(default_factory=list)

    @cached_property
    def before(self) -> JointFit:
        """The base model on every trial; held-out trials get a start deflection only."""
        return _everywhere(self.base, self.split.recording)

    @cached_property
    def after(self) -> JointFit:
        """The extended model of the training trials on every trial."""
        return _everywhere(self.selection.fit, self.split.recording)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects of the axis in the order in which they were found; inertia is the base model's."""
        return tuple(
            effect
            for effect in self.final.model.spec.effects
            if effect.name != "inertia" and not of_the_readings(self.final, effect)
        )

    @cached_property
    def correction(self) -> Correction | None:
        """A smooth correction for what is left, fitted on the training trials; None if nothing is left or if
        it does not help on the held-out ones."""
        unexplained = self.unexplained
        found = unexplained and fit_correction(self.selection.fit, unexplained["depends_on"])
        if not found:
            return None
        before, after = self._held_out_with(found)
        return found if after < (1.0 - LEAST_GAIN) * before else None

    def _held_out_with(self, correction: Correction) -> tuple[float, float]:
        """Error on the held-out trials without and with a correction."""
        motion = self.split.recording.motion
        rows = self.split.recording.usable & self.split.held
        plain = self.after.full_residual
        without, with_it = (
            float(np.sqrt(np.mean(r[rows] ** 2))) for r in (plain, plain - correction(motion))
        )
        return without, with_it

    @cached_property
    def unexplained(self) -> dict[str, Any] | None:
        """What is left and still structured."""
        if self.remainder is None:
            return None
        left = self.remainder
        return {"share": left.share, "depends_on": list(left.depends_on), "note": left.note}

    @cached_property
    def left(self) -> dict[str, float]:
        """What the extended model leaves on the held-out rows, and how much of the torque that is."""
        rows = self.split.recording.usable & self.split.held
        rms = float(np.sqrt(np.mean(self.after.full_residual[rows] ** 2)))
        torque = float(np.sqrt(np.mean(self.split.recording.torque[rows] ** 2)))
        unit = unit_suffix("torque", self.split.recording.axis.units)
        return {
            f"rms_{unit}": rms,
            "percent_of_torque": 100.0 * rms / torque,
            "noise_percent": 100.0 * self.split.recording.floor / torque,
        }

    @property
    def verdict(self) -> str:
        """adequate, effect_found, ambiguous or unexplained."""
        if self.unexplained is not None:
            return "unexplained"
        if any(self.selection.alternatives.get(effect.name) for effect in self.effects):
            return "ambiguous"
        return "effect_found" if self.effects else "adequate"

    def to_document(self) -> dict[str, Any]:
        """The JSON document of diagnosis.json."""
        kind = self.split.recording.axis.units
        before, after = self.before, self.after
        effects = []
        for effect in self.effects:
            entry = effect_entry(self.final, effect)
            dimensions = {p.name: p.dimension for p in effect.parameters}
            effects.append(
                {
                    "name": effect.name,
                    "p_value": self.selection.p_values.get(effect.name),
                    "percent_of_torque": 100.0
                    * torque_of(self.final, effect)
                    / self.split.recording.torque_size,
                    "alternatives": self.selection.alternatives.get(effect.name, []),
                    "parameters": {
                        file_key(n, dimensions[n], kind): p.to_table() for n, p in entry.parameters.items()
                    },
                }
            )
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "effects": effects,
            "error": self._errors(before, after),
            "unexplained": self._unexplained_document(),
            "left": self.left,
            "candidates": [
                {
                    "name": c.name,
                    "held_out": self._unfiltered(c.held_out),
                    "p_value": c.p_value,
                    "gain": c.gain,
                    "accepted": c.accepted,
                    "why": c.why,
                }
                for c in self.selection.candidates.values()
            ],
            "residual": {
                "before": _residual_document(self.base, self.tests_before),
                "after": _residual_document(self.final, self.tests_after),
            },
            "next_experiment": self.next_experiment and self.next_experiment.to_document(),
            "friction": self.final.model.spec.friction,
            "notes": self.notes,
        }

    def _unfiltered(self, error: float | None) -> float | None:
        """An error of filtered rows with what the filter takes off, so that it compares with `error`."""
        if error is None:
            return None
        recording = self.split.recording
        rows = recording.usable & ~self.split.held
        above = float(np.mean(self.after.full_residual[rows] ** 2)) - self.selection.fit.rmse**2
        return math.sqrt(error**2 + max(above, 0.0))

    def _unexplained_document(self) -> dict[str, Any] | None:
        if self.unexplained is None or self.correction is None:
            return self.unexplained
        before, after = self._held_out_with(self.correction)
        return self.unexplained | {
            "correction": {
                "variable": self.correction.variable,
                "with_direction": self.correction.with_direction,
                "held_out": {"before": before, "after": after},
            }
        }

    def _errors(self, before: JointFit, after: JointFit) -> dict[str, Any]:
        recording = self.split.recording
        held = self.split.held
        filtered_held = held[recording.row]
        by_experiment = {}
        for name in dict.fromkeys(recording.experiment):
            trials = [t for t, e in enumerate(recording.experiment) if e == name]
            rows = np.isin(recording.motion.trial, trials) & recording.usable
            if not rows.any():  # the notes say so
                continue
            unseen = bool(np.any(rows & held))
            by_experiment[name] = {
                **_pair(before, after, rows & held if unseen else rows),
                "held_out": unseen,
            }
        return {
            "metric": f"rmse_{unit_suffix('torque', recording.axis.units)}",
            "held_out": _pair(before, after, held),
            "training": _pair(before, after, ~held),
            "by_experiment": by_experiment,
            "noise_floor": recording.floor,
            "relative_percent": {
                "held_out": {
                    "before": _relative(before, filtered_held),
                    "after": _relative(after, filtered_held),
                },
                "all_rows_after": _relative(_everywhere(self.final, recording), np.ones_like(filtered_held)),
            },
            "blocks_stand_in_for_trials": self.split.blocks,
            "held_out_trials": list(self.split.held_out),
        }


def diagnose(
    recording: Recording,
    starts: Sequence[JointFit],
    library: Sequence[Effect],
    tell: Callable[[str], None] = lambda _: None,
    *,
    given: bool = False,
    tolerance: float = 0.0,
) -> Diagnosis:
    """Find the effects that the base model lacks.

    Args:
        recording: all trials.
        starts: fits of the base model to these data, the one to trust most first. Another one is taken where
            it predicts better without any effect, or where the first one leaves something that it does not.
        library: the effects to consider.
        tell: called with a sentence on what is being tried.
        given: the library is a model that somebody chose; its effects need not explain everything.
        tolerance: error that is good enough, share of the torque (rms).
    """
    shown = parts = split(with_load(recording, starts[0]))
    best: tuple[JointFit, Selection, dict[Unnamed, str], int] | None = None

    def select(
        selection: Selection, parts: Split, rival: JointFit | None = None, *, named: bool = given
    ) -> tuple[dict[Unnamed, str], JointFit]:
        """The shapes without a name that were taken out, and the fit with them."""
        wanted = library
        while True:
            extend(selection, wanted, tell, given=named, tolerance=tolerance, rival=rival)
            if selection.hopeless:
                return {}, selection.fit
            complete = selection.fit
            unnamed = _without_unnamed(selection)
            wanted = absorbed(
                veto(selection, partial(held_out_squares, parts=parts, beside=complete), tell), library
            )
            if not wanted:
                return unnamed, complete

    tell(BASE)
    training = thin(parts.training)
    bases = [refit(start, JointModel.build(training, start.model.spec)) for start in starts]
    recording = weighed(shown.recording, bases[0])
    if recording is not shown.recording:
        parts = replace(shown, recording=recording)
        training = thin(parts.training)
        bases = [refit(base, JointModel.build(training, base.model.spec)) for base in bases]
    rival: JointFit | None = None
    been: list[JointFit] = []
    # the one to trust most comes last, and goes on only while it may do as well as the others
    for place, base in reversed(list(enumerate(bases))):
        selection = begun(base, library)
        selection.others = tuple(been)
        unnamed, complete = select(selection, parts, rival)
        been += selection.steps
        if selection.hopeless:
            continue
        if unnamed:
            # a shape can stand in the way of effects that it is made of; where they do as well they are it
            tell("looking once more for effects that have a name")
            alone = begun(base, library)
            select(alone, parts, complete, named=True)
            if not alone.hopeless and left_out_error(alone.fit) <= left_out_error(complete):
                selection, unnamed = alone, {}
        done = not unnamed and not any(test.depends for test in test_residual(selection.fit))
        if (
            best is None
            or (done and not predicts_better(best[0], selection.fit))
            or not _beats(best[1].fit, selection.fit)
        ):
            best = base, selection, unnamed, place
        rival = selection.fit if done else rival
    assert best is not None
    base, selection, unnamed, place = best
    recording = weighed(parts.recording, selection.fit)
    if recording is not parts.recording:
        tell("weighing slow rows by what they leave")
        parts = replace(parts, recording=recording)
        selection.onto(thin(parts.training))
        unnamed, _ = select(selection, parts)
    # beside the effects less may be seen of the friction than before they were in
    simpler, notes, stepped_down = step_down(selection.fit)
    if simpler is not selection.fit and _predicts_worse(simpler, selection.fit, shown):
        notes, stepped_down = [], []  # rows that count less since may have been what the law was needed for
    elif simpler is not selection.fit:
        selection.fit = simpler
    if selection.fit.model.spec == base.model.spec:
        # nothing was added: one model, of which the search may have found a better minimum
        base = selection.fit
    tell(FINAL)
    followed = [variable for shape in unnamed for variable in shape.follows]
    while True:
        final = _finished(selection, recording)
        tests = test_residual(final)
        left = None if good_enough(final, tolerance) else remainder(final, tests, followed)
        if drop_impossible(selection, final):
            # what one effect had in common with others is theirs then, and may make them what they were not
            veto(selection, partial(held_out_squares, parts=parts, beside=selection.fit), tell)
        elif given or not drop_what_may_be_unknown(selection, final, left):
            break
    if shown.blocks:
        notes.append(
            "there are too few trials to hold some out, so contiguous blocks of time stand in for trials: "
            "the error on them tells of other times of the same run, not of another run."
        )
    if recording.weight is not None:
        notes.append(
            f"at low speed the model leaves {recording.weight.max() / recording.weight.min():.0f} times "
            "as much as in motion; those rows count that much less."
        )
    notes += filter(None, (of_the_readings(final, effect) for effect in final.model.spec.effects))
    notes += _not_compared(shown.recording)
    next_experiment = _next_experiment(selection, final, tell)
    if left and unnamed:
        notes.append(f"{LOOKS_LIKE}: {'; '.join(unnamed.values())}.")
    # who chose the model has its numbers with its own errors
    stated = final if given else doubted(final, left)
    return Diagnosis(
        shown,
        base,
        selection,
        stated,
        test_residual(base),
        tests,
        next_experiment,
        left,
        place,
        notes,
        stepped_down,
    )


def _beats(other: JointFit, trusted: JointFit) -> bool:
    """Whether a fit predicts enough better than one that is to be trusted more.

    A friction curve that rises from rest can follow what an effect does that the model lacks: beside one that
    falls it has to be better by enough to matter, or as good with fewer numbers.
    """
    if other.model.spec.falling or not trusted.model.spec.falling:
        return predicts_better(other, trusted)
    error, trusted_error = left_out_error(other), left_out_error(trusted)
    if len(other.x) < len(trusted.x):
        return error < (1.0 + LEAST_GAIN) * trusted_error
    return error < (1.0 - LEAST_GAIN) * trusted_error


def _finished(selection: Selection, recording: Recording) -> JointFit:
    """The chosen model on all trials."""
    chosen = selection.fit
    loaded = with_load(recording, chosen)
    return refit(chosen, JointModel.build(loaded, chosen.model.spec, chosen.model.constants))


def _not_compared(recording: Recording) -> list[str]:
    """A sentence for each experiment of which no row is compared."""
    compared = {recording.experiment[trial] for trial in np.unique(recording.motion.trial[recording.usable])}
    missing = [name for name in dict.fromkeys(recording.experiment) if name not in compared]
    return [f"no row of the experiment {name!r} could be compared with the model." for name in missing]


def _without_unnamed(selection: Selection) -> dict[Unnamed, str]:
    """Take the shapes without a name out of the model; those, and each in words."""
    fit = selection.fit
    shapes = [effect for effect in fit.model.spec.effects if isinstance(effect, Unnamed)]
    told = {shape: shape.told(fit.model.effect_values(fit.x, shape), fit.model.recording) for shape in shapes}
    if shapes:
        model, spec = selection.fit.model, selection.fit.model.spec
        for shape in shapes:
            spec = spec.without(shape.name)
        selection.fit = refit(selection.fit, JointModel.build(model.recording, spec, model.constants))
    return told


def held_out_squares(fit: JointFit, parts: Split, beside: JointFit | None = None) -> Array:
    """Mean square of what plain prediction leaves on held-out rows, one bristle start per trial, by blocks.

    Rows that stand out (an axis that creeps before it slides follows no friction law) count by Huber's loss
    (Annals of Mathematical Statistics 35, 1964), so that they do not decide alone.

    Args:
        fit: the model.
        parts: which rows were held out.
        beside: the model that tells which rows stand out, the same for all that are compared; None is `fit`.
    """
    left = _held_out(fit, parts)
    limit = _STANDS_OUT * 1.4826 * float(np.median(_held_out(beside or fit, parts)))
    squares = np.where(left > limit, limit * (2.0 * left - limit), left**2)
    return np.array([float(block.mean()) for block in np.array_split(squares, min(_BLOCKS, len(squares)))])


def _predicts_worse(one: JointFit, other: JointFit, parts: Split) -> bool:
    """Whether one model predicts held-out rows worse than another by enough to matter."""
    lost = held_out_squares(one, parts, other) - held_out_squares(other, parts, other)
    shown = _everywhere(other, parts.recording)
    return float(lost.mean()) > 2.0 * LEAST_GAIN * shown.rmse**2


def _held_out(fit: JointFit, parts: Split) -> Array:
    """Size of what a model leaves on each held-out row."""
    recording = parts.recording
    rows = recording.usable & parts.held
    weight = 1.0 if recording.weight is None else recording.weight[rows]
    return np.asarray(np.abs(weight * _everywhere(fit, recording).full_residual[rows]))


def _next_experiment(
    selection: Selection, final: JointFit, tell: Callable[[str], None]
) -> NextExperiment | None:
    """A run that tells apart what ties, or else one for a parameter that is not determined."""
    for name, rivals in selection.alternatives.items():
        tell(f"looking for a run that tells {name} from {rivals[0]}")
        if found := between_models(selection.fit, selection.rivals[name], (name, rivals[0])):
            return found
    for values in (static_parameters(final), dynamic_parameters(final)):
        for name, value in values.items():
            if not value.identified:
                tell(f"looking for a run that determines {quantity(name)}")
                if found := for_parameter(final, name):
                    return found
    return None


def _everywhere(fit: JointFit, recording: Recording) -> JointFit:
    return on_recording(fit, JointModel.build(recording, fit.model.spec, fit.model.constants))


def _residual_document(fit: JointFit, tests: list[ResidualTest]) -> dict[str, Any]:
    """How far a residual is from noise, in numbers."""
    return {
        "correlated_rows": autocorrelation(fit),
        "cumulative_periodogram": {p.over: p.p_value for p in cumulative_periodograms(fit)},
        "depends_on": {t.variable: {"share": t.share, "p_value": t.p_value} for t in tests},
    }


def _pair(before: JointFit, after: JointFit, rows: NDArray[np.bool_]) -> dict[str, float]:
    usable = before.model.recording.usable & rows
    return {
        "before": float(np.sqrt(np.mean(before.full_residual[usable] ** 2))),
        "after": float(np.sqrt(np.mean(after.full_residual[usable] ** 2))),
    }


def _relative(fit: JointFit, rows: NDArray[np.bool_]) -> float:
    return float(100.0 * np.linalg.norm(fit.residual[rows]) / np.linalg.norm(fit.model.measured[rows]))
