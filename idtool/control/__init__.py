"""Force-free control: the controller alone, which needs neither a rig nor a log."""

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Fault, Limits, Measurement, Reason, State, Status

__all__ = [
    "Fault",
    "ForceFreeController",
    "Limits",
    "Measurement",
    "Reason",
    "State",
    "Status",
]
