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
from idtool.diagnosis.weights import weighed
from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.errors import InputError, nearest
from idtool.fit.choose import (
    CLEAR_EVIDENCE,
    GRAVITY_CHOICES,
    choose_gravity,
    first_fit,
    first_fits,
    other_loads,
    payloads_of,
    step_down,
)
from idtool.fit.drive import fit_drive
from idtool.fit.findings import findings
from idtool.fit.joint import JointFit, gain_in_evidence, refit
from idtool.fit.known_load import Calibration, calibrate_by_axis
from idtool.fit.model import JointModel
from idtool.fit.own_filter import behind_own_filter, filtered_before
from idtool.fit.restart import worth_a_restart
from idtool.fit.shortcoming import Shortcoming
from idtool.fit.spec import FRICTION_KINDS, FrictionKind, Spec
from idtool.log import Log
from idtool.parameters import Parameters
from idtool.parameters.drive import Drive
from idtool.parameters.rows import rows_of
from idtool.parameters.scaling import with_constant
from idtool.signals import Recording, record
from idtool.signals.own_filter import OwnFilter
from idtool.signals.thin import thin
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
    if tolerance is not None and not 0.0 <= tolerance < 100.0:
        raise InputError(
            f"is {tolerance:g} %",
            argument="tolerance",
            remedy="give per cent of the torque, from 0 up to 100",
        )
    _refuse_seen(logs, validate)
    law = check_choice("friction", friction, FRICTION_KINDS)
    check_choice("weigh", weigh, WEIGHED)
    check_choice("gravity", gravity, GRAVITY_CHOICES)
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
    base = partial(begin, law=law, gravity=gravity, optimizer=optimizer, seed=seed, without=without)
    starts, notes, stepped = base(thin(recording))
    if filtered_before(recording):
        tell("finding the low-pass that the torque went through")
        if found := _through_own_filter(recording, starts, base):
            low_pass, (starts, notes, stepped) = found
            recording = recording.through(low_pass)
            notes.append(
                "the torque went through a low-pass before it was logged, without delay (half of it passes "
                f"at {low_pass.corner_hz:.3g} Hz); what the model predicts goes through the same."
            )
    library = tuple(effect for effect in (*registry.library(), *own) if effect.name not in without)
    if without:
        notes.append(f"left out as asked: {', '.join(without)}.")
    if law == "coulomb":
        library = tuple(effect for effect in library if effect.name in TEXTBOOK_EFFECTS)
        notes.append(
            "friction coulomb is the textbook model: no effects but inertia and offset were looked for."
        )
    evidence = diagnose(
        recording, starts, library, tell, given=law == "coulomb", tolerance=0.01 * (tolerance or 0.0)
    )
    why, reasons = stepped[evidence.start]
    reasons = [*reasons, *evidence.stepped_down]
    notes = [*recording.contradictions, *notes, *why, *findings(evidence.final)]
    options = {"friction": friction, "gravity": gravity, "optimizer": optimizer, "seed": seed}
    options |= {"without": list(without)} if without else {}
    options |= {} if tolerance is None else {"tolerance_percent": tolerance}
    goals = all(log.column("position_command") is not None for log in logs)
    drive = _drive_of(logs) if goals else None
    result = Identification(
        recording, evidence, notes, options, reasons, drive=drive, calibration=calibration, logs=tuple(logs)
    )
    if not any(row.parameter.identified for row in rows_of(result.parameters)):
        notes.insert(
            0,
            "these logs determine no parameter at all: the numbers are those of a fit to little but noise, "
            "or to something that the model does not know; look at the logs with `ffc-id plot` first.",
        )
    if calibration is not None:
        notes += calibration.notes
    if weigh == "position":
        options["weigh"] = weigh
        motion = fit_motion(logs, result.parameters, tell=tell)
        notes.append(
            "the parameter file was fitted to the position, as asked for; the errors of the torque are those "
            "of the fit to the torque before it."
        )
        result = replace(result, motion=motion)
    if not validate:
        return result
    tell("predicting the logs to validate with")
    return replace(result, validation=predict(validate, result.parameters))


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
    try:
        return fit_drive(logs)
    except InputError:  # what was commanded is not what drives the motor, or its drive is never on
        return None


#: Fits of the base model, notes on all of them, and of each why it stepped down (notes, what the data lack).
Begun = tuple[list[JointFit], list[str], list[tuple[list[str], list[Shortcoming]]]]


def _through_own_filter(
    recording: Recording, starts: Sequence[JointFit], base: Callable[[Recording], Begun]
) -> tuple[OwnFilter, Begun] | None:
    """The low-pass of the logs, if the base model is clearly better behind one, and the fits behind it."""
    best = _best(starts)
    own, fit = behind_own_filter(best)
    # what hides more noise than all that was read is none: it stands for a torque that is as smooth as that
    hidden = fit.model.recording.noise > recording.torque_size
    if hidden or gain_in_evidence(best, fit) <= CLEAR_EVIDENCE:
        return None
    return own, base(thin(recording.through(own)))


def _best(fits: Sequence[JointFit]) -> JointFit:
    return min(fits, key=lambda fit: fit.sse)


def begin(
    recording: Recording,
    law: str,
    gravity: str,
    *,
    optimizer: str = "direct",
    seed: int = 0,
    without: Sequence[str] = (),
) -> Begun:
    """Fits of the base model that the data can carry (`first_fits`); where LuGre leaves more than noise, the
    last one is without presliding: a bristle may bend for what the model lacks."""
    kind: FrictionKind = check_choice("friction", law, FRICTION_KINDS)  # type: ignore[assignment]
    if not recording.motion.velocity.any():
        raise InputError(
            "nothing moves", file=", ".join(recording.sources), remedy="record the axis while it moves"
        )
    model, columns = choose_gravity(recording, gravity)
    notes = []
    if model == "slide" and "base" not in columns:
        notes.append(
            "gravity never acts without payload: its base is not determined; add a run that stands upright."
        )
    inertia = registry.get("inertia")
    has_inertia = inertia.name not in without and not inertia.missing(recording.motion)
    spec = Spec(kind, model, columns, (inertia,) if has_inertia else ())
    search = partial(first_fits, spec=spec, optimizer=optimizer, seed=seed)
    fits = search(recording)
    # rows near standstill that follow no law would have the say in what the sliding ones show
    if (rows := weighed(recording, fits[0], unsure=law != "coulomb")) is not recording:
        fits = search(rows)
    stepped = [step_down(fit) for fit in fits]
    if stepped[0][0].model.spec.friction == "lugre" and worth_a_restart(fits[0]):
        static = replace(spec, friction="stribeck")
        rigid, why, reasons = step_down(first_fit(rows, static, optimizer=optimizer, seed=seed))
        why = ["no presliding is modelled: what was found predicts better without LuGre's.", *why]
        stepped.append((rigid, why, reasons))
    starts = [_bare(fit, spec) for fit, _, _ in stepped]
    return starts, notes, [(why, reasons) for _, why, reasons in stepped]


def _bare(fit: JointFit, spec: Spec) -> JointFit:
    """The fit without what only helped the search."""
    kept = replace(fit.model.spec, effects=spec.effects)
    return refit(fit, JointModel.build(fit.model.recording, kept, fit.model.constants))


def check_choice(argument: str, value: str, known: Sequence[str]) -> str:
    """The value, if it is one of the known ones.

    Raises:
        InputError: it is not; the sentence suggests the nearest.
    """
    if value not in known:
        raise InputError(f"unknown {argument} {value!r}", argument=argument, remedy=nearest(value, known))
    return value


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
