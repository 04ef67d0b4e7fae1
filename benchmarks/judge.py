"""One measure for everybody's sigma0, sigma1 and inertia, and a count of model evaluations."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

import numpy as np

from idtool.model import lugre
from idtool.model.contribution import Contribution
from idtool.model.torque import Friction, predict
from idtool.signals import Recording


def friction_of(static: Mapping[str, float], sigma0: float, sigma1: float) -> Friction:
    """The friction model with the static parameters held."""
    return Friction(
        static["coulomb"], static["static"], static["stribeck_velocity"], static["viscous"], sigma0, sigma1
    )


def common_cost(
    recording: Recording, static: Mapping[str, float], sigma0: float, sigma1: float, inertia: float
) -> float:
    """Sum of squared torque errors of all rows, exactly integrated, at the best start deflections."""
    motion = recording.motion
    effect = Contribution(torque=inertia * motion.acceleration)
    predicted = predict(motion, friction_of(static, sigma0, sigma1), effect, np.zeros(motion.stretches))
    error, column = recording.torque - predicted.torque, predicted.start_column
    product = np.bincount(motion.trial, error * column)
    norm = np.bincount(motion.trial, column**2)
    return float(error @ error - np.sum(product**2 / np.maximum(norm, 1e-300)))


@contextmanager
def counted() -> Iterator[dict[str, int]]:
    """Count how often the bristle is propagated, plain and with tangents, while the block runs."""
    count = {"plain": 0, "tangents": 0}
    plain, tangents = lugre.propagate, lugre.propagate_blocks

    def count_plain(*arguments: Any) -> Any:
        count["plain"] += 1
        return plain(*arguments)

    def count_tangents(*arguments: Any) -> Any:
        count["tangents"] += 1
        return tangents(*arguments)

    with (
        patch.object(lugre, "propagate", count_plain),
        patch.object(lugre, "propagate_blocks", count_tangents),
    ):
        yield count
