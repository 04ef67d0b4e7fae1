"""The truth of a random axis in the coordinates of the joint fit."""

from __future__ import annotations

import math

import numpy as np

from idtool.effects import registry
from idtool.fit.model import JointModel
from idtool.fit.spec import Spec
from testbench.plants import Plant

SPEC = Spec("lugre", "slide", ("base", "per_payload"), (registry.get("inertia"),))
NAMES = (
    "coulomb",
    "static",
    "stribeck_velocity",
    "viscous",
    "bristle_stiffness",
    "bristle_damping",
    "gravity.base",
    "gravity.per_payload",
    "inertia.inertia",
)


def truth_of(model: JointModel, plant: Plant) -> np.ndarray:
    values = {name: getattr(plant, name.partition(".")[2] or name) for name in NAMES}
    return np.array([math.log(values[n]) if n in NAMES[:3] or n == NAMES[4] else values[n] for n in NAMES])
