"""What came out of `identify`: the parameter file, and the diagnosis as a document."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from idtool.diagnosis.diagnosis import Diagnosis
from idtool.diagnosis.next_experiment import NextExperiment
from idtool.experiment.recipe import document_of_command
from idtool.fit.choose import weightless
from idtool.fit.identifiability import shortcomings
from idtool.fit.joint import JointFit
from idtool.fit.known_load import Calibration
from idtool.fit.results import (
    dynamic_parameters,
    effect_entries,
    gravity_parameters,
    static_parameters,
)
from idtool.fit.shortcoming import Shortcoming
from idtool.log import Log
from idtool.parameters import NO_GRAVITY, Parameters
from idtool.parameters.drive import Drive
from idtool.parameters.scaling import in_torque
from idtool.signals import Recording
from idtool.verbs.fit_motion import MotionFit
from idtool.verbs.predict import Prediction
from idtool.version import __version__


@dataclass(frozen=True)
class Identification:
    """The outcome of `identify`.

    Attributes:
        recording: the logs as one.
        evidence: the diagnosis with everything behind it.
        notes: sentences that qualify the result.
        options: what was asked for, for the provenance.
        stepped_down: what the data lack for the friction law that was asked for.
        validation: the prediction of logs that no fit saw, where some were given.
        drive: the servo's position loop, where every log holds its goal.
        calibration: the constant that a known load told, where that was asked for.
        motion: the fit to the position, where that was asked for.
        logs: what was identified.
    """

    recording: Recording
    evidence: Diagnosis
    notes: list[str]
    options: dict[str, Any] = field(default_factory=dict)
    stepped_down: list[Shortcoming] = field(default_factory=list)
    validation: Prediction | None = None
    drive: Drive | None = None
    calibration: Calibration | None = None
    motion: MotionFit | None = None
    logs: tuple[Log, ...] = ()

    @property
    def fit(self) -> JointFit:
        """The final fit, on all trials."""
        return self.evidence.final

    @cached_property
    def parameters(self) -> Parameters:
        """The parameter file."""
        found = replace(parameters_of(self.fit, self.options | self._ended()), drive=self.drive)
        if self.motion is not None:
            ended = {"fit_motion": self.motion.outcome.value}
            found = replace(self.motion.parameters, provenance={**found.provenance, **ended})
        if self.calibration is not None:
            found = in_torque(found, self.calibration.constant, self.calibration.unit)
        return found

    def _ended(self) -> dict[str, Any]:
        """The verdict, and what was left unexplained, as the provenance keeps them."""
        verdict, unexplained = self.evidence.verdict, self.evidence.unexplained
        if unexplained is None:
            return {"verdict": verdict}
        left = float(f"{self.evidence.left['percent_of_torque']:.3g}")
        return {"verdict": verdict, "left_percent_of_torque": left, "depends_on": unexplained["depends_on"]}

    @cached_property
    def diagnosis(self) -> dict[str, Any]:
        """The document of diagnosis.json."""
        document = self.evidence.to_document()
        document["notes"] = self.notes + document["notes"]
        lacking = [*self.stepped_down, *shortcomings(self.fit)]
        document["findings"] = [one.to_document() for one in lacking]
        if document["next_experiment"] is None:
            document["next_experiment"] = self._run_for(lacking)
        if self.motion is not None:
            rms = {"before": self.motion.before, "after": self.motion.after}
            document["motion"] = {
                "rms_1s_windows": rms,
                "unit": "m" if self.recording.axis.kind == "linear" else "rad",
            }
        if self.calibration is not None:
            document["calibration"] = {
                "key": self.calibration.key,
                **self.calibration.constant.to_table(),
            }
        if self.validation is not None:
            document["validation"] = {"logs": list(self.validation.logs), "errors": self.validation.errors}
        return document

    def _run_for(self, lacking: list[Shortcoming]) -> dict[str, Any] | None:
        """The run that shows the first parameter that the data do not determine."""
        kind = self.recording.axis.kind
        for one in lacking:
            if one.parameters and one.run and kind == "rotary":  # the bundled recipes are for a rotary axis
                run = NextExperiment(document_of_command(one.run, kind), (), f"{one.why}: {one.remedy}.")
                return run.to_document()
        return None


def parameters_of(fit: JointFit, options: dict[str, Any] | None = None) -> Parameters:
    """The parameter file of a fit."""
    spec, recording = fit.model.spec, fit.model.recording
    told = spec.gravity is None and (options or {}).get("gravity") == NO_GRAVITY
    return Parameters(
        axis=recording.axis,
        gravity_model=spec.gravity,
        gravity=gravity_parameters(fit),
        weightless=told or weightless(recording, spec.gravity),
        static=static_parameters(fit),
        dynamic=dynamic_parameters(fit),
        effects=effect_entries(fit),
        provenance={
            "tool": f"ffc-id {__version__}",
            "logs": list(recording.sources),
            **({"rig": recording.rig} if recording.rig else {}),
            "friction_law": spec.friction,
            "fit": fit.outcome.value,
            "filter_hz": float(f"{recording.filter.bandwidth_hz:.6g}"),
            **(recording.own_filter.to_provenance() if recording.own_filter else {}),
            **(options or {}),
        },
    )
