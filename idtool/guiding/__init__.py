"""Hand guiding on a rig: the session, a simulated hand, what was recorded, and its figure."""

from idtool.guiding.hand import ConstantForceHand, Hand, ImpedanceHand, Push
from idtool.guiding.record import PushFigures, Record, TeachFigures
from idtool.guiding.session import TeachResult, teach

__all__ = [
    "ConstantForceHand",
    "Hand",
    "ImpedanceHand",
    "Push",
    "PushFigures",
    "Record",
    "TeachFigures",
    "TeachResult",
    "teach",
]
