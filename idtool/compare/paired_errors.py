"""Prediction errors of two parameter files on the same logs, compared trial by trial.

Source: Fisher 1935 (the sign-flip test of paired differences).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.diagnosis.holm import holm
from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters import Parameters
from idtool.verbs.predict import Prediction, predict

#: Chance that two equally good files are said to predict differently, over all experiments together.
LEVEL = 0.01
#: Below this many trials of an experiment so many blocks of time stand in for trials: seven that all agree
#: do so by chance in 1 case of 64, which no level of 0.01 would tell.
LEAST_TRIALS = 8
_BLOCKS = 16
#: Draws of the signs: a p-value is told to 1e-4.
_SIGN_FLIPS = 9999


@dataclass(frozen=True)
class ErrorLine:
    """Prediction errors of both files on the same rows.

    Attributes:
        experiment: its name; "" for all rows together.
        a, b: root-mean-square error, N m (N).
        rows: compared.
        pairs: trials, or the blocks of time that stand in for them.
        blocks: whether blocks stand in for trials.
        p_value: of no difference, before correction.
        corrected: after Holm's correction.
    """

    experiment: str
    a: float
    b: float
    rows: int
    pairs: int
    blocks: bool
    p_value: float
    corrected: float

    @property
    def better(self) -> str | None:
        """ "a" or "b" where one predicts better beyond chance, else None."""
        if self.corrected >= LEVEL or self.a == self.b:
            return None
        return "a" if self.a < self.b else "b"

    def to_document(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "rmse_a": self.a,
            "rmse_b": self.b,
            "rows": self.rows,
            "pairs": self.pairs,
            "pairs_are": "blocks of time" if self.blocks else "trials",
            "p_value": self.p_value,
            "p_corrected": self.corrected,
            "better": self.better,
        }


def paired_errors(
    a: Parameters, b: Parameters, logs: Sequence[Log]
) -> tuple[tuple[ErrorLine, ...], list[str]]:
    """The errors of both files on every row of the logs.

    Args:
        a, b: the files.
        logs: of the axis that both describe.

    Returns:
        One line for all rows, then one per experiment; and sentences that qualify them.

    Raises:
        InputError: logs that one of the files cannot predict.
    """
    first, second = predict(logs, a), predict(logs, b)
    loss_a, loss_b = _loss(first), _loss(second)
    names = np.array(first.experiment)[first.trial]
    groups = {"": np.ones(len(names), dtype=bool)}
    groups |= {name: names == name for name in dict.fromkeys(first.experiment)}
    raw = {}
    for name, rows in groups.items():
        pair, blocks = paired_blocks(first.trial[rows])
        total = np.bincount(pair, loss_a[rows] - loss_b[rows]).astype(float)
        raw[name] = (rows, len(total), blocks, sign_flip_test(total))
    corrected = holm({name: p for name, (*_, p) in raw.items()})
    lines = tuple(
        ErrorLine(
            experiment=name,
            a=math.sqrt(float(loss_a[rows].mean())),
            b=math.sqrt(float(loss_b[rows].mean())),
            rows=int(rows.sum()),
            pairs=pairs,
            blocks=blocks,
            p_value=p,
            corrected=corrected[name],
        )
        for name, (rows, pairs, blocks, p) in raw.items()
    )
    notes = [
        f"{name} was fitted to {', '.join(seen)}, which flatters it there; give logs that neither saw."
        for name, one in (("A", a), ("B", b))
        if (seen := _seen(one, logs))
    ]
    notes += first.contradictions
    if any(line.blocks for line in lines):
        notes.append(f"below {LEAST_TRIALS} trials, blocks of time stand in for trials.")
    return lines, notes


def paired_blocks(trial: NDArray[np.intp]) -> tuple[NDArray[np.intp], bool]:
    """What is paired: the trials, or where they are few, blocks of time within them.

    Args:
        trial: of each row, shape (rows,); the rows of a trial lie together.

    Returns:
        The index of the trial or block of each row, shape (rows,), and whether these are blocks.
    """
    found, inverse, counts = np.unique(trial, return_inverse=True, return_counts=True)
    index = inverse.astype(np.intp)
    if len(found) >= LEAST_TRIALS:
        return index, False
    length = max(len(trial) // _BLOCKS, 1)
    per_trial = np.maximum(counts // length, 1)
    starts = np.cumsum(counts) - counts
    within = (np.arange(len(trial)) - starts[index]) * per_trial[index] // counts[index]
    return ((np.cumsum(per_trial) - per_trial)[index] + within).astype(np.intp), True


def sign_flip_test(differences: Array) -> float:
    """P-value of paired differences whose signs are chance, against a mean that is not zero.

    Args:
        differences: one per pair, shape (pairs,).

    Returns:
        The p-value by 9999 random sign flips, always the same ones.
    """
    flips = np.random.default_rng(0).choice((-1.0, 1.0), size=(_SIGN_FLIPS, len(differences)))
    # the tolerance counts sums that differ by rounding only as equal
    as_far = np.abs(flips @ differences) >= abs(float(differences.sum())) * (1.0 - 1e-9)
    return float((1 + as_far.sum()) / (1 + _SIGN_FLIPS))


def _loss(prediction: Prediction) -> Array:
    """Squared error of every row."""
    measured, predicted = prediction.frame.columns[2:4]
    return np.asarray((prediction.frame[measured] - prediction.frame[predicted]) ** 2, dtype=float)


def _seen(parameters: Parameters, logs: Sequence[Log]) -> list[str]:
    """Logs to which the file was fitted, as far as its provenance tells."""
    known = {Path(name).resolve() for name in parameters.logs}
    return [log.source for log in logs if Path(log.source).resolve() in known]
