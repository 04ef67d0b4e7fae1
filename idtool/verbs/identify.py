"""All fits and the diagnosis in one go.

result = identify([Log.read("gravity.csv"), Log.read("sweep.csv"), Log.read("sine.csv")])
result.parameters.write("params.toml")
result.diagnosis["verdict"]
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from idtool.diagnosis.diagnose import diagnose
from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.errors import InputError
from idtool.fit.choose import GRAVITY_CHOICES, other_loads, payloads_of
from idtool.fit.drive import fit_drive
from idtool.fit.findings import findings
from idtool.fit.known_load import Calibration, calibrate_by_axis
from idtool.fit.spec import FRICTION_KINDS
from idtool.log import Log
from idtool.parameters import Parameters
from idtool.parameters.drive import Drive
from idtool.parameters.rows import rows_of
from idtool.parameters.scaling import with_constant
from idtool.signals import record
from idtool.verbs.base_model import base_model, check_choice, low_pass_of
from idtool.verbs.fit_motion import fit_motion
from idtool.verbs.identification import Identification
from idtool.verbs.predict import predict, refuse_other_axis

#: `--friction coulomb` asks for the textbook model, to be compared with published ones: these effects
#: belong to it, and no others are looked for.
TEXTBOOK_EFFECTS = ("inertia", "torque_offset")

#: Sentences on what is going on that say how far it is (`idtool.verbs.expected`).
READING, SEARCHING = "reading the motion", "searching the friction parameters"
#: What the file may be fitted to.
WEIGHED = ("torque", "position")

_NOTHING = (
    "these logs determine no parameter at all: the numbers are those of a fit to little but noise, or to "
    "something that the model does not know; look at the logs with `ffc-id plot` first."
)
_OF_THE_POSITION = (
    "the parameter file was fitted to the position, as asked for; the errors of the torque are those of the "
    "fit to the torque before it."
)


def identify(
    logs: Sequence[Log],
    *,
    seed: int = 0,
    friction: str = "lugre",
    gravity: str = "auto",
    optimizer: str = "direct",
    effects: Sequence[Effect] = (),
    without: Sequence[str] = (),
    tolerance: float | None = None,
    validate: Sequence[Log] = (),
    known_load: bool = False,
    weigh: str = "torque",
    tell: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Identify gravity, friction and the effects that the base model lacks.

    Args:
        logs: logs of one axis, any experiments.
        seed: of the stochastic optimisers; the default one is deterministic.
        friction: "lugre", "stribeck" or "coulomb"; where the data cannot carry it the law steps down.
            "coulomb" is the textbook model (inertia, offset, Coulomb, viscous): no further effects are
            looked for.
        gravity: "auto", "slide", "arm" or "none".
        optimizer: "direct", "crs2", "isres" or "esch".
        effects: of your own, to compete with those of the library; this process knows them from then on.
        without: names of effects that are not to be considered.
        tolerance: error that is good enough, per cent of the torque (rms): once it is reached no further
            effects are looked for, and nothing that is left below it counts as unexplained.
        validate: logs of the same axis, to be predicted with the result; no fit sees them.
        known_load: find the torque constant (or torque per volt) from the load that the logs tell,
            payload_kg on a `lever_m`, or `mass_kg` on it ([axis]); every parameter carries its error then.
        weigh: "torque", or "position": the file is fitted to the simulated position at the end
            (`idtool.verbs.fit_motion`); the diagnosis stays that of the torque.
        tell: called with a sentence on what is going on.

    Raises:
        InputError: an unknown option, an effect that lacks something, or logs that cannot be used.
    """
    own = tuple(map(registry.add, effects))
    registry.refuse_unknown(without)
    _refuse_seen(logs, validate)
    law = check_choice("friction", friction, FRICTION_KINDS)
    check_choice("weigh", weigh, WEIGHED)
    check_choice("gravity", gravity, GRAVITY_CHOICES)
    goal, asked = _tolerated(tolerance)
    options = {"friction": friction, "gravity": gravity, "optimizer": optimizer, "seed": seed, **asked}
    options |= {"without": list(without)} if without else {}
    calibration = None
    if known_load:
        tell("finding the constant from the known load")
        calibration = calibrate_by_axis(logs)
        logs, validate = (_with_constant(some, calibration) for some in (logs, validate))
        # a load that is known is that of an arm or of a slide
        known = calibration.fit.model.spec.gravity
        gravity = known if gravity == "auto" and known else gravity
    tell(READING)
    recording = record(logs)
    if calibration is not None and gravity == "arm" and payloads_of(recording):
        raise other_loads(recording)
    tell(SEARCHING)
    based = partial(
        base_model, law=law, gravity=gravity, optimizer=optimizer, seed=seed, without=without, tell=tell
    )
    library, left_out = _considered(law, own, without)
    search = partial(diagnose, library=library, tell=tell, given=law == "coulomb", tolerance=goal)
    base = based(recording)
    evidence = search(base.recording, base.fits)
    # what the base model lacked may have hidden a low-pass from it, which a delay then stands for
    if low_pass := low_pass_of(evidence.selection.fit, base.recording, tell):
        base = based(recording.through(low_pass).without_what_was_before())
        evidence = search(base.recording, base.fits)
    why, reasons = base.stepped_down[evidence.start]
    result = Identification(
        base.recording,
        evidence,
        [*recording.contradictions, *base.notes, *left_out, *why, *findings(evidence.final)],
        options,
        [*reasons, *evidence.stepped_down],
        drive=_drive_of(logs),
        calibration=calibration,
        logs=tuple(logs),
    )
    if not any(row.parameter.identified for row in rows_of(result.parameters)):
        result.notes.insert(0, _NOTHING)
    if calibration is not None:
        result.notes.extend(calibration.notes)
    if weigh == "position":
        options["weigh"] = weigh
        result.notes.append(_OF_THE_POSITION)
        result = replace(result, motion=fit_motion(logs, result.parameters, tell=tell))
    if not validate:
        return result
    tell("predicting the logs to validate with")
    return replace(result, validation=predict(validate, result.parameters))


