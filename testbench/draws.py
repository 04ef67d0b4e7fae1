"""Random numbers as studies draw them."""

from __future__ import annotations

import math

import numpy as np


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def sign(rng: np.random.Generator) -> float:
    """-1 or 1."""
    return float(rng.choice((-1.0, 1.0)))
