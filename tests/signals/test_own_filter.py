"""A torque that was smoothed, forwards and backwards, before it was logged."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import signal

from idtool.effects import registry
from idtool.fit.choose import choose_gravity, first_fit
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.fit.own_filter import behind_own_filter
from idtool.fit.spec import Spec
from idtool.log import Log
from idtool.model.motion import Motion
from idtool.signals import record
from idtool.signals.own_filter import CAUSAL_ORDERS, OwnFilter, falls, noise_before
from idtool.signals.thin import thin
from idtool.verbs import base_model
from idtool.verbs.identify import identify
from idtool.verbs.predict import predict
from testbench.plants import Plant, record_session

PAPER = Plant(0.070, 0.030, 0.090, 0.155, 0.051, 0.297, 0.006, 0.2295, 0.4457)


@cache
def session(seed: int, *experiments: str) -> list[Log]:
    """Tests share it; nobody changes it in place."""
    return record_session(PAPER, "lab", seed, experiments or ("gravity", "sine"))


def smoothed(logs: list[Log], corner: float, order: int, *, causal: bool = False) -> list[Log]:
    """The logs with a current that a Butterworth filter smoothed trial by trial, forwards and backwards, or
    as it came."""
    done = []
    for log in logs:
        frame = log.frame.copy()
        for _, rows in frame.groupby("trial"):
            rate = 1.0 / rows["time_s"].diff().median()
            b, a = signal.butter(order, corner, fs=rate)
            current = rows["current_a"].to_numpy()
            if causal:
                frame.loc[rows.index, "current_a"] = current[0] + signal.lfilter(b, a, current - current[0])
            else:
                frame.loc[rows.index, "current_a"] = signal.filtfilt(b, a, current)
        done.append(replace(log, rows=frame))
    return done


@pytest.mark.parametrize("seed", [1, 4, 5])
def test_noise_tells_that_it_was_filtered(seed: int) -> None:
    logs = session(seed)
    plain = record(logs)
    assert falls(plain.torque, plain.motion) < 0.5
    for order in (1, 2):
        found = record(smoothed(logs, 8.0, order))
        # a filter made for samples falls faster than that near their highest frequency
        assert falls(found.torque, found.motion) > 2.0 * order


def test_the_gain_is_that_of_a_butterworth_filter_used_twice() -> None:
    own = OwnFilter(8.0, 4.0)
    b, a = signal.butter(2, 8.0, fs=1000.0)
    frequency, once = signal.freqz(b, a, 64, fs=1000.0)
    slow = frequency < 60.0
    np.testing.assert_allclose(own.gain(frequency[slow]), np.abs(once[slow]) ** 2, atol=0.02)
    impulse = np.zeros(2001)
    impulse[1000] = 1.0
    theirs = signal.filtfilt(b, a, impulse)
    kernel = own.kernel(1000.0)
    half = len(kernel) // 2
    assert half == 125  # a period of the corner
    np.testing.assert_allclose(kernel, theirs[1000 - half : 1001 + half], atol=0.02 * theirs.max())


@pytest.mark.parametrize("order", CAUSAL_ORDERS)
def test_one_that_runs_forwards_alone_answers_as_scipy_s(order: float) -> None:
    """Of a torque that goes straight from row to row, at a rate as coarse as thinned rows have."""
    own, rate, fine = OwnFilter(5.0, order, causal=True), 50.0, 40
    time = np.arange(200 * fine) / (rate * fine)
    torque = np.interp(time, np.arange(201) / rate, np.random.default_rng(0).standard_normal(201))
    b, a = signal.butter(int(order), 5.0, fs=rate * fine)
    rows = np.arange(200) / rate
    motion = Motion(rows, np.zeros(200, dtype=int), rows, np.ones(200), np.zeros(200))
    once = torque[0] + signal.lfilter(b, a, torque - torque[0])[::fine]
    np.testing.assert_allclose(own.matrix(motion) @ torque[::fine], once, atol=0.01)
    frequency, theirs = signal.freqz(b, a, 64, fs=rate * fine)
    np.testing.assert_allclose(own.gain(frequency[:16]), np.abs(theirs[:16]), atol=1e-3)


@pytest.mark.parametrize("order", CAUSAL_ORDERS)
def test_its_delay_is_that_of_a_drive_s(order: float) -> None:
    """A hundredth of it is 0.3 ms, which moves an inertia of 0.006 by half a per cent."""
    weights = OwnFilter(5.0, order, causal=True).kernel(200.0)
    late = np.arange(len(weights) // 2, -len(weights) // 2, -1) / 200.0
    assert weights @ late == pytest.approx(
        (1.0 if order == 1.0 else np.sqrt(2.0)) / (2.0 * np.pi * 5.0), rel=0.01
    )


def test_rows_that_know_what_was_before_their_stretch_are_left_out() -> None:
    """At 2 Hz a hundredth of that is left after 0.37 s; forwards and backwards nobody can say."""
    recording = record(session(1))
    known = recording.through(OwnFilter(2.0, 1.0, causal=True)).without_what_was_before()
    motion, gone = recording.motion, recording.usable & ~known.usable
    since = (
        motion.time - motion.time[np.maximum.accumulate(np.where(motion.begins, np.arange(len(motion)), 0))]
    )
    assert gone.any()
    assert since[gone].max() < 0.367 < since[known.usable].min() + 0.006
    for own in (OwnFilter(2.0, 4.0), OwnFilter(0.1, 1.0, causal=True)):  # ... or few others would be left
        kept = recording.through(own).without_what_was_before()
        assert (kept.usable == recording.usable).all()


@pytest.mark.parametrize("own", [OwnFilter(4.0, 4.0), OwnFilter(4.0, 2.0, causal=True)])
def test_a_level_stays_and_no_stretch_sees_another(own: OwnFilter) -> None:
    motion = record(session(1)).motion
    matrix = own.matrix(motion)
    np.testing.assert_allclose(matrix @ np.ones(len(motion)), 1.0)
    stretch = motion.stretch.astype(float)
    np.testing.assert_allclose(matrix @ stretch, stretch)


def test_each_log_has_the_kernel_of_its_own_rate() -> None:
    gravity, sine = session(1)
    own = OwnFilter(4.0, 4.0)
    logs = [gravity, replace(sine, rows=sine.frame.iloc[::2].reset_index(drop=True))]
    motion = record(logs).motion
    matrix = own.matrix(motion)
    rates = {round(1.0 / float(np.median(np.diff(log.frame["time_s"])))) for log in logs}
    assert len(rates) == 2
    for rate in rates:
        kernel = own.kernel(float(rate))
        # the last rows, that none of the longer kernels is among them, cut off at the end of a stretch
        whole = np.flatnonzero(np.diff(matrix.pointer) == len(kernel))[-1000::100]
        assert len(whole) == 10
        for row in whole:
            np.testing.assert_allclose(matrix.data[matrix.pointer[row] : matrix.pointer[row + 1]], kernel)


def test_the_noise_is_told_as_it_was_before() -> None:
    motion = record(session(7, "sine")).motion  # of one rate
    own = OwnFilter(10.0, 2.0)
    before = 0.01 * np.random.default_rng(3).standard_normal(len(motion))
    assert noise_before(own, own.matrix(motion) @ before, motion) == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("corner", [4.0, pytest.param(2.0, marks=pytest.mark.long)])
def test_it_is_found_and_predicted_through(corner: float) -> None:
    found = identify(smoothed(session(4), corner, 2))
    assert found.parameters.provenance["low_pass_hz"] == pytest.approx(corner, rel=0.15)
    assert any("went through a low-pass" in note for note in found.notes)
    assert {effect.name for effect in found.parameters.effects} == {"inertia"}
    for name, true in (("coulomb", 0.070), ("viscous", 0.155)):
        assert found.parameters.static[name].value == pytest.approx(true, rel=0.05)
    # another session that was smoothed alike is predicted better through it; one that was not, as it is
    known = found.parameters
    unaware = replace(known, provenance={})
    other = session(5)
    for logs, ratio in ((smoothed(other, corner, 2), 0.9), (other, 1.0)):
        through, not_through = (predict(logs, file).errors["sine"]["rmse"] for file in (known, unaware))
        assert through <= ratio * not_through


@pytest.mark.parametrize("order", [1, pytest.param(2, marks=pytest.mark.long)])
def test_that_of_a_drive_is_found_and_pulls_at_no_number(order: int) -> None:
    """It was told as a delay of the axis, with an inertia 40 % off."""
    found = identify(smoothed(session(4), 5.0, order, causal=True)).parameters
    assert found.provenance["low_pass_hz"] == pytest.approx(5.0, rel=0.08)
    assert found.provenance["low_pass_order"] == order
    assert found.provenance["low_pass_causal"] is True
    assert [effect.name for effect in found.effects] == ["inertia"]
    for one, true in (
        (found.effects[0].parameters["inertia"], 0.006),
        (found.dynamic["bristle_damping"], 0.297),
    ):
        assert one.value == pytest.approx(true, rel=0.15)
        assert one.ci95 is not None
        assert one.ci95[0] < true < one.ci95[1]
    assert OwnFilter.from_provenance(found.provenance) == OwnFilter(
        found.provenance["low_pass_hz"], float(order), causal=True
    )


@pytest.mark.long
def test_it_is_found_behind_an_effect_that_hid_it() -> None:
    """What the base model lacks leaves so much that no filter shows beside it."""
    bench = Plant(0.080, 0.115, 0.08, 0.12, 8.0, 0.2, 0.008, 0.2, 0.42)
    plant = replace(bench, effects={"load_dependent_friction": {"mu": 0.12}})
    logs = record_session(plant, "lab", 4, ("gravity", "sine"))
    found = identify(smoothed(logs, 5.0, 2, causal=True)).parameters
    assert found.provenance["low_pass_causal"] is True
    assert {effect.name for effect in found.effects} == {"inertia", "load_dependent_friction"}


def test_white_noise_needs_none() -> None:
    assert "low_pass_hz" not in identify(session(5)).parameters.provenance
    assert OwnFilter.from_provenance({"low_pass_hz": "ten", "low_pass_order": 4.0}) is None
    assert OwnFilter.from_provenance({"low_pass_hz": -1.0, "low_pass_order": 4.0}) is None
    assert OwnFilter.from_provenance({"low_pass_hz": 9.0, "low_pass_order": 4}) == OwnFilter(9.0, 4.0)
    causal = {"low_pass_hz": 9.0, "low_pass_order": 4, "low_pass_causal": True}
    assert OwnFilter.from_provenance(causal) is None


def test_no_filter_is_looked_for_that_sees_beyond_the_stretches() -> None:
    logs = smoothed(session(7, "sine"), 0.2, 2)
    recording = thin(record(logs))
    base = first_fit(recording, Spec("lugre", *choose_gravity(recording), (registry.get("inertia"),)))
    motion = base.model.recording.motion
    begins = np.append(np.flatnonzero(motion.begins), len(motion) - 1)
    usual = np.median(np.diff(motion.time[begins]))
    own, _ = behind_own_filter(base)
    assert own.corner_hz * usual > 3.9  # it would be 2.5


@pytest.mark.parametrize(("corner_hz", "taken"), [(20.0, True), (0.3, False)])
def test_what_hides_more_noise_than_was_read_is_no_filter(
    monkeypatch: pytest.MonkeyPatch, corner_hz: float, taken: bool
) -> None:
    """A torque that is smooth by itself: the noise before such a filter would be many times the torque."""
    own = OwnFilter(corner_hz, 4.0)

    def behind(fit: JointFit) -> tuple[OwnFilter, JointFit]:
        return own, refit(fit, JointModel.build(fit.model.recording.through(own), fit.model.spec))

    monkeypatch.setattr(base_model, "filtered_before", lambda _: True)
    monkeypatch.setattr(base_model, "behind_own_filter", behind)
    monkeypatch.setattr(base_model, "gain_in_evidence", lambda *_: 100.0)
    found = identify(session(7, "sine"), friction="coulomb")
    assert (found.recording.own_filter is not None) == taken


def test_trials_too_short_to_show_noise_tell_none() -> None:
    """A log of many short trials, thinned: what was known of its noise stays."""
    time = 0.01 * np.arange(400)
    trial = np.arange(400) // 20
    motion = Motion(time, trial, np.sin(time), np.cos(time), -np.sin(time))
    assert noise_before(OwnFilter(5.0, 4.0), np.cos(time), motion) is None
