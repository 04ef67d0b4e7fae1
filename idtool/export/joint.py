"""What joints of simulators have in common: friction laws, and effects that are or are not attributes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from idtool.effects import registry
from idtool.errors import InputError
from idtool.export import simple
from idtool.export.base import UNCERTAINTY, Plan
from idtool.log import Log
from idtool.model.units import unit_text
from idtool.parameters import EffectEntry, Parameters

#: Friction levels that differ by less than this share of the Coulomb level are one: a file's digits.
LEVELS_ALIKE = 1e-6
#: What is lost with the bristle.
BRISTLE = "the bristle of the LuGre model: presliding, friction lag and break-away"

#: What of an effect a joint has (None: nothing), and a sentence on what is lost (None: nothing, or the usual
#: sentence where the joint has nothing of it).
Carries = Callable[[EffectEntry], tuple[EffectEntry | None, str | None]]


def inertia_alone(entry: EffectEntry) -> tuple[EffectEntry | None, str | None]:
    """For a joint that has no effect but inertia."""
    return (entry, None) if entry.name == "inertia" else (None, None)


def simulated(
    parameters: Parameters, logs: Sequence[Log], friction: str, carries: Carries, *, bristle: bool
) -> Plan:
    """The plan of a joint in a simulator.

    Args:
        parameters: the whole model.
        logs: logs to fit a simplified law to; may be empty.
        friction: "auto" or "coulomb".
        carries: for an effect of the file, what of it the joint has.
        bristle: whether the target has LuGre friction.

    Raises:
        InputError: the file has no friction, or the logs do not fit it.
    """
    if not parameters.static:
        raise InputError(
            "the parameter file holds no friction", place="[friction.static]", remedy="fit it first"
        )
    lost, kept = [], []
    for entry in parameters.effects:
        part, sentence = carries(entry)
        if part:
            kept.append(part)
        if sentence or not part:
            effect = registry.get(entry.name)
            lost.append(sentence or f"{effect.title.lower()}: {effect.formula}")
    whole = replace(parameters, effects=tuple(kept), controller=None)
    notes = []
    if parameters.gravity:
        lost.insert(0, "gravity: the masses of your model carry it; the errors stated here include it")
    if parameters.effect("inertia") is None:
        notes.append("the file holds no inertia, so that of your model's bodies is all there is")
    if bristle and friction == "auto" and parameters.has_bristle:
        return _with_bristle(parameters, whole, logs, lost, notes, carries)
    lost += _law_lost(parameters)
    model, plain = simple.copied(whole), None
    if not logs:
        notes.append("Coulomb and viscous friction were copied; with logs they are fitted to their speeds")
    else:
        anew, top = simple.fitted(whole, logs)
        if simple.nearer(anew, model, logs):
            model, plain = anew, model
            unit = unit_text("velocity", parameters.axis.kind)
            notes.append(
                "Coulomb and viscous friction were fitted to the logs named below, "
                f"for speeds up to {top:.3g} {unit}; they are no physical constants"
            )
        else:
            notes.append("Coulomb and viscous friction stand as in the parameter file; no fit was better")
    return Plan(model, (*lost, UNCERTAINTY), tuple(notes), plain)


def _with_bristle(
    parameters: Parameters,
    whole: Parameters,
    logs: Sequence[Log],
    lost: list[str],
    notes: list[str],
    carries: Carries,
) -> Plan:
    """LuGre friction as it stands, or fitted to the logs where effects are lost and that is better."""
    sentences = (*lost, UNCERTAINTY)
    if not logs or whole.effects == parameters.effects:
        return Plan(whole, sentences, tuple(notes))
    anew, dropped = simple.refitted(whole, logs), []
    while refused := {entry.name for entry in anew.effects if not carries(entry)[0]}:
        # fitted anew, a spring may push: do without it
        fewer = tuple(entry for entry in anew.effects if entry.name not in refused)
        anew = simple.refitted(replace(whole, effects=fewer), logs)
        dropped += [registry.get(name).title.lower() for name in sorted(refused)]
    if simple.nearer(anew, whole, logs):
        notes.append("all but gravity was refitted to the logs named below, since effects are missing here")
        return Plan(anew, (*dropped, *sentences), tuple(notes), whole)
    notes.append("the values stand as in the parameter file; no fit without the missing effects was better")
    return Plan(whole, sentences, tuple(notes))


def _law_lost(parameters: Parameters) -> list[str]:
    lost = []
    static = parameters.static
    if abs(static["static"].value / max(static["coulomb"].value, 1e-12) - 1.0) > LEVELS_ALIKE:
        unit = unit_text("torque", parameters.axis.kind)
        lost.append(
            f"the Stribeck curve: a stiction of {static['static'].value:.4g} {unit} "
            f"beside the Coulomb level of {static['coulomb'].value:.4g} {unit}"
        )
    if parameters.has_bristle:
        lost.append(BRISTLE)
    return lost


def inertia_of(model: Parameters) -> float | None:
    """Identified inertia, kg m² (kg), if the model has it."""
    entry = model.effect("inertia")
    return entry.values()["inertia"] if entry else None
