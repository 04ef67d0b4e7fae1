"""Many axes: every session of a folder identified in parallel, and what sets the units apart.

fleet = run_fleet(Path("sessions"), Path("fleet"))
fleet.sessions, fleet.parameters        # fleet/summary.csv, summary.json, fleet.html
"""

from __future__ import annotations

from idtool.fleet.run import Fleet, Options, run_fleet

__all__ = ["Fleet", "Options", "run_fleet"]
