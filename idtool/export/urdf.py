"""URDF: a robot of one joint with `<dynamics>`, which knows viscous and Coulomb friction only.

Reference: https://wiki.ros.org/urdf/XML/joint. Not every program that reads URDF uses `<dynamics>`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import final
from xml.etree import ElementTree as ET

from idtool.export.base import Plan, Target, number
from idtool.export.joint import inertia_alone, inertia_of, simulated
from idtool.export.xml_text import document
from idtool.log import Log
from idtool.parameters import Parameters

#: Mass, kg, and inertia, kg m^2, that a link must have where none is known: simulators refuse a link without.
_PLACEHOLDER = 1e-3


@final
class Urdf(Target):
    name = "urdf"
    title = "URDF"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        plan = simulated(parameters, logs, friction, inertia_alone, bristle=False)
        if plan.model.effect("inertia") is None:
            return plan
        note = "the link's inertial is ALL of the identified inertia, that of the load included"
        return replace(plan, notes=(*plan.notes, note))

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        static = plan.model.static
        inertia = inertia_of(plan.model) or _PLACEHOLDER
        rotary = plan.model.axis.kind == "rotary"
        moment = number(inertia if rotary else _PLACEHOLDER)
        root = ET.Element("robot", name=joint)
        ET.SubElement(root, "link", name=f"{joint}_base")
        inertial = ET.SubElement(ET.SubElement(root, "link", name=f"{joint}_link"), "inertial")
        ET.SubElement(inertial, "mass", value=number(_PLACEHOLDER if rotary else inertia))
        moments = dict.fromkeys(("ixx", "iyy", "izz"), moment) | dict.fromkeys(("ixy", "ixz", "iyz"), "0.0")
        ET.SubElement(inertial, "inertia", moments)
        element = ET.SubElement(root, "joint", name=joint, type="continuous" if rotary else "prismatic")
        ET.SubElement(element, "parent", link=f"{joint}_base")
        ET.SubElement(element, "child", link=f"{joint}_link")
        # a slide lies flat: gravity would act on a mass that stands for an inertia
        ET.SubElement(element, "axis", xyz="0 0 1" if rotary else "1 0 0")
        if not rotary:  # a prismatic joint must have limits; these are no more than a place for yours
            ET.SubElement(element, "limit", lower="-1.0", upper="1.0", effort="1000.0", velocity="10.0")
        friction = {"damping": static["viscous"].value, "friction": static["coulomb"].value}
        ET.SubElement(element, "dynamics", {key: number(value) for key, value in friction.items()})
        return document(root, remarks, declaration=True)
