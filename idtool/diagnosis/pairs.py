"""Two effects that hide each other: each leaves what the other does, beside which it looks like chance."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from idtool.diagnosis.candidates import LEAST_GAIN, Start
from idtool.diagnosis.evidence import background_of
from idtool.effects.base import Effect
from idtool.fit.basis import beyond, orthonormal
from idtool.fit.joint import JointFit


def hidden_pairs(
    fit: JointFit, scored: Sequence[tuple[Effect, Start]], alpha: float, most: int
) -> list[tuple[int, int]]:
    """Pairs of effects that no chance explains together, while each is needed beside the other; places in
    `scored`, those first that leave least.

    Args:
        fit: of the model that has none of them.
        scored: effects and their best starts from that fit.
        alpha: error of the family of all pairs, and of each effect beside its partner.
        most: how many pairs, at most.
    """
    background = background_of(fit)
    residual, whole = background.residual, float(background.residual @ background.residual)
    alone = {
        place: beyond(background.basis, start.columns)
        for place, (_, start) in enumerate(scored)
        if start.columns is not None
    }
    taken = {place: columns.T @ residual for place, columns in alone.items()}
    pairs: list[tuple[float, int, int]] = []
    for i, j in combinations(alone, 2):
        if scored[i][0].name != scored[j][0].name:
            across, along = alone[i].T @ alone[j], np.concatenate([taken[i], taken[j]])
            products = np.eye(len(along))
            products[: len(across), len(across) :], products[len(across) :, : len(across)] = across, across.T
            size = np.linalg.lstsq(products, along, rcond=1e-12)[0]
            pairs.append((whole - float(size @ along), i, j))
    found = []
    for leaves, i, j in sorted(pairs):
        if leaves > (1.0 - LEAST_GAIN) * whole:
            break  # nor do those that follow matter
        both = orthonormal(np.hstack([alone[i], alone[j]]))
        left = residual - both @ (both.T @ residual)
        tried = scored[i][1].tried, scored[j][1].tried
        if (
            background.chance(left, both) * tried[0] * tried[1] * len(pairs) < alpha
            and background.beside(alone[i]).chance(left, alone[j]) * tried[1] < alpha
            and background.beside(alone[j]).chance(left, alone[i]) * tried[0] < alpha
        ):
            found.append((i, j))
        if len(found) == most:
            break
    return found
