"""From the rows of logs to the arrays that a fit works on."""

from idtool.signals.from_logs import record
from idtool.signals.recording import Recording

__all__ = [
    "Recording",
    "record",
]
