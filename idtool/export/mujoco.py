"""MuJoCo: an MJCF file of one joint, with LuGre friction where the parameter file has it.

Since version 3.7 MuJoCo's `dcmotor` actuator has LuGre friction, in the same form as here (Canudas de Wit
et al. 1995); since 3.12 it takes a torque (`input="ff"`), which the drive delivers exactly. Coulomb and
viscous friction are `frictionloss` and `damping` of the joint, whose second coefficient is quadratic drag.
Reference: https://mujoco.readthedocs.io, XML reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import final
from xml.etree import ElementTree as ET

from idtool.export.base import Plan, Target, number
from idtool.export.joint import inertia_of, simulated
from idtool.export.simple import has_bristle
from idtool.export.xml_text import document
from idtool.log import Log
from idtool.model.units import Units, radians_per_unit
from idtool.parameters import EffectEntry, Parameter, Parameters

#: With MuJoCo's default (0.02 s) dry friction comes to its level only at some 0.2 rad/s; this is the least
#: that it takes, twice the time step.
_SOLREF, _STEP = "0.002 1", "0.001"
#: A body must have some mass; where the file holds the inertia the body has next to none.
_LIGHT, _PLACEHOLDER = 1e-6, 1e-3


@final
class Mujoco(Target):
    name = "mujoco"
    title = "MuJoCo (MJCF)"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        plan = simulated(parameters, logs, friction, _carries, bristle=True)
        notes = list(plan.notes)
        if has_bristle(plan.model) or plan.model.effect("position_ripple"):
            notes.append('needs MuJoCo 3.12 or newer (dcmotor with input="ff"); ctrl is a torque')
        if not has_bristle(plan.model):
            notes.append(
                "MuJoCo's frictionloss is a soft constraint, which creeps at rest; solreffriction is as "
                "stiff as the time step allows"
            )
        if plan.model.effect("inertia"):
            notes.append("armature is ALL of the identified inertia; take off what your bodies have")
        return replace(plan, notes=tuple(notes))

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        model = plan.model
        kind = "hinge" if model.axis.kind == "rotary" else "slide"
        inertia = number(_LIGHT if inertia_of(model) else _PLACEHOLDER)
        root = ET.Element("mujoco", model=joint)
        ET.SubElement(root, "compiler", angle="radian")
        ET.SubElement(root, "option", timestep=_STEP, integrator="implicitfast", gravity="0 0 0")
        body = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name=f"{joint}_body")
        ET.SubElement(body, "joint", {"name": joint, "type": kind, "axis": "0 0 1"} | _joint(model))
        ET.SubElement(body, "inertial", pos="0 0 0", mass=inertia, diaginertia=" ".join([inertia] * 3))
        element, attributes = _actuator(model)
        named = {"name": f"{joint}_motor", "joint": joint} | attributes
        ET.SubElement(ET.SubElement(root, "actuator"), element, named)
        return document(root, remarks)


def _joint(model: Parameters) -> dict[str, str]:
    """Attributes of the joint; those that would be zero are left out."""
    static = model.static
    damping = number(static["viscous"].value)
    if drag := model.effect("nonlinear_viscous"):
        damping += f" {number(drag.values()['quadratic'])}"
    result = {"damping": damping}
    if not has_bristle(model):
        result |= {"frictionloss": number(static["coulomb"].value), "solreffriction": _SOLREF}
    if inertia := inertia_of(model):
        result["armature"] = number(inertia)
    if spring := model.effect("position_stiffness"):
        result["stiffness"] = number(spring.values()["stiffness"])
        result["springref"] = number(spring.values()["neutral"])
    return result


def _actuator(model: Parameters) -> tuple[str, dict[str, str]]:
    """The actuator, whose ctrl is a torque (a force) at the joint, and its attributes."""
    ripple = model.effect("position_ripple")
    if not has_bristle(model) and not ripple:
        return "motor", {}
    # the resistance only matters where the voltage is limited, and here it is not
    constant = model.axis.torque_constant or 1.0
    attributes = {"input": "ff", "motorconst": number(constant), "resistance": "1.0"}
    if has_bristle(model):
        order = ("bristle_stiffness", "bristle_damping", "coulomb", "static", "stribeck_velocity")
        values = model.static | model.dynamic
        attributes["lugre"] = " ".join(number(values[name].value) for name in order)
    if ripple:
        amplitude, cycles, phase = _cogging(ripple, model.axis.kind)
        # cogging acts on the joint; the ripple here is what the motor must add against it
        attributes["cogging"] = f"{number(-amplitude)} {number(cycles)} {number(phase)}"
    return "dcmotor", attributes


def _cogging(ripple: EffectEntry, kind: Units) -> tuple[float, float, float]:
    """Amplitude, n of sin(n q) and phase of the one harmonic that the ripple has."""
    values = ripple.values()
    k = 1 if values["amplitude_1"] else 2
    n = k * values["cycles"] * radians_per_unit("spatial_frequency", kind)
    return values[f"amplitude_{k}"], n, values[f"phase_{k}"]


def _carries(entry: EffectEntry) -> tuple[EffectEntry | None, str | None]:
    if entry.name == "position_ripple":
        return _larger_harmonic(entry)
    if entry.name == "position_stiffness" and entry.values()["stiffness"] <= 0:
        return None, "position stiffness below zero, which a MuJoCo joint does not have"
    known = ("inertia", "nonlinear_viscous", "position_stiffness")
    return (entry, None) if entry.name in known else (None, None)


def _larger_harmonic(entry: EffectEntry) -> tuple[EffectEntry, str | None]:
    """The ripple with its larger harmonic only; an actuator has one."""
    values = entry.values()
    small = 2 if values["amplitude_1"] >= values["amplitude_2"] else 1
    name = f"amplitude_{small}"
    if not values[name]:
        return entry, None
    kept = EffectEntry(entry.name, entry.parameters | {name: Parameter(0.0)})
    which = "second harmonic" if small == 2 else "fundamental"
    return kept, f"the {which} of the position ripple, of amplitude {values[name]:.3g} (cogging has one)"
