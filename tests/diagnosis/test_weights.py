"""What a row is worth where a model leaves more at low speed, or where the motion is less sure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from idtool import identify
from idtool.diagnosis import diagnose as diagnosing
from idtool.diagnosis.weights import weighed
from idtool.log import Log
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion
from idtool.model.torque import Friction, predict
from idtool.signals import record
from idtool.signals.recording import Recording
from idtool.verbs.base_model import base_of_rows

TRIALS, ROWS, STEP = 8, 1500, 0.01
FRICTION = Friction(0.3, 0.35, 0.1, 0.02, 60.0, 0.1)


def log(folder: Path, *, grip: float, seed: int = 0) -> Path:
    """Sines with a ripple of 3 % of the friction, and at low speed a grip that differs from turn to turn."""
    rng = np.random.default_rng(seed)
    t = STEP * np.arange(ROWS)
    frames = []
    for trial in range(TRIALS):
        turn = 2.0 * np.pi / (3.0 + 0.37 * trial)
        q = 3.0 * np.sin(turn * t)
        w, a = 3.0 * turn * np.cos(turn * t), -3.0 * turn**2 * np.sin(turn * t)
        at = np.round(turn * t / np.pi - 0.5).astype(int) + 1
        blocks = grip * rng.standard_normal(at.max() + 1)[at] * np.exp(-((w / 0.25) ** 2))
        motion = Motion(t, np.zeros(ROWS, dtype=np.intp), q, w, a)
        effects = Contribution(torque=0.01 * a + 0.009 * np.sin(5.0 * q))
        torque = predict(motion, FRICTION, effects, np.zeros(1)).torque + blocks
        torque += 0.01 * rng.standard_normal(ROWS)
        frames.append(pd.DataFrame({"trial": trial, "time_s": t, "position_rad": q, "torque_nm": torque}))
    path = folder / "log.csv"
    pd.concat(frames).to_csv(path, index=False)
    return path


def fit(recording: Recording, residual: Array, inertia: float = 0.0) -> Any:
    """As much of a fit as is asked for."""
    model = SimpleNamespace(recording=recording, filtered_noise=recording.noise)
    return SimpleNamespace(model=model, residual=residual, values={"inertia.inertia": inertia})


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return record([Log.read(log(tmp_path, grip=0.1))])


def test_each_kind_of_rows_counts_by_what_is_left_on_it(recording: Recording) -> None:
    speed = np.abs(recording.motion.velocity[recording.row])
    slow = speed < 0.05 * np.quantile(np.abs(recording.motion.velocity), 0.98)
    residual = np.random.default_rng(1).standard_normal(len(slow)) * np.where(slow, 5.0, 1.0)
    weight = weighed(recording, fit(recording, residual)).row_weight
    assert weight[~slow].mean() / weight[slow].mean() == pytest.approx(5.0, rel=0.1)
    assert np.mean(weight**2) == pytest.approx(1.0)


def test_the_slower_the_more_may_be_left(recording: Recording) -> None:
    """A step function of the speed that never rises: what is left least at low speed counts like the rest."""
    speed = np.abs(recording.motion.velocity[recording.row])
    top = np.quantile(np.abs(recording.motion.velocity), 0.98)
    noise = np.random.default_rng(1).standard_normal(len(speed))
    creeping, slow = speed < 0.05 / 3.0 * top, speed < 0.05 * top
    assert min(np.count_nonzero(creeping), np.count_nonzero(slow & ~creeping)) > 20
    size = np.where(creeping, 20.0, np.where(slow, 4.0, 1.0))
    weight = weighed(recording, fit(recording, noise * size)).row_weight
    assert weight[~slow].mean() / weight[creeping].mean() == pytest.approx(20.0, rel=0.1)
    assert weight[~slow].mean() / weight[slow & ~creeping].mean() == pytest.approx(4.0, rel=0.2)
    size = np.where(creeping, 0.1, np.where(slow, 6.0, 1.0))
    weight = weighed(recording, fit(recording, noise * size)).row_weight
    assert np.ptp(weight[slow]) == pytest.approx(0.0, abs=1e-9)


def test_rows_count_by_how_sure_their_acceleration_is(recording: Recording) -> None:
    """Twice and eight times the torque noise of their acceleration, and little of it by what was left."""
    moving = np.abs(recording.motion.velocity) > 0.05 * np.quantile(np.abs(recording.motion.velocity), 0.98)
    third = np.arange(len(moving)) // 500 % 3
    unsure = recording.noise * np.choose(third, [0.01, 3.0, 12.0])
    known = replace(recording, unsure=unsure)
    size = np.choose(third, [1.0, 2.0, 6.0])[recording.row]
    residual = recording.noise * np.random.default_rng(1).standard_normal(len(size)) * size
    weight, sliding = weighed(known, fit(known, residual, 1.0)).row_weight, moving[recording.row]
    typical = [np.median(weight[sliding & (third[recording.row] == k)]) for k in range(3)]
    assert typical[0] / typical[1] == pytest.approx(2.0, rel=0.15)
    assert typical[0] / typical[2] == pytest.approx(6.0, rel=0.15)
    assert weighed(known, fit(known, residual, 0.0)) is known  # an axis without inertia needs no acceleration
    assert (
        weighed(known, fit(known, 3.0 * residual, 1.0)) is known
    )  # more than that explains: something lacks
    assert (
        weighed(known, fit(known, residual / size**2, 1.0)) is known
    )  # nor do those that are surest leave most


def test_a_fast_axis_of_which_the_stamps_are_jittery_gets_no_effect_for_it(tmp_path: Path) -> None:
    """Steps at 100 Hz, read half a millisecond beside their stamps: half of the acceleration is noise."""
    frames = []
    for trial in range(6):
        rng = np.random.default_rng(trial)
        fine = 0.0005 * np.arange(24000)
        goal = rng.uniform(-1.0, 1.0, 12)[(fine // 1.0).astype(int)] if trial % 2 else np.sin(1.3 * fine)
        q, w = np.zeros(len(fine)), np.zeros(len(fine))
        duty = np.zeros(len(fine))
        for k in range(1, len(fine)):
            duty[k] = np.clip(4.0 * (goal[k] - q[k - 1]) - 0.12 * w[k - 1], -0.95, 0.95)
            free = w[k - 1] + 0.0005 / 0.016 * (2.0 * duty[k] - 0.26 * w[k - 1] - 0.3 * np.sin(q[k - 1]))
            w[k] = np.sign(free) * max(abs(free) - 0.0005 / 0.016 * 0.06, 0.0)
            q[k] = q[k - 1] + 0.0005 * w[k]
        at = np.arange(100, len(fine) - 20, 20)
        late = at + rng.integers(-1, 2, len(at))
        step = 2.0 * np.pi / 4096.0
        frame = {"trial": trial, "time_s": fine[at], "position_rad": step * np.round(q[late] / step)}
        frames.append(pd.DataFrame(frame | {"torque_nm": 2.0 * np.round(duty[at], 3)}))
    pd.concat(frames).to_csv(tmp_path / "log.csv", index=False)
    found = identify([Log.read(tmp_path / "log.csv")])
    assert found.diagnosis["verdict"] == "adequate"
    assert [e.name for e in found.parameters.effects] == ["inertia"]
    assert found.parameters.effects[0].parameters["inertia"].value == pytest.approx(0.016, rel=0.05)
    # a model that somebody chose is fitted as any published one
    fits = {law: base_of_rows(found.recording, law, "arm").fits[0] for law in ("lugre", "coulomb")}
    assert fits["lugre"].model.recording.weight is not None
    assert fits["coulomb"].model.recording.weight is None


def test_an_axis_that_creeps_still_shows_its_stribeck_curve(tmp_path: Path) -> None:
    """Where friction fades smoothly towards standstill the rows that creep are far from any friction law."""
    rng, t = np.random.default_rng(0), 0.004 * np.arange(3000)
    trials = []
    for k in range(5):
        slow, fast = 2.0 * np.pi / (7.0 + k), 2.0 * np.pi / (1.7 + 0.2 * k)
        q = 0.3 * np.sin(slow * t) + 0.06 * np.sin(fast * t)
        w = 0.3 * slow * np.cos(slow * t) + 0.06 * fast * np.cos(fast * t)
        curve = 0.2 + 0.1 * np.exp(-((w / 0.06) ** 2))
        torque = curve * np.tanh(w / 0.004) + 0.1 * w + 0.002 * rng.normal(size=len(t))
        trials.append(
            pd.DataFrame({"trial": k, "time_s": t, "position_rad": np.round(q, 6), "torque_nm": torque})
        )
    pd.concat(trials).to_csv(tmp_path / "log.csv", index=False)
    starts = base_of_rows(record([Log.read(tmp_path / "log.csv")]), "lugre", "none").fits
    for found in starts:
        assert found.values["coulomb"] == pytest.approx(0.2, rel=0.05)
        assert found.values["static"] == pytest.approx(0.3, rel=0.05)


def test_rows_that_differ_little_all_count_the_same(recording: Recording) -> None:
    noise = np.random.default_rng(1).standard_normal(len(recording.row))
    assert weighed(recording, fit(recording, noise)) is recording
    speed = np.abs(recording.motion.velocity[recording.row])
    assert weighed(recording, fit(recording, noise * speed)) is recording


def test_weights_that_still_fit_stay_and_others_go(recording: Recording) -> None:
    """What was left before an effect came in may have been its own."""
    speed = np.abs(recording.motion.velocity)
    limit = 0.05 * np.quantile(speed, 0.98)
    slow = speed[recording.row] < limit
    noise = np.random.default_rng(1).standard_normal(len(slow))
    once = weighed(recording, fit(recording, noise * np.where(slow, 5.0, 1.0)))
    again = noise * np.where(slow, 5.0, 1.0) * once.row_weight
    assert weighed(once, fit(once, again)) is once
    wrong = replace(recording, weight=np.where(speed < limit, 3.0, 0.3))
    assert weighed(wrong, fit(wrong, noise * wrong.row_weight)).weight is None
    mended = weighed(wrong, fit(wrong, again / once.row_weight * wrong.row_weight))
    np.testing.assert_allclose(mended.row_weight, once.row_weight)


def test_a_weighed_row_of_the_filter_is_the_plain_one_times_its_weight(recording: Recording) -> None:
    speed = np.abs(recording.motion.velocity[recording.row])
    residual = np.random.default_rng(1).standard_normal(len(speed)) / (0.1 + speed)
    other = weighed(recording, fit(recording, residual))
    assert other is not recording
    expected = other.row_weight * recording.filtered(recording.torque)
    np.testing.assert_allclose(other.filtered(other.torque), expected, rtol=1e-12)
    part = other.subset([1, 3])
    chosen = np.isin(recording.filtered_trial, [1, 3])
    np.testing.assert_allclose(part.row_weight, other.row_weight[chosen])


def test_slow_rows_that_follow_nothing_hide_no_ripple(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = log(tmp_path, grip=0.25)
    found = identify([path])
    assert "position_ripple" in found.effects
    assert any(
        note.startswith("where the axis is slow, or its acceleration is least sure")
        for note in found.diagnosis["notes"]
    )
    rows = found.evidence.split.recording
    assert rows.weight is None, "what is shown and written is not weighed"
    monkeypatch.setattr(diagnosing, "weighed", lambda recording, fit, **_: recording)
    assert "position_ripple" not in identify([path]).effects
