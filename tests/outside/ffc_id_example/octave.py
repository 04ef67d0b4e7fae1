"""A script of Octave and MATLAB with the values of a model."""

from collections.abc import Sequence
from typing import final

from idtool.export.base import Plan, Target, number
from idtool.log import Log
from idtool.parameters import Parameters


@final
class Octave(Target):
    name = "octave"
    title = "Octave and MATLAB"

    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        lost = [f"the effect {entry.name.replace('_', ' ')}" for entry in parameters.effects]
        return Plan(parameters, tuple(lost), ("values only: your script has to compute the model",))

    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        values = plan.model.gravity | plan.model.static | plan.model.dynamic
        lines = [f"% {remark}" for remark in remarks]
        lines += [f"{joint}.{name} = {number(one.value)};" for name, one in values.items()]
        return "\n".join(lines) + "\n"
