"""Every effect that the tool knows, simplest first (the order breaks ties)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from functools import cache

from idtool.effects.backlash import Backlash
from idtool.effects.base import FOLLOWED, Effect
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
from idtool.errors import InputError, UnknownNameError, nearest
from idtool.io.entry_points import load, outside
from idtool.model.motion import Motion
from idtool.model.units import SUFFIXES

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


#: The entry points by which other packages add effects.
GROUP = "ffc_id.effects"
_OF_THIS_PROCESS: dict[str, Effect] = {}


def names() -> tuple[str, ...]:
    """The names, as files use them: those of the tool, then those of other packages."""
    return (*_LIBRARY, *outside(GROUP, _LIBRARY), *_OF_THIS_PROCESS)


def knows(name: str) -> bool:
    """Whether there is an effect of that name."""
    return name in _LIBRARY or name in _OF_THIS_PROCESS or name in outside(GROUP, _LIBRARY)


def library() -> tuple[Effect, ...]:
    """All effects of the tool, simplest first, and of installed packages.

    Raises:
        InputError: one of a package cannot be used (see `check`).
    """
    return (*_LIBRARY.values(), *map(_from_outside, outside(GROUP, _LIBRARY)))


def add(effect: Effect) -> Effect:
    """Make an effect known to this process, so that files, report and controller find it by its name.

    Raises:
        InputError: it lacks something (see `check`), or another effect has its name.
    """
    check(effect)
    if effect.name in _LIBRARY or effect.name in outside(GROUP, _LIBRARY):
        raise InputError(f'there is an effect "{effect.name}" already', remedy="give yours another name")
    _OF_THIS_PROCESS[effect.name] = effect
    return effect


def get(name: str) -> Effect:
    """The effect of that name.

    Raises:
        InputError: no such effect; the sentence suggests the nearest.
    """
    found = _LIBRARY.get(name) or _OF_THIS_PROCESS.get(name)
    if found is not None:
        return found
    if name not in outside(GROUP, _LIBRARY):
        raise UnknownNameError(f"unknown effect {name!r}", remedy=nearest(name, names()))
    return _from_outside(name)


def refuse_unknown(without: Iterable[str]) -> None:
    """Refuse what is to be left out and is not there.

    Raises:
        UnknownNameError: no such effect; the sentence suggests the nearest.
    """
    for name in without:
        if not knows(name):
            raise UnknownNameError(
                f"unknown effect {name!r}", argument="without", remedy=nearest(name, names())
            )


@cache
def _from_outside(name: str) -> Effect:
    effect = load(GROUP, name, Effect)
    check(effect)
    if name != effect.name:
        raise InputError(
            f'the entry point "{name}" names the effect "{effect.name}"',
            file="",
            place=GROUP,
            remedy="name both alike",
        )
    return effect


def check(effect: Effect) -> None:
    """Refuse an effect that would fail later, where nobody would think of it.

    Raises:
        InputError: one sentence on the first thing that it lacks.
    """

    def lacks(what: str, remedy: str) -> InputError:
        return InputError(
            f"the effect {getattr(effect, 'name', type(effect).__name__)!r} {what}", file="", remedy=remedy
        )

    for attribute, remedy in _SAID.items():
        if not getattr(effect, attribute, None):
            raise lacks(f"has no {attribute}", remedy)
    if effect.name not in _LIBRARY and not effect.page:
        raise lacks("has no page", "say where it is described for a person who meets it: page = an address")
    for parameter in effect.parameters:
        if parameter.dimension not in SUFFIXES:
            raise lacks(
                f"has no unit for {parameter.name!r}: there is no dimension {parameter.dimension!r}",
                nearest(parameter.dimension, SUFFIXES),
            )
    for words, known, what in (
        (effect.needs, [f.name for f in fields(Motion)], "needs"),
        (effect.follows, FOLLOWED, "follows"),
    ):
        for word in words:
            if word not in known:
                raise lacks(f"{what} {word!r}, which there is not", nearest(word, known))
    if effect.at is None and type(effect).contribute is Effect.contribute:
        raise lacks("has no formula", "write at, or contribute, which says what it adds")
    for form, method, remedy in (
        (effect.at, "numbers", "write numbers, which says what at takes"),
        (effect.over, "acts_on", "write acts_on, which says to which places of FIELDS it adds"),
    ):
        if form is not None and getattr(type(effect), method) is getattr(Effect, method):
            raise lacks(f"has a compiled formula but no {method}", remedy)
    if effect.memory and effect.over is None and type(effect).resume is Effect.resume:
        raise lacks("has a memory but no resume", "write resume, by which the controller goes on row by row")


#: What a class must say of itself -> what to do where it does not.
_SAID = {
    "name": "give it the name that files use",
    "title": "say what a person calls it",
    "formula": "write what it adds, as the report shows it",
    "follows": f"say what it is a function of: {', '.join(FOLLOWED)}",
    "reveals": "say which run shows it best",
    "citation": "say where it is described",
    "parameters": "list its parameters with their dimensions",
    "coordinates": "list the numbers that a fit varies",
}
