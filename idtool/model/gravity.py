"""Gravity torque, linear in its two coefficients (paper Eq. 6; physics of an arm)."""

from __future__ import annotations

import numpy as np

from idtool.model.motion import Array, Motion


def columns(model: str, motion: Motion) -> Array:
    """Regressors of the gravity coefficients, shape (rows, 2).

    `slide`: (base, per_payload): cos(alpha) cos(beta) and the same times the payload.
    `arm`: (sin, cos): sin q and cos q.
    """
    if model == "arm":
        return np.column_stack([np.sin(motion.position), np.cos(motion.position)])
    factor = motion.gravity_factor if motion.gravity_factor is not None else np.ones(len(motion))
    payload = motion.payload if motion.payload is not None else np.zeros(len(motion))
    return np.column_stack([factor, factor * payload])


def upright_columns(model: str, motion: Motion) -> Array:
    """The regressors at zero tilt, shape (rows, 2)."""
    if model == "arm":
        return columns(model, motion)
    payload = motion.payload if motion.payload is not None else np.zeros(len(motion))
    return np.column_stack([np.ones(len(motion)), payload])
