"""MuJoCo: an MJCF file of one joint, with LuGre friction where the parameter file has it.

Since version 3.7 MuJoCo's `dcmotor` actuator has LuGre friction, in the same form as here (Canudas de Wit et
al. 1995); since 3.12 it takes a torque (`input="ff"`), which the drive delivers exactly. A constant torque is
an actuator with an affine bias and no gain, a second wave of cogging a second motor. Coulomb and viscous
friction are `frictionloss` and `damping` of the joint, whose second coefficient is quadratic drag. Friction
that differs between the directions is `damping` for the easier one, and for the other an actuator whose bias
goes with the speed and whose range of force ends at zero. Reference: https://mujoco.readthedocs.io, XML
reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import final
from xml.etree import ElementTree as ET

from idtool.export.base import Plan, Target, number
from idtool.export.joint import inertia_of, simulated
from idtool.export.xml_text import document
from idtool.log import Log
from idtool.model.units import Units, radians_per_unit
from idtool.parameters import EffectEntry, Parameters

#: With MuJoCo's default (0.02 s) dry friction comes to its level only at some 0.2 rad/s; this is the least
#: that it takes, twice the time step.
_SOLREF, _STEP = "0.002 1", "0.001"
#: A body must have some mass; where the file holds the inertia the body has next to none.
_LIGHT, _PLACEHOLDER = 1e-6, 1e-3
#: Range of a force that is bounded on the other side only, N m (N).
_UNBOUNDED = 1e9
#: Effects that a joint and its actuators have.
_CARRIED = frozenset(
    (
        "direction_asymmetry", "inertia", "nonlinear_viscous", "position_ripple", "position_stiffness",
        "torque_offset",
    )
)  # fmt: skip
#: Numbers of these that they have not, by a part of their names, and what is lost with them.
_PARTS_LOST = {
    "shape_": "position stiffness: its bends over the stroke; the spring is a straight one",
    "turned_": "position ripple: what of it changes sides with the direction of motion",
}


@final
class Mujoco(Target):
    name = "mujoco"
    title = "MuJoCo (MJCF)"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        plan = simulated(parameters, logs, friction, _carries, bristle=True)
        notes = list(plan.notes)
        if plan.model.has_bristle or plan.model.effect("position_ripple"):
            notes.append('needs MuJoCo 3.12 or newer (dcmotor with input="ff"); ctrl is a torque')
        if not plan.model.has_bristle:
            notes.append(
                "MuJoCo's frictionloss is a soft constraint, which creeps at rest; solreffriction is as "
                "stiff as the time step allows"
            )
        if plan.model.effect("inertia"):
            where = "armature" if plan.model.axis.kind == "rotary" else "the mass of the body"
            notes.append(f"{where} is ALL of the identified inertia; take off what your bodies have")
        return replace(plan, notes=tuple(notes))

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        model = plan.model
        kind = "hinge" if model.axis.kind == "rotary" else "slide"
        light = number(_LIGHT if inertia_of(model) else _PLACEHOLDER)
        # on a slide MuJoCo takes the strength of frictionloss from the mass of the body, not from armature
        moved = inertia_of(model) if kind == "slide" else None
        mass = number(moved) if moved else light
        root = ET.Element("mujoco", model=joint)
        ET.SubElement(root, "compiler", angle="radian")
        ET.SubElement(root, "option", timestep=_STEP, integrator="implicitfast", gravity="0 0 0")
        body = ET.SubElement(ET.SubElement(root, "worldbody"), "body", name=f"{joint}_body")
        ET.SubElement(body, "joint", {"name": joint, "type": kind, "axis": "0 0 1"} | _joint(model))
        ET.SubElement(body, "inertial", pos="0 0 0", mass=mass, diaginertia=" ".join([light] * 3))
        actuators = ET.SubElement(root, "actuator")
        for name, element, attributes in _actuators(model):
            ET.SubElement(actuators, element, {"name": f"{joint}_{name}", "joint": joint} | attributes)
        return document(root, remarks)


def _joint(model: Parameters) -> dict[str, str]:
    """Attributes of the joint; those that would be zero are left out."""
    static = model.static
    damping = number(min(_viscous(model)))
    if drag := model.effect("nonlinear_viscous"):
        damping += f" {number(drag.values()['quadratic'])}"
    result = {"damping": damping}
    if not model.has_bristle:
        result |= {"frictionloss": number(static["coulomb"].value), "solreffriction": _SOLREF}
    if (inertia := inertia_of(model)) and model.axis.kind == "rotary":
        result["armature"] = number(inertia)
    if spring := model.effect("position_stiffness"):
        result["stiffness"] = number(spring.values()["stiffness"])
        result["springref"] = number(spring.values()["neutral"])
    return result


def _actuators(model: Parameters) -> list[tuple[str, str, dict[str, str]]]:
    """Name, element and attributes of each: the motor, whose ctrl is a torque (a force) at the joint, first.

    What follows adds what one motor cannot hold, and takes no heed of its own ctrl.
    """
    waves = _cogging(ripple, model.axis.kind) if (ripple := model.effect("position_ripple")) else []
    made = [("motor", *_motor(model, waves[:1]))]
    for index, wave in enumerate(waves[1:], start=2):
        attributes = {"input": "ff", "motorconst": "1.0", "resistance": "1.0"}
        made.append((f"cogging_{index}", "dcmotor", attributes | {"cogging": wave}))
    if offset := model.effect("torque_offset"):
        # what the motor must add against it, so it acts on the joint the other way
        made.append(("bias", "general", _affine(f"{number(-offset.values()['offset'])} 0 0")))
    forwards, backwards = _viscous(model)
    if forwards != backwards:
        # a bias beside the damping of the joint; MuJoCo would read a positive one as a damping ratio
        ends = (-_UNBOUNDED, 0.0) if forwards > backwards else (0.0, _UNBOUNDED)
        bias = _affine(f"0 0 {number(-abs(forwards - backwards))}")
        made.append(("drag", "general", bias | {"forcerange": " ".join(map(number, ends))}))
    return made


def _affine(bias: str) -> dict[str, str]:
    """A torque that is no command's: constant, and per position and speed."""
    return {"gainprm": "0", "biastype": "affine", "biasprm": bias}


