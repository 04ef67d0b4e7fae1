"""The one parameter file, the axis it is of, and the units of both."""

from idtool.parameters.axis import Axis
from idtool.parameters.parameters import (
    CONTROLLER_KEYS,
    CONTROLLER_MODES,
    DYNAMIC,
    GRAVITY_MODELS,
    STATIC,
    Controller,
    EffectEntry,
    Parameter,
    Parameters,
)

__all__ = [
    "CONTROLLER_KEYS",
    "CONTROLLER_MODES",
    "DYNAMIC",
    "GRAVITY_MODELS",
    "STATIC",
    "Axis",
    "Controller",
    "EffectEntry",
    "Parameter",
    "Parameters",
]
