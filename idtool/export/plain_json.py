"""JSON: the whole parameter file under `parameters`, for programs that read no TOML."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import final

from idtool.export.base import Plan, Target
from idtool.log import Log
from idtool.parameters import Parameters


@final
class PlainJson(Target):
    name = "json"
    title = "JSON"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        return Plan(parameters)

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        document = {"name": joint, "remarks": list(remarks), "parameters": plan.model.to_document()}
        return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False, default=str) + "\n"
