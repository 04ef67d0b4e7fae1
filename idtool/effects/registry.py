"""Every effect that the tool knows, simplest first (the order breaks ties)."""

from __future__ import annotations

from idtool.effects.backlash import Backlash
from idtool.effects.base import Effect
from idtool.effects.breakaway_dwell import BreakawayDwell
from idtool.effects.compliance import Compliance
from idtool.effects.direction_asymmetry import DirectionAsymmetry
from idtool.effects.drive_backdrive import DriveBackdrive
from idtool.effects.external_periodic import ExternalPeriodic
from idtool.effects.hysteresis import Hysteresis
from idtool.effects.inertia import Inertia
from idtool.effects.load_dependent_friction import LoadDependentFriction
from idtool.effects.nonlinear_viscous import NonlinearViscous
from idtool.effects.position_dependent_friction import PositionDependentFriction
from idtool.effects.position_ripple import PositionRipple
from idtool.effects.position_stiffness import PositionStiffness
from idtool.effects.stribeck_shape import StribeckShape
from idtool.effects.thermal_drift import ThermalDrift
from idtool.effects.tilt_misalignment import TiltMisalignment
from idtool.effects.torque_constant_saturation import TorqueConstantSaturation
from idtool.effects.torque_offset import TorqueOffset
from idtool.effects.transport_delay import TransportDelay
from idtool.errors import InputError, nearest

_LIBRARY: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        Inertia(),
        TorqueOffset(),
        DirectionAsymmetry(),
        NonlinearViscous(),
        TransportDelay(),
        TorqueConstantSaturation(),
        StribeckShape(),
        LoadDependentFriction(),
        DriveBackdrive(),
        TiltMisalignment(),
        PositionStiffness(),
        PositionDependentFriction(),
        Hysteresis(),
        Backlash(),
        Compliance(),
        BreakawayDwell(),
        ThermalDrift(),
        PositionRipple(),
        ExternalPeriodic(),
    )
}


def names() -> tuple[str, ...]:
    """The names, as files use them."""
    return tuple(_LIBRARY)


def library() -> tuple[Effect, ...]:
    """All effects, simplest first."""
    return tuple(_LIBRARY.values())


def get(name: str) -> Effect:
    """The effect of that name.

    Raises:
        InputError: no such effect; the sentence suggests the nearest.
    """
    if name not in _LIBRARY:
        raise InputError(f"unknown effect {name!r}", remedy=nearest(name, _LIBRARY))
    return _LIBRARY[name]
