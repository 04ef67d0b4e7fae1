"""From the rows of logs to the arrays that a fit works on."""

from idtool.signals.recording import Recording, record

__all__ = [
    "Recording",
    "record",
]
