"""A hand that touches the axis once is found, told and left out; what the axis does itself is not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.diagnosis.acted_once import Stretch, acted_once, joined
from idtool.model.motion import Array
from idtool.signals import Recording, record
from idtool.verbs.base_model import Base, base_model

#: Of the axis: level of friction, N m.
COULOMB = 0.08
TIME: Array = 0.01 * np.arange(12_000, dtype=float)
Torque = Callable[[Array, Array, Array], Array]


REPEATS: Array = 1.0 * np.sin(2.0 * np.pi * 0.25 * TIME) + 0.5 * np.sin(2.0 * np.pi * 0.4 * TIME)


def axis(folder: Path, seed: int, acts: Torque, w: Array = REPEATS) -> Recording:
    """Two minutes of a motion that repeats every 20 s; `acts` is of time, position and velocity."""
    q = 0.01 * np.cumsum(w)
    own = COULOMB * np.tanh(w / 0.01) + 0.1 * w + 0.006 * np.gradient(w, 0.01)
    noise = np.random.default_rng(seed).normal(0.0, 0.003, len(TIME))
    path = folder / "log.csv"
    columns = {"time_s": TIME, "position_rad": q, "torque_nm": own + acts(TIME, np.asarray(q), w) + noise}
    pd.DataFrame({"trial": 0} | columns).to_csv(path, index=False)
    return record([Log.read(path)])


def hand(begin: float, seconds: float, torque: float) -> Torque:
    """Pushes, as a half wave."""
    return lambda t, q, w: (
        torque
        * np.sin(np.pi * np.clip((t - begin) / seconds, 0.0, 1.0))
        * (t > begin)
        * (t < begin + seconds)
    )


def sum_of(*several: Torque) -> Torque:
    return lambda t, q, w: sum((one(t, q, w) for one in several), 0.0 * t)


def nothing(t: Array, q: Array, w: Array) -> Array:
    return 0.0 * t


def base(recording: Recording) -> Base:
    return base_model(recording, "stribeck", "auto")


def told(found: Base) -> list[str]:
    return [remark for remark in found.recording.remarks if "not take at any other time" in remark]


@pytest.mark.parametrize(
    ("begin", "seconds", "torque"),
    [(30.0, 2.0, 0.1), (57.0, 0.6, -0.1), (90.0, 4.0, 0.05), (12.0, 1.0, 0.5)],
)
def test_a_hand_is_told_and_moves_no_number(
    tmp_path: Path, begin: float, seconds: float, torque: float
) -> None:
    touched, quiet = (base(axis(tmp_path, 0, acts)) for acts in (hand(begin, seconds, torque), nothing))
    (sentence,) = told(touched)
    assert "a hand, an obstacle or another axis" in sentence
    left_out = touched.recording.motion.time[~touched.recording.usable & quiet.recording.usable]
    assert begin - 2.4 < left_out.min() < begin + 0.3 * seconds
    assert begin + 0.7 * seconds < left_out.max() < begin + seconds + 2.4
    assert touched.recording.lost["acted once"] == len(left_out)
    for name, error in zip(quiet.best.model.names, np.sqrt(np.diag(quiet.best.covariance)), strict=True):
        if name in ("coulomb", "viscous", "inertia.inertia"):
            assert abs(touched.best.values[name] - quiet.best.values[name]) < 2.0 * error


def test_two_hands_are_both_told(tmp_path: Path) -> None:
    one, other = hand(30.0, 2.0, 0.12), hand(71.0, 1.5, -0.1)
    found = base(axis(tmp_path, 1, lambda t, q, w: one(t, q, w) + other(t, q, w)))
    assert len(told(found)) == 2


@pytest.mark.parametrize(
    "acts",
    [
        nothing,
        hand(30.0, 2.0, 0.04 * COULOMB),  # too little to move a number
        lambda t, q, w: 0.1 * np.exp(-0.5 * ((q - 0.3) / 0.05) ** 2),  # at one place, again and again
        lambda t, q, w: 0.05 * (t > 60.0),  # and stays
        lambda t, q, w: 0.04 * np.sin(2.0 * np.pi * 0.13 * t),  # and comes back
        lambda t, q, w: np.interp(t, [0.0, 60.0, 120.0], [0.0, 0.05, 0.0]),  # and drifts
        lambda t, q, w: 0.03 * np.sign(w) * q,
        hand(118.5, 3.0, 0.1),  # nobody sees whether it ends
    ],
    ids=["nothing", "little", "place", "step", "wave", "drift", "friction", "end"],
)
def test_what_is_the_axis_own_is_no_hand(tmp_path: Path, acts: Torque) -> None:
    for seed in range(3):
        recording = axis(tmp_path, seed, acts)
        assert acted_once(base_model(recording, "stribeck", "auto").best) == []
        assert "acted once" not in base(recording).recording.lost


def test_stretches_that_meet_are_one() -> None:
    stretches = [Stretch(0, 5.0, 6.0, 0.1), Stretch(0, 2.0, 4.5, -0.3), Stretch(0, 8.0, 9.0, 0.2)]
    one, other = joined([*stretches, Stretch(1, 5.0, 6.0, 0.1)])[:2]
    assert (one, other) == (Stretch(0, 2.0, 6.0, -0.3), Stretch(0, 8.0, 9.0, 0.2))


def test_what_acts_much_of_the_time_is_no_exception(tmp_path: Path) -> None:
    """A quarter of the run: who knows which of the two is the axis."""
    long = sum_of(*(hand(begin, 8.0, 0.1) for begin in (10.0, 41.0, 72.0, 103.0)))
    assert acted_once(base_model(axis(tmp_path, 0, long), "stribeck", "auto").best) == []


def test_a_hand_is_told_where_the_motion_never_comes_again_as_it_was(tmp_path: Path) -> None:
    """Places do, at some other speed: of two incommensurable waves no moment is like another."""
    w = np.sin(1.3 * TIME) + 0.7 * np.sin(0.83 * TIME + 1.0) + 0.4 * np.sin(2.17 * TIME)
    recording = axis(tmp_path, 2, hand(52.0, 1.5, 0.1), w)
    (sentence,) = told(base(recording))
    assert "a hand, an obstacle or another axis" in sentence
