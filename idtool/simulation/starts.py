"""Where the search for the motion starts: a regression, and what a gearbox makes of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from idtool.fit.choose import choose_gravity, weightless
from idtool.fit.spec import Scales as FitScales
from idtool.model import gravity
from idtool.parameters import GRAVITY_MODELS, EffectEntry, Parameter, Parameters
from idtool.parameters.drive import Drive
from idtool.signals import Recording
from idtool.simulation.coordinates import Scales

#: Effects that differ between the directions; a regression starts with them at zero.
SIDES = (("torque_offset", "offset"), ("direction_asymmetry", "asymmetry"))
#: An axis that swings over more may be a pendulum, rad.
_LEAST_SWING = 0.3
#: Friction over load, bend, and speed at which stiction fades over the top speed. A curve that falls within
#: the slowest motion and one that falls over all of it are two minima, and no step leads between them.
_GEARBOXES = ((0.3, 0.3, 0.2), (0.1, 0.1, 0.2), (0.3, 0.8, 0.05))


def regress(recording: Recording) -> Parameters:
    """Gravity, inertia, Coulomb and viscous friction by linear regression on the moving rows."""
    motion = recording.motion
    model, names = choose_gravity(recording, "auto")
    if model is None and recording.axis.kind == "rotary" and np.ptp(motion.position) >= _LEAST_SWING:
        model, names = choose_gravity(
            recording, "arm"
        )  # too little for a test of the torque, not of the motion
    columns = [np.sign(motion.velocity), motion.velocity, motion.acceleration]
    known = tuple(GRAVITY_MODELS[model]) if model else ()
    pull = gravity.columns(model, motion) if model else np.zeros((len(motion), 0))
    pull = pull[:, [known.index(name) for name in names]]
    regressors = recording.filtered(np.column_stack([*columns, pull]))
    target = recording.filtered_torque - recording.filtered(motion.braking)
    found = np.linalg.lstsq(regressors, target, rcond=1e-10)[0]
    scales = scales_of(recording)
    coulomb = max(float(found[0]), 0.01 * scales.torque)
    told = dict(zip(names, found[3:].tolist(), strict=True))
    return Parameters(
        axis=recording.axis,
        gravity_model=model,
        gravity={name: Parameter(value) for name, value in told.items()},
        weightless=weightless(recording, model),
        static={
            "coulomb": Parameter(coulomb),
            "static": Parameter(coulomb),
            "stribeck_velocity": Parameter(0.1 * scales.velocity),
            "viscous": Parameter(max(float(found[1]), 0.01 * scales.of("damping"))),
        },
        effects=(
            EffectEntry("inertia", {"inertia": Parameter(max(float(found[2]), 0.01 * scales.of("inertia")))}),
            *(EffectEntry(effect, {name: Parameter(0.0)}) for effect, name in SIDES),
        ),
    )


def scales_of(recording: Recording) -> Scales:
    """Typical sizes of what was recorded."""
    motion = recording.motion
    return Scales(
        float(np.sqrt(np.mean(recording.torque**2))),
        max(float(np.quantile(np.abs(motion.velocity), 0.98)), 1e-9),
        max(float(np.ptp(motion.position)), 1e-9),
        FitScales.of(recording).slowest,
    )


def starts_of_a_gearbox(
    first: Parameters, recording: Recording, scales: Scales, *, drive_was_off: bool
) -> list[Parameters]:
    """Starts with what a servo has between duty and motion: friction that its gears take of the load, a
    line from duty to torque that bends, back-EMF that is gone where the drive is off, if it ever was."""
    plain = first
    if recording.by_voltage:
        drive = first.drive or Drive("duty")
        half = Parameter(0.5 * first.static["viscous"].value) if drive_was_off else None
        drive = replace(
            drive,
            bend=drive.bend or Parameter(0.05),
            dead_band=drive.dead_band or Parameter(0.005),
            back_emf=drive.back_emf or half,
        )
        plain = replace(first, drive=drive)
    if first.gravity_model is None:
        return [plain] if recording.by_voltage else []
    load = max(math.hypot(*(one.value for one in first.gravity.values())), 0.1 * scales.torque)
    found = []
    for share, bend, fading in _GEARBOXES:
        friction = 0.02 * load
        static = {
            **first.static,
            "coulomb": Parameter(friction),
            "static": Parameter(friction),
            "stribeck_velocity": Parameter(fading * scales.velocity),
        }
        entry = {"mu": Parameter(0.1), "doubling_load": Parameter(friction / share)}
        start_here = replace(plain, static=static)
        if plain.drive is not None and plain.drive.bend is not None:
            start_here = replace(start_here, drive=replace(plain.drive, bend=Parameter(bend)))
        found.append(start_here.with_effect(EffectEntry("load_dependent_friction", entry)))
    return found
