"""A clean session spoiled on purpose: handled, and said so, or refused in one sentence."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log, identify
from idtool.log.sensor_faults import clipped
from idtool.signals import record as as_recording
from idtool.verbs.check import check
from idtool.verbs.identification import Identification
from idtool.verbs.predict import predict

from .support import GRAVITY, SINE, SWEEP, changed, ffc_id, plant, record

Logs = dict[str, Log]
Spoil = Callable[[pd.DataFrame, np.random.Generator], pd.DataFrame]

#: "Handled" is: every parameter within this many standard errors of the clean session's fit.
MULTIPLE = 4.0
NAMES = ("gravity", "sweep", "sine")


@pytest.fixture(scope="module")
def fine(tmp_path_factory: pytest.TempPathFactory) -> Logs:
    """The session with a row per 2 ms, to be thinned out."""
    folder = tmp_path_factory.mktemp("fine")
    rig = plant(folder, period_s=0.002)
    recipes = zip(NAMES, (GRAVITY, SWEEP, SINE), strict=True)
    return {
        name: record(changed(text, period_s=0.002), folder / f"{name}.csv", rig, seed)
        for seed, (name, text) in enumerate(recipes)
    }


def every(log: Log, rows: int) -> Log:
    """One row of so many."""
    return replace(log, rows=log.frame.iloc[::rows].reset_index(drop=True))


@pytest.fixture(scope="module")
def clean(fine: Logs) -> Logs:
    """The session at 100 Hz."""
    return {name: every(log, 5) for name, log in fine.items()}


@pytest.fixture(scope="module")
def reference(clean: Logs) -> Identification:
    return identify(list(clean.values()))


def numbers(result: Identification) -> dict[str, tuple[float, float]]:
    """Value and standard error of everything that was found."""
    p = result.parameters
    found = p.gravity | p.static | p.dynamic
    return {k: (v.value, v.stderr) for k, v in found.items() if v.identified and v.stderr is not None}


def close(result: Identification, reference: Identification, worse: float = 1.0) -> None:
    """Everything was found, close to the clean session's fit and as close as its own error says."""
    spoiled, clean = numbers(result), numbers(reference)
    assert len(clean) == 8
    assert set(spoiled) == set(clean)
    for name, (value, stderr) in clean.items():
        off = abs(spoiled[name][0] - value)
        assert off < MULTIPLE * worse * stderr, name
        assert off < MULTIPLE * max(stderr, spoiled[name][1]), name
    assert result.diagnosis["verdict"] == "adequate"


@dataclass(frozen=True)
class Handled:
    """A spoiled session that is handled.

    Attributes:
        spoil: what happens to the rows of a log.
        where: which logs it happens to.
        says: parts of what check and the fit say.
        worse: by how much the rows that are lost enlarge the uncertainty.
    """

    spoil: Spoil
    where: tuple[str, ...]
    says: tuple[str, ...]
    worse: float = 1.0