def _viscous(model: Parameters) -> tuple[float, float]:
    """Coefficients forwards and backwards; a joint has none below zero."""
    mean = model.static["viscous"].value
    entry = model.effect("direction_asymmetry")
    half = entry.values()["asymmetry"] if entry else 0.0
    return max(mean + half, 0.0), max(mean - half, 0.0)


def _motor(model: Parameters, waves: Sequence[str]) -> tuple[str, dict[str, str]]:
    """The motor with its friction and one wave of its cogging."""
    if not model.has_bristle and not waves:
        return "motor", {}
    # the resistance only matters where the voltage is limited, and here it is not
    constant = model.axis.torque_constant or 1.0
    attributes = {"input": "ff", "motorconst": number(constant), "resistance": "1.0"}
    if model.has_bristle:
        order = ("bristle_stiffness", "bristle_damping", "coulomb", "static", "stribeck_velocity")
        values = model.static | model.dynamic
        attributes["lugre"] = " ".join(number(values[name].value) for name in order)
    if waves:
        attributes["cogging"] = waves[0]
    return "dcmotor", attributes


def _cogging(ripple: EffectEntry, kind: Units) -> list[str]:
    """Amplitude, n of sin(n q) and phase of each wave that the ripple has."""
    values = ripple.values()
    waves = []
    for prefix in (name.removesuffix("cycles") for name in values if name.endswith("cycles")):
        for k in (1, 2):
            if amplitude := values.get(f"{prefix}amplitude_{k}", 0.0):
                n = k * values[f"{prefix}cycles"] * radians_per_unit("spatial_frequency", kind)
                # cogging acts on the joint; the ripple here is what the motor must add against it
                phase = values[f"{prefix}phase_{k}"]
                waves.append(f"{number(-amplitude)} {number(n)} {number(phase)}")
    return waves


def _carries(entry: EffectEntry) -> tuple[EffectEntry | None, str | None]:
    """What of an effect a joint of MuJoCo has."""
    if entry.name == "position_stiffness" and entry.values()["stiffness"] <= 0:
        return None, "position stiffness below zero, which a MuJoCo joint does not have"
    if entry.name not in _CARRIED:
        return None, None
    for part, sentence in _PARTS_LOST.items():
        lost = {name for name, value in entry.values().items() if part in name and value}
        if lost:
            kept = {name: one for name, one in entry.parameters.items() if name not in lost}
            return replace(entry, parameters=kept), sentence
    return entry, None
