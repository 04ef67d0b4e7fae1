"""Models are judged alike by how well they will predict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from idtool import Log
from idtool.fit.left_out import prediction_errors
from idtool.signals import record
from idtool.verbs.identify import begin


def test_what_takes_the_quick_part_away_is_not_held_to_fewer_rows(tmp_path: Path) -> None:
    """What is left is slower then and worth fewer rows, which says nothing against the larger model."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(800)
    w = np.sin(t)
    torque = np.sign(w) + 0.2 * w + 0.01 * rng.normal(size=len(t))
    frame = pd.DataFrame({"trial": 0, "time_s": t, "position_rad": -np.cos(t), "torque_nm": torque})
    frame.to_csv(tmp_path / "log.csv", index=False)
    (fit, *_), *_ = begin(record([Log.read(tmp_path / "log.csv")]), "coulomb", "none")
    rows = len(fit.residual)
    slow = lfilter([1.0], [1.0, -0.98], rng.normal(size=rows))
    slow /= np.std(slow)
    smaller = replace(fit, residual=slow + 0.8 * rng.normal(size=rows))
    larger = replace(fit, x=np.append(fit.x, 0.0), residual=slow)
    of_smaller, of_larger = prediction_errors(smaller, larger)
    assert of_larger.sum() < 0.9 * of_smaller.sum()
    # each by itself they would come out the other way round
    assert prediction_errors(larger)[0].sum() > prediction_errors(smaller)[0].sum()
