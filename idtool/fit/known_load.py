"""The torque constant from a load that is known: a mass on a lever, or payload steps.

A mass m on a lever l pulls with m g l sin q (an arm), or with m g l whatever the angle (a drum of radius
l; on a linear axis with m g). The fit finds the same in A or V, with friction, inertia and the axis' own
gravity free; the ratio of the two is the constant. Where the payload changes, within a log or from one log
to the next, only what is in proportion to it is taken for the load, so that the axis' own weight need not be
known; else all the gravity there is must be the load's.

Source: Gautier & Briot, "Global identification of joint drive gains and dynamic parameters of robots",
J. Dyn. Sys. Meas. Control 136, 2014.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from idtool.effects import registry
from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.errors import InputError
from idtool.fit.choose import choose_gravity, first_fits, step_down
from idtool.fit.joint import JointFit
from idtool.fit.spec import Spec
from idtool.fit.told_load import doubts
from idtool.io.toml import is_finite
from idtool.log import Log
from idtool.log.effort import effort_of
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion
from idtool.model.units import STANDARD_GRAVITY, EffortUnit, Kind
from idtool.parameters import Parameter
from idtool.parameters.axis import constant_key, voltage_key
from idtool.signals import Recording, record
from idtool.signals.thin import thin

#: A pendulum that swings over less than this says little of its weight, rad.
_LEAST_SWING = 0.2
#: An amplitude that is less than so many standard errors is none.
_SEEN = 5.0


@dataclass(frozen=True)
class Calibration:
    """The constant between effort and torque.

    Attributes:
        constant: N m/A or N m/V (N/A, N/V), with its interval.
        unit: what the effort is: "current" (A) or "voltage" (V).
        kind: of the axis.
        load: torque of the known load at its most, N m (N).
        effort: what that takes, A or V.
        fit: the fit behind it.
        notes: sentences that qualify it.
    """

    constant: Parameter
    unit: EffortUnit
    kind: Kind
    load: float
    effort: float
    fit: JointFit
    notes: tuple[str, ...]

    @property
    def key(self) -> str:
        """Of the constant in `[axis]`."""
        return (constant_key if self.unit == "current" else voltage_key)(self.kind)


@final
class _PayloadOnArm(Effect):
    """What a payload pulls on an arm, with the place of its lever free."""

    name = "payload_on_arm"
    title = "Payload on the arm"
    formula = "m (a sin q + b cos q)"
    follows = ("position",)
    reveals = "swings with and without the load"
    citation = "Gautier & Briot 2014"
    needs = ("payload",)
    parameters = (
        EffectParameter("sin", "torque_per_payload", "per kilogram, over the sine"),
        EffectParameter("cos", "torque_per_payload", "per kilogram, over the cosine"),
    )
    coordinates = (Coordinate("sin"), Coordinate("cos"))

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        assert motion.payload is not None
        q = motion.position
        pull = values["sin"] * np.sin(q) + values["cos"] * np.cos(q)
        return Contribution(torque=motion.payload * pull)


def calibrate(logs: Sequence[Log], *, lever: float, mass: float | None = None) -> Calibration:
    """Find the constant.

    Args:
        logs: in which the load moves, with current or with duty and supply; a constant that they tell is
            not used.
        lever: of the load, m; on a linear axis it is not used.
        mass: of the load, kg; None where `payload_kg` tells it.

    Raises:
        InputError: logs of torque, no mass, a load that does not move, none to be seen, or one that no axis
            has.
    """
    stripped = [_without_constant(log) for log in logs]
    recording = record(stripped)
    varies = recording.motion.payload is not None and float(np.ptp(recording.motion.payload)) > 0.0
    if not varies and mass is None:
        raise InputError(
            "no mass was given, and no log has two payloads",
            file=recording.sources[0],
            remedy="pass --mass, or log payload_kg",
        )
    if varies and mass is not None and recording.motion.payload is not None:
        heaviest = float(recording.motion.payload.max())
        if not math.isclose(heaviest, mass, rel_tol=1e-3):
            raise InputError(
                f"payload_kg goes up to {heaviest:g} kg and --mass says {mass:g}",
                file=recording.sources[0],
                remedy="leave --mass out, or correct the column",
            )
    spec, names = _spec(recording, varies)
    fit, notes, _ = step_down(first_fits(thin(recording), spec)[0])
    index = [fit.model.names.index(name) for name in names]
    vector = np.array([fit.values[name] for name in names])
    size = float(np.linalg.norm(vector))
    covariance = fit.covariance[np.ix_(index, index)]
    spread = math.sqrt(max(float(vector @ covariance @ vector), 0.0)) / max(size, 1e-300)
    if size < _SEEN * spread or size == 0.0:
        raise InputError(
            "the load is not to be seen in the effort",
            file=", ".join(recording.sources),
            remedy="move a heavier load, slowly, both ways"
            + ("" if varies or len(logs) == 1 else "; a log without it says so in a column payload_kg (0)"),
        )
    quantile = float(np.max(fit.quantile[index]))
    # per kilogram where the payload varies; the whole of the load else
    pull = (
        STANDARD_GRAVITY
        * (1.0 if recording.axis.kind == "linear" else lever)
        * (1.0 if varies else mass or 0.0)
    )
    constant = pull / size
    interval = (pull / (size + quantile * spread), pull / max(size - quantile * spread, 1e-300))
    payload = recording.motion.payload
    heaviest = float(payload.max()) if varies and payload is not None else 1.0
    notes = [
        *doubts(fit, logs, lever=lever, size=size, constant=constant, load=pull * heaviest),
        *notes,
    ]
    if not varies:
        notes = [
            *notes,
            "all the gravity in these logs was taken for the load's: the axis' own must be small, or logs "
            "with and without the load (payload_kg) would tell the two apart.",
        ]
    return Calibration(
        Parameter(constant, constant * spread / size, interval),
        recording.axis.effort,
        recording.axis.kind,
        pull * heaviest,
        size * heaviest,
        fit,
        (*recording.contradictions, *fit.outcome.notes, *notes),
    )


def calibrate_by_axis(logs: Sequence[Log]) -> Calibration:
    """`calibrate` with the load that the logs tell: payload_kg, or `mass_kg`, on the `lever_m` of `[axis]`.

    Raises:
        InputError: a rotary axis without `lever_m`, a lever without a mass, or what `calibrate` refuses.
    """
    told = logs[0].axis.extra
    lever, mass = told.get("lever_m"), told.get("mass_kg")
    for name, value in (("lever_m", lever), ("mass_kg", mass)):
        if value is not None and not (is_finite(value) and value > 0):
            raise InputError(
                f"expected a number above zero, found {value!r}",
                file=logs[0].source,
                place=f"axis.{name}",
                remedy="correct it",
            )
    if lever is None and logs[0].axis.kind == "rotary":
        raise InputError(
            "does not say how far from the axis the load is",
            file=logs[0].source,
            place="axis.lever_m",
            remedy="write lever_m = 0.1 (metres) into [axis], or into the axis file",
        )
    payloads = [payload for log in logs if (payload := log.column("payload")) is not None]
    varies = payloads and np.ptp(np.concatenate(payloads)) > 0.0
    return calibrate(logs, lever=1.0 if lever is None else float(lever), mass=None if varies else mass)


def _without_constant(log: Log) -> Log:
    bare = replace(log, axis=replace(log.axis, torque_constant=None, torque_per_volt=None, resistance=None))
    if effort_of(bare).unit == "torque":
        raise InputError(
            "holds the torque itself, so there is no constant to find",
            file=log.source,
            remedy="give a log with the current, or with duty and supply voltage",
        )
    return bare


def _spec(recording: Recording, varies: bool) -> tuple[Spec, list[str]]:
    """The model, and the names of the coordinates that are the load's."""
    motion = recording.motion
    inertia = registry.get("inertia")
    # what a payload adds to it looks like less of its weight in a swing, whose acceleration follows its place
    inertia = (*inertia.larger(motion), inertia)[0]
    effects: tuple[Effect, ...] = (inertia,) if inertia.missing(motion) is None else ()
    swings = recording.axis.kind == "rotary" and float(np.ptp(motion.position)) >= _LEAST_SWING
    if varies and not (swings and _as_an_arm(recording)):
        model, columns = choose_gravity(recording, "slide")
        if model is None or "per_payload" not in columns:
            raise _never_moves(recording)
        return Spec("lugre", model, columns, effects), ["gravity.per_payload"]
    if not swings:
        raise _never_moves(recording)
    model, columns = choose_gravity(recording, "arm")
    if not varies:
        return Spec("lugre", model, columns, effects), [f"gravity.{name}" for name in columns]
    names = ["payload_on_arm.sin", "payload_on_arm.cos"]
    return Spec("lugre", model, columns, (*effects, _PayloadOnArm())), names


