"""Good logs, mistreated at random: whatever is done to them, there is a finite result or a sentence."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log, identify
from idtool.errors import InputError
from idtool.log import header_text
from idtool.parameters.axis import Axis
from idtool.parameters.rows import rows_of
from idtool.verbs.check import check

SESSION = Path(__file__).resolve().parents[2] / "data" / "session"
Random = np.random.Generator


def _column(frame: pd.DataFrame, chance: Random) -> str:
    return str(chance.choice([name for name in frame.columns if name != "trial"]))


def _with(
    change: Callable[[np.ndarray, Random], np.ndarray],
) -> Callable[[pd.DataFrame, Random], pd.DataFrame]:
    """The change of one column, whichever it is."""

    def mistreat(frame: pd.DataFrame, chance: Random) -> pd.DataFrame:
        name = _column(frame, chance)
        return frame.assign(**{name: change(frame[name].to_numpy(dtype=float).copy(), chance)})

    return mistreat


def _stuck(values: np.ndarray, chance: Random) -> np.ndarray:
    begin, end = sorted(chance.integers(0, len(values), 2))
    values[begin:end] = values[begin]
    return values


def _wild(values: np.ndarray, chance: Random) -> np.ndarray:
    values[chance.integers(0, len(values), 3)] = chance.choice([1e300, -1e30, 1e8, 50.0, np.inf, np.nan])
    return values


def _copied(frame: pd.DataFrame, chance: Random) -> pd.DataFrame:
    return frame.assign(**{_column(frame, chance): frame[_column(frame, chance)]})


MISTREATMENTS: dict[str, Callable[[pd.DataFrame, Random], pd.DataFrame]] = {
    "another unit": _with(lambda values, chance: values * 10.0 ** chance.integers(-9, 10)),
    "another zero": _with(lambda values, chance: values + 10.0 ** chance.integers(-3, 16)),
    "the same on every row": _with(lambda values, chance: np.full(len(values), chance.choice([0.0, -3.7]))),
    "stuck for a while": _with(_stuck),
    "a few wild readings": _with(_wild),
    "coarse": _with(lambda values, chance: np.round(values * 10.0 ** chance.integers(-1, 2))),
    "turned round": _with(lambda values, _: -values),
    "rectified": _with(lambda values, _: np.abs(values)),
    "nothing but noise": _with(lambda values, chance: chance.normal(size=len(values))),
    "in no order": _with(lambda values, chance: chance.permutation(values)),
    "another column in its place": _copied,
    "not there": lambda frame, chance: frame.drop(columns=_column(frame, chance)),
    "few rows": lambda frame, chance: frame.iloc[: chance.choice([1, 3, 49, 51, 60, 100])],
    "rows lost": lambda frame, chance: frame[chance.random(len(frame)) < chance.choice([0.1, 0.9])],
    "rows twice": lambda frame, _: frame.loc[np.repeat(frame.index, 2)],
    "last row first": lambda frame, _: frame.iloc[::-1],
    "many trials": lambda frame, chance: frame.assign(
        trial=np.arange(len(frame)) // chance.choice([1, 2, 3, 5, 50])
    ),
}


def mistreated(seed: int, folder: Path) -> tuple[list[Path], str]:
    """Files of one or two logs of the packaged session, each mistreated once to three times, and how."""
    chance = np.random.default_rng(seed)
    files, told = [], []
    for name in chance.choice(["gravity", "sweep", "sine"], size=chance.choice([1, 1, 2]), replace=False):
        log = Log.read(SESSION / f"{name}.csv.gz")
        begin = chance.integers(0, len(log.frame) - 2000)
        frame = log.frame.iloc[begin : begin + 2000]
        for what in chance.choice(list(MISTREATMENTS), size=chance.integers(1, 4)):
            if len(frame):
                frame = MISTREATMENTS[str(what)](frame, chance)
                told.append(f"{name}: {what}")
        files.append(folder / f"{name}.csv")
        files[-1].write_text(header_text(log.axis, log.experiment, log.header) + frame.to_csv(index=False))
    return files, "; ".join(told)


def told_or_refused(files: Sequence[Path]) -> None:
    """What `check` and `identify` say of logs is finite numbers, or a sentence."""
    with suppress(InputError):
        check([Log.read(file) for file in files])
    with suppress(InputError):
        result = identify(files)
        json.dumps(result.diagnosis, allow_nan=False)
        for row in rows_of(result.parameters):
            assert np.isfinite(row.parameter.value), row


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("seed", [4, 27, 40, 45])
def test_mistreated_logs_that_once_broke_it(seed: int, tmp_path: Path) -> None:
    told_or_refused(mistreated(seed, tmp_path)[0])


@pytest.mark.long
@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("seed", range(100, 150))
def test_a_mistreated_log(seed: int, tmp_path: Path) -> None:
    told_or_refused(mistreated(seed, tmp_path)[0])


def rows(count: int, **columns: np.ndarray) -> pd.DataFrame:
    """A log of two sweeps to and fro, columns changed."""
    time = 0.01 * np.arange(count)
    position = np.sin(time)
    torque = 0.1 * np.sign(np.cos(time)) + 0.2 * np.cos(time)
    return pd.DataFrame(
        {"trial": np.zeros(count, dtype=int), "time_s": time, "position_rad": position, "torque_nm": torque}
    ).assign(**columns)


def test_trials_too_short_for_a_motion_are_refused_or_left_out() -> None:
    count = 1200
    with pytest.raises(InputError, match=r"none of its 600 trials has 4 rows.*whether the clock rises"):
        identify([Log(rows(count, trial=np.arange(count) // 2), Axis("rotary"))])
    trial = np.maximum(np.arange(count) - 1100, 0) // 3  # one long trial, and 33 of three rows
    result = identify([Log(rows(count, trial=trial), Axis("rotary"))])
    assert "97 rows of whole trials were left out (trial of fewer than 4 rows)" in " ".join(result.notes)


def test_a_clock_faster_than_any_drive_is_doubted() -> None:
    count = 1200
    log = Log(rows(count, time_s=1e-5 * np.arange(count)), Axis("rotary"))
    assert "a row comes every 10 us, faster than the current loop of any drive" in " ".join(
        check([log]).notes
    )
    assert "faster than the current loop" not in " ".join(check([Log(rows(count), Axis("rotary"))]).notes)
