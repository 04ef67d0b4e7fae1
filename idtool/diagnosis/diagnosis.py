"""The result of a diagnosis: what was found, the error before and after, and its JSON document."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.diagnosis.candidates import LEAST_GAIN
from idtool.diagnosis.held_out import everywhere
from idtool.diagnosis.next_experiment import NextExperiment
from idtool.diagnosis.pruning import of_the_readings
from idtool.diagnosis.remainder import Remainder
from idtool.diagnosis.residual import ResidualTest, autocorrelation
from idtool.diagnosis.smoothing import fit_correction
from idtool.diagnosis.split import Split
from idtool.diagnosis.state import Selection
from idtool.diagnosis.whiteness import cumulative_periodograms
from idtool.effects.base import Effect
from idtool.fit.joint import JointFit, torque_of
from idtool.fit.results import effect_entry
from idtool.fit.shortcoming import Shortcoming
from idtool.model.units import file_key, unit_suffix
from idtool.parameters.correction import Correction

SCHEMA = "ffc-id/diagnosis/1"


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
        hidden: effects that were turned down though no chance, the least likely to be chance first.
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
    hidden: list[str] = field(default_factory=list)
    start: int = 0
    notes: list[str] = field(default_factory=list)
    stepped_down: list[Shortcoming] = field(default_factory=list)

    @cached_property
    def before(self) -> JointFit:
        """The base model on every trial; held-out trials get a start deflection only."""
        return everywhere(self.base, self.split.recording)

    @cached_property
    def after(self) -> JointFit:
        """The extended model of the training trials on every trial."""
        return everywhere(self.selection.fit, self.split.recording)

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
        inertia = tuple(effect for effect in self.final.model.spec.effects if effect.name == "inertia")
        for effect in (*self.effects, *inertia):  # every program that reads this knows it among them
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
            "hidden": self.hidden,
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
                "all_rows_after": _relative(everywhere(self.final, recording), np.ones_like(filtered_held)),
            },
            "blocks_stand_in_for_trials": self.split.blocks,
            "held_out_trials": list(self.split.held_out),
        }


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