def _never_moves(recording: Recording) -> InputError:
    way = float(np.ptp(recording.motion.position))
    unit = "m" if recording.axis.kind == "linear" else "rad"
    return InputError(
        f"the load never moves so that its weight shows (the axis goes {way:.2g} {unit}, under one payload)",
        file=", ".join(recording.sources),
        remedy="swing it over a good part of a turn, or move two payloads up and down",
    )


def _as_an_arm(recording: Recording) -> bool:
    """Whether the payload pulls with the sine of the angle rather than with the same everywhere."""
    motion = recording.motion
    assert motion.payload is not None
    target = recording.filtered_torque
    q, w = motion.position, motion.velocity
    plain = [np.sign(w), w, motion.acceleration, np.ones(len(motion)), np.sin(q), np.cos(q)]

    def left(columns: list[Array]) -> float:
        regressors = recording.filtered(np.column_stack([*plain, *columns]))
        solution = np.linalg.lstsq(regressors, target, rcond=1e-10)[0]
        return float(np.sum((target - regressors @ solution) ** 2))

    factor = 1.0 if motion.gravity_factor is None else motion.gravity_factor
    drum = left([motion.payload, motion.payload * factor])
    return left([motion.payload * np.sin(q), motion.payload * np.cos(q)]) < drum
