"""The one parameter file, the axis it is of, and the units of both."""

from idtool.parameters.axis import Axis
from idtool.parameters.contents import (
    CONTROLLER_KEYS,
    CONTROLLER_MODES,
    DYNAMIC,
    GRAVITY_MODELS,
    NO_GRAVITY,
    STATIC,
    Controller,
    EffectEntry,
)
from idtool.parameters.parameter import Parameter
from idtool.parameters.parameters import Parameters

__all__ = [
    "CONTROLLER_KEYS",
    "CONTROLLER_MODES",
    "DYNAMIC",
    "GRAVITY_MODELS",
    "NO_GRAVITY",
    "STATIC",
    "Axis",
    "Controller",
    "EffectEntry",
    "Parameter",
    "Parameters",
]
