"""Many axes: every session of a folder identified in parallel, and what sets the units apart.

fleet = run_fleet(Path("sessions"), Path("fleet"))
fleet.sessions, fleet.parameters        # fleet/summary.csv, summary.json, fleet.html
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from idtool.fleet.run import Fleet, Options, run_fleet

__all__ = ["Fleet", "Options", "run_fleet"]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used: a scheduler is greeted before that."""
    if name in __all__:
        return getattr(importlib.import_module("idtool.fleet.run"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
