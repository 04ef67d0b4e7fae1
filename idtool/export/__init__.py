"""Parameter files for other programs, each with what it cannot carry and what that costs.

exported = export("mujoco", Parameters.read("params.toml"), [Log.read("sine.csv")])
exported.text, exported.lost, exported.errors
"""

from __future__ import annotations

from idtool.export.base import Exported, Plan, Target
from idtool.export.targets import TARGETS, export

__all__ = ["TARGETS", "Exported", "Plan", "Target", "export"]