def dropped(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return frame[rng.random(len(frame)) > 0.05].reset_index(drop=True)


def wrapped(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    middle = float(frame["position_rad"].median())
    turned = np.mod(frame["position_rad"] - middle, 2.0 * math.pi)
    return frame.assign(position_rad=turned)


def spikes(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    current = frame["current_a"].to_numpy().copy()
    rows = rng.choice(len(current) - 2, len(current) // 200, replace=False)
    sizes = rng.choice([-1.0, 1.0], len(rows)) * 10.0 ** rng.uniform(-0.7, 1.0, len(rows))
    current[rows] += sizes
    current[rows[::3] + 1] += sizes[::3]  # every third lasts for two rows
    return frame.assign(current_a=current)


def saturated(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
    return frame.assign(current_a=frame["current_a"].clip(-0.046, 0.046))


def stuck(column: str, trial: int, begin: float, end: float) -> Spoil:
    """A column holds its value over a part of a trial."""

    def spoil(frame: pd.DataFrame, rng: np.random.Generator) -> pd.DataFrame:
        rows = np.flatnonzero(frame["trial"] == trial)
        rows = rows[int(begin * len(rows)) : int(end * len(rows))]
        values = frame[column].to_numpy().copy()
        values[rows] = values[rows[0]]
        return frame.assign(**{column: values})

    return spoil


HANDLED = {
    "dropped rows": Handled(dropped, NAMES, ("rows are missing (gaps in time",)),
    "wrapped position": Handled(wrapped, NAMES, ("the position wraps", "it was made continuous")),
    "spikes of the current": Handled(spikes, NAMES, ("impossible torque", "current_a", "cannot be")),
    # the rows at the limit are those that show the stiction
    "saturated current": Handled(
        saturated, ("sweep",), ("the current is saturated", "current saturated "), worse=4.0
    ),
    "position stuck for a while": Handled(
        stuck("position_rad", 3, 0.3, 0.55), ("sweep",), ("position stuck",)
    ),
    "position stuck for a trial": Handled(
        stuck("position_rad", 3, 0.0, 1.0), ("sweep",), ("position stuck", "whole trials were left out")
    ),
    "velocity stuck for a while": Handled(
        stuck("velocity_rad_s", 4, 0.3, 0.6), ("sweep",), ("velocity stuck",)
    ),
    "velocity stuck for a trial": Handled(
        stuck("velocity_rad_s", 1, 0.0, 1.0), ("sine",), ("velocity stuck", "whole trials were left out")
    ),
}


@pytest.mark.parametrize("name", HANDLED)
def test_handled_and_said(clean: Logs, reference: Identification, name: str) -> None:
    row, rng = HANDLED[name], np.random.default_rng(7)
    logs = [
        replace(log, rows=row.spoil(log.frame, rng)) if key in row.where else log
        for key, log in clean.items()
    ]
    found = check(logs)
    told = " ".join([*found.notes, *(one.sentence for one in found.findings)])
    result = identify(logs)
    notes = " ".join(result.diagnosis["notes"])
    for part in row.says:
        assert part in told
        assert part in notes
        assert part not in " ".join(reference.diagnosis["notes"])
    close(result, reference, row.worse)


def test_a_trial_that_is_there_twice_counts_once(clean: Logs) -> None:
    """Twice it would halve every variance, and be held out of the fit that has seen it."""
    log = clean["sine"]
    again = log.frame.assign(trial=log.frame["trial"] + 10, time_s=log.frame["time_s"] + 100.0)
    doubled = replace(log, rows=pd.concat([log.frame, again], ignore_index=True))
    once, both = as_recording([log]), as_recording([doubled])
    assert len(both.motion) == len(once.motion)
    assert both.lost["trial that is there already"] == len(log.frame)
    assert any("(trial that is there already)" in remark for remark in both.remarks)
    other = doubled.frame.assign(current_a=doubled.frame["current_a"] + 1e-4 * (doubled.frame["trial"] >= 10))
    assert len(as_recording([replace(log, rows=other)]).motion) == 2 * len(once.motion)


def test_a_prediction_keeps_every_row(clean: Logs, reference: Identification) -> None:
    """Also those of a trial that no fit would use."""
    log = clean["sweep"]
    frame = stuck("position_rad", 3, 0.0, 1.0)(log.frame, np.random.default_rng(0))
    prediction = predict([replace(log, rows=frame)], reference.parameters)
    assert len(prediction.frame) == len(log.frame)
    assert prediction.frame["torque_predicted_nm"].notna().all()


def test_a_held_axis_is_no_stuck_sensor(clean: Logs) -> None:
    """Standing still, with a velocity whose zero is a little off."""
    frame = clean["sweep"].frame
    rest = frame.iloc[[-1] * 400].assign(trial=99, velocity_rad_s=0.004)
    rest["time_s"] += 0.01 * np.arange(1, 401)
    both = pd.concat([frame, rest], ignore_index=True)
    recording = as_recording([replace(clean["sweep"], rows=both)])
    assert not any("stuck" in reason for reason in recording.lost)


def test_a_range_of_no_whole_turns_is_made_continuous_too(clean: Logs) -> None:
    """An angle that wraps at 6 rad jumps by 6 rad each time, further than it travels in a row."""
    frame = clean["sweep"].frame
    middle = float(frame["position_rad"].median())
    odd = frame.assign(position_rad=np.mod(frame["position_rad"] - middle, 6.0))
    recording = as_recording([replace(clean["sweep"], rows=odd)])
    assert any("wraps" in remark and "by 6;" in remark for remark in recording.remarks)
    right = as_recording([clean["sweep"]])
    for trial in range(right.trials):
        rows = right.motion.trial == trial
        apart = recording.motion.position[rows] - right.motion.position[rows]
        assert float(np.ptp(apart)) < 0.01
    assert recording.lost == right.lost


@pytest.mark.parametrize("noise", [0.0, 0.002])
@pytest.mark.parametrize("step", [5e-4, 2.69e-3])
def test_the_peak_of_a_sine_is_no_saturation(noise: float, step: float) -> None:
    rng = np.random.default_rng(5)
    sine = 0.2 * np.sin(np.linspace(0.0, 40.0, 6000)) + noise * rng.standard_normal(6000)
    assert not clipped(np.rint(sine / step) * step).any()
    cut = clipped(np.clip(np.rint(sine / step) * step, -0.15, 0.15))
    assert cut[np.abs(sine) > 0.15 + 4 * noise].all()
    assert not cut[np.abs(sine) < 0.1].any()


def test_uneven_sampling(fine: Logs, reference: Identification) -> None:
    """Rows every 10 ms, each up to 30 % of that early or late."""
    rng = np.random.default_rng(3)
    late = np.array([-1.5, -1.0, -0.5, 0.0, 0.5, 1.0, 1.5])  # of 2 ms
    logs = []
    for log in fine.values():
        parts = []
        for _, rows in log.frame.groupby("trial"):
            due = np.arange(5, len(rows) - 5, 5)
            parts.append(rows.iloc[np.round(due + rng.choice(late, len(due))).astype(int)])
        logs.append(replace(log, rows=pd.concat(parts, ignore_index=True)))
    assert "jitters by" in " ".join(check(logs).logs[1].findings)
    close(identify(logs), reference)


@pytest.mark.parametrize("fast", [2, 1])
def test_two_rates_together(fine: Logs, reference: Identification, fast: int) -> None:
    """A sweep at 100 Hz and sines at 250 or 500 Hz, the more of the rows."""
    logs = [every(fine["gravity"], 5), every(fine["sweep"], 5), every(fine["sine"], fast)]
    together = identify(logs)
    close(together, reference)
    rates = [one.facts["rate_hz"] for one in check(logs).logs]
    assert rates == pytest.approx([100.0, 100.0, 500.0 / fast])
    for name, (_, stderr) in numbers(together).items():
        assert stderr < 1.2 * numbers(reference)[name][1], name  # more rows must not make it worse


@dataclass(frozen=True)
class Refused:
    """A spoiled log that is refused: what happens to its lines, and parts of the sentence."""

    spoil: Callable[[pd.DataFrame], pd.DataFrame]
    says: tuple[str, ...]


def doubled(frame: pd.DataFrame) -> pd.DataFrame:
    return pd.concat([frame.iloc[:301], frame.iloc[300:]], ignore_index=True)


def gone(column: str) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def spoil(frame: pd.DataFrame) -> pd.DataFrame:
        frame = frame.copy()
        frame.loc[[200, 500], column] = math.nan
        return frame

    return spoil


REFUSED = {
    "the same row twice": Refused(doubled, ("line", "time stands still", "1 in all", "ffc-id import")),
    "NaN of the current": Refused(
        gone("current_a"),
        ("line", 'column "current_a" is empty or NaN', "correct or delete that row (2 such"),
    ),
    "NaN of the position": Refused(gone("position_rad"), ("line", 'column "position_rad" is empty or NaN')),
    "position stuck throughout": Refused(
        lambda frame: frame.assign(position_rad=0.25),
        ("from row 2 of the data", 'column "position_rad" stands still', 'remove column "position_rad"'),
    ),
    "velocity stuck throughout": Refused(
        lambda frame: frame.assign(velocity_rad_s=0.1),
        ("from row 2 of the data", 'column "velocity_rad_s" stands still', 'remove column "velocity_rad_s"'),
    ),
    "current stuck throughout": Refused(
        lambda frame: frame.assign(current_a=0.02), ('column "current_a" is the same on every row', "check")
    ),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("command", ["check", "fit-static", "identify"])
def test_refused_in_one_sentence(
    clean: Logs, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, command: str
) -> None:
    row, file = REFUSED[name], tmp_path / "spoiled.csv"
    clean["sweep"].write(file)
    lines = file.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = row.spoil(clean["sweep"].frame).to_csv(index=False)
    file.write_text("\n".join([*head, rows]))
    options = {"check": [], "fit-static": ["-p", tmp_path / "p.toml"], "identify": ["-o", tmp_path / "out"]}
    code, out, err = ffc_id(
        capsys, command, file, *options[command], "-q" if command == "identify" else "--json"
    )
    assert code == 3
    assert out == ""
    assert err.startswith(f"ffc-id: {file}")
    assert len(err.splitlines()) == 1
    for part in row.says:
        assert part in err
    assert [path.name for path in tmp_path.iterdir()] == ["spoiled.csv"]


def test_an_experiment_too_slowly_sampled_to_be_compared_is_told_and_has_no_error(fine: Logs) -> None:
    rows = {"gravity": 60, "sweep": 150, "sine": 60}  # of 2 ms
    found = identify([every(log, rows[name]) for name, log in fine.items()]).diagnosis
    assert set(found["error"]["by_experiment"]) == {"gravity", "sine"}
    assert "no row of the experiment 'sweep' could be compared with the model." in found["notes"]
    assert all(np.isfinite(value) for value in found["error"]["held_out"].values())
