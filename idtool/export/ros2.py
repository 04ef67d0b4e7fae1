"""ROS 2: a parameter file (YAML) with every number of the parameter file, for a node of one's own.

Keys are those of the parameter file with their units; a list has no place among ROS 2 parameters, so each
effect is a group by its name. Reference: https://docs.ros.org, "Passing ROS arguments to nodes".
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, final

from idtool.export.base import UNCERTAINTY, Plan, Target, comment_lines, number
from idtool.log import Log
from idtool.parameters import Parameters


@final
class Ros2(Target):
    name = "ros2"
    title = "ROS 2 parameters (YAML)"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        lost = (UNCERTAINTY, "where the numbers come from")
        return Plan(parameters, lost, ("values only: your node has to compute the model",))

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        document = {"/**": {"ros__parameters": {joint: _groups(plan.model)}}}
        return "\n".join([*comment_lines(remarks), *_yaml(document, 0), ""])


def _groups(model: Parameters) -> dict[str, Any]:
    document = model.to_document()
    document.pop("provenance", None)
    document.pop("schema")
    document = {**document.pop("axis"), **document}
    document["effects"] = {e["name"]: e["parameters"] for e in document.get("effects", [])}
    if not document["effects"]:
        del document["effects"]
    return {key: _values(item) if isinstance(item, Mapping) else item for key, item in document.items()}


def _values(table: Mapping[str, Any]) -> Any:
    """A table without what is not the value of a parameter."""
    if "value" in table:
        return table["value"]
    return {key: _values(item) if isinstance(item, Mapping) else item for key, item in table.items()}


def _yaml(table: Mapping[str, Any], depth: int) -> list[str]:
    """Nested mappings as YAML; a float keeps its point, for ROS 2 tells 1 from 1.0."""
    lines = []
    for key, value in table.items():
        name = "  " * depth + (key if key.replace("_", "").isalnum() else json.dumps(key)) + ":"
        if isinstance(value, Mapping):
            lines += [name, *_yaml(value, depth + 1)]
        elif isinstance(value, bool | str):
            lines.append(f"{name} {json.dumps(value)}")
        elif isinstance(value, int | float):
            lines.append(f"{name} {number(float(value))}")
    return lines
