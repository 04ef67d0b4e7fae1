"""Force-free control: the controller, a simulated hand, and the two together on a rig."""

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Fault, Limits, Measurement, Reason, State, Status
from idtool.control.hand import ConstantForceHand, Hand, ImpedanceHand, Push
from idtool.control.record import PushFigures, Record, TeachFigures
from idtool.control.teach import TeachResult, teach

__all__ = [
    "ConstantForceHand",
    "Fault",
    "ForceFreeController",
    "Hand",
    "ImpedanceHand",
    "Limits",
    "Measurement",
    "Push",
    "PushFigures",
    "Reason",
    "Record",
    "State",
    "Status",
    "TeachFigures",
    "TeachResult",
    "teach",
]