def _tolerated(tolerance: float | None) -> tuple[float, dict[str, float]]:
    """The error that is good enough, as a share, and how the options tell it."""
    if tolerance is None:
        return 0.0, {}
    if not 0.0 <= tolerance < 100.0:
        raise InputError(
            f"is {tolerance:g} %",
            argument="tolerance",
            remedy="give per cent of the torque, from 0 up to 100",
        )
    return 0.01 * tolerance, {"tolerance_percent": tolerance}


def _considered(
    law: str, own: Sequence[Effect], without: Sequence[str]
) -> tuple[tuple[Effect, ...], list[str]]:
    """The effects that are looked for, and what is to say of those that are not."""
    library = tuple(effect for effect in (*registry.library(), *own) if effect.name not in without)
    notes = [f"left out as asked: {', '.join(without)}."] if without else []
    if law != "coulomb":
        return library, notes
    notes.append("friction coulomb is the textbook model: no effects but inertia and offset were looked for.")
    return tuple(effect for effect in library if effect.name in TEXTBOOK_EFFECTS), notes


def _with_constant(logs: Sequence[Log], calibration: Calibration) -> list[Log]:
    """The logs with the constant in place of what they tell of it."""
    bare = [replace(log.axis, torque_constant=None, torque_per_volt=None, resistance=None) for log in logs]
    return [
        replace(log, axis=with_constant(axis, calibration.constant, calibration.unit))
        for log, axis in zip(logs, bare, strict=True)
    ]


def _refuse_seen(logs: Sequence[Log], validate: Sequence[Log]) -> None:
    """A log that is fitted says nothing about how well others are predicted."""
    fitted = {os.path.realpath(log.source) for log in logs if log.source}
    for log in validate:
        if log.source and os.path.realpath(log.source) in fitted:
            raise InputError(
                "is among the logs that are fitted",
                file=log.source,
                argument="validate",
                remedy="leave it out of one of the two",
            )


def _drive_of(logs: Sequence[Log]) -> Drive | None:
    """The position loop of the servo, where all logs tell its goal and it can be found."""
    if any(log.column("position_command") is None for log in logs):
        return None
    try:
        return fit_drive(logs)
    except InputError:  # what was commanded is not what drives the motor, or its drive is never on
        return None


def diagnose_from(
    logs: Sequence[Log],
    known: Parameters,
    *,
    friction: str = "lugre",
    seed: int = 0,
    without: Sequence[str] = (),
    tolerance: float | None = None,
    validate: Sequence[Log] = (),
    tell: Callable[[str], None] = lambda _: None,
) -> Identification:
    """Diagnose the model of a parameter file on logs; the options are those of `identify`.

    The file gives the gravity model and, where it says that the friction law stepped down, that law;
    parameters are fitted anew on the training trials, since a diagnosis must not see the others.

    Raises:
        InputError: the file holds no friction, or the logs are of another axis.
    """
    if not known.static:
        raise InputError(
            "the parameter file has no [friction.static]",
            remedy="run ffc-id fit-static first, or ffc-id identify",
        )
    refuse_other_axis([*logs, *validate], known.axis)
    law = friction if known.dynamic or friction != "lugre" else "stribeck"
    gravity = known.gravity_model or "auto"
    return identify(
        logs,
        seed=seed,
        friction=law,
        gravity=gravity,
        without=without,
        tolerance=tolerance,
        validate=validate,
        tell=tell,
    )
