"""A recording from elsewhere (CSV, Parquet, MATLAB) made into a log.

imported = import_recording("run.mat", units={"position": "deg"}, torque_constant=2.67)
imported.log.write("run.csv")
"""

from __future__ import annotations

from idtool.importing.names import Taken
from idtool.importing.recording import Imported, import_recording

__all__ = ["Imported", "Taken", "import_recording"]
