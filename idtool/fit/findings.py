"""What a reader of a fit must know, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

from idtool.fit.identifiability import shortcomings
from idtool.fit.joint import JointFit
from idtool.fit.results import dynamic_parameters, passivity, static_parameters
from idtool.fit.shortcoming import PARTS
from idtool.model.units import unit_text
from idtool.signals import Recording


def findings(fit: JointFit, parts: Sequence[str] = PARTS) -> list[str]:
    """Sentences on a fit that a reader must know: the friction model, what the data lack, rows left out.

    Args:
        fit: any fit.
        parts: parts of the parameter file that it gives: "gravity", "static", "dynamic", "effects".
    """
    return [
        *_about_effort(fit.model.recording),
        *(_about_friction(fit) if "static" in parts else []),
        *(_about_lags(fit) if "effects" in parts else []),
        *(one.sentence for one in shortcomings(fit, parts)),
        *fit.model.recording.told_of_rows(),
    ]


def _about_effort(recording: Recording) -> list[str]:
    axis = recording.axis
    notes = []
    if axis.effort != "torque":
        unit = unit_text("torque", axis.units)
        notes.append(
            f"nobody told the torque constant: every torque here is in {unit} of the motor, and what is in "
            f"{unit} s/rad would be a damping; `ffc-id calibrate` finds the constant from a known load."
        )
    if recording.by_voltage and not axis.back_emf_damping:
        notes.append(
            "the effort is the voltage at the motor: its back-EMF is in the viscous coefficient, as one with "
            "viscous friction; resistance_ohm in [axis] would split it off. Row by row a duty tells little "
            "of the torque: `ffc-id fit-motion` fits the motion itself."
        )
    return notes


def _about_lags(fit: JointFit) -> list[str]:
    lags = [effect.title.lower() for effect in fit.model.spec.effects if effect.is_lag]
    if not lags or fit.model.recording.position_resolution > 0.0:
        return []
    return [
        f"no position was logged, and a speed that a drive filters makes {' and '.join(lags)} where none is, "
        "and pulls at inertia and bristle damping: log the position to be sure of them."
    ]


def _about_friction(fit: JointFit) -> list[str]:
    static, dynamic = static_parameters(fit), dynamic_parameters(fit)
    notes = []
    if fit.model.spec.friction != "coulomb" and static["static"].identified:
        falls = static["static"].value > static["coulomb"].value
        notes.append(
            "the Stribeck curve falls from stiction to the Coulomb level with speed."
            if falls
            else "the Stribeck curve RISES with speed: the stiction is below the Coulomb level."
        )
    if fit.model.spec.friction == "lugre" and (sentence := passivity(static, dynamic)):
        notes.append(sentence)
    return notes
