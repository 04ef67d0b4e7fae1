"""A run goes on where an earlier one ended; a person is asked before what only a person can do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.errors import InputError, RigFault
from idtool.experiment.recipe import Recipe
from idtool.experiment.runner import run
from idtool.log import Log
from idtool.rig.base import Block, TrialSetup

from .double import RigDouble, spoil
from .test_runner import recipe


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "log.csv"


def interrupted_at(block: int, log: Path, change: str = "interrupt") -> int:
    """A run that ends at a block; how many rows it left."""

    def press(index: int, block_: Block) -> Block:
        if index == block:
            raise KeyboardInterrupt
        return block_

    if change == "fault":
        with pytest.raises(RigFault):
            run(recipe(), RigDouble(change=spoil(block, position=9.0)), log)
        return len(Log.read(log).frame)
    summary = run(recipe(), RigDouble(change=press), log)
    assert summary.interrupted
    return summary.rows


def whole() -> int:
    """Rows of one trial."""
    return len(recipe().trials[0].motion.command(0.005))


@pytest.mark.parametrize("how", ["interrupt", "fault"])
@pytest.mark.parametrize("block", [5, 20, 25, 30])
def test_it_goes_on_at_the_next_trial(log: Path, block: int, how: str) -> None:
    rows = interrupted_at(block, log, how)
    first = Log.read(log).frame
    rig = RigDouble()
    done = run(recipe(), rig, log, resume=True)
    read = Log.read(log)
    assert (done.trials, done.rows, len(read.trials)) == (2, len(read.frame), 2)
    assert done.resumed == (1 if rows >= whole() else 0)
    assert rig.calls.count("prepare") == 2 - done.resumed
    assert [len(trial) for trial in read.trials] == [whole(), whole()]
    if done.resumed:
        # what was finished is untouched, and the clock runs on
        assert read.frame[: whole()].equals(first[: whole()])
        assert np.all(np.diff(read.frame["time_s"]) > 0)
    assert [float(trial["payload_kg"].iloc[0]) for trial in read.trials] == [0.0, 0.4]


def test_a_log_cut_in_the_middle_of_a_row_is_gone_on_with(log: Path) -> None:
    interrupted_at(30, log)
    log.write_bytes(log.read_bytes()[:-7])
    assert Log.read(log).incomplete
    run(recipe(), RigDouble(), log, resume=True)
    assert [len(trial) for trial in Log.read(log).trials] == [whole(), whole()]
    assert not Log.read(log).incomplete


def test_nothing_is_left_to_do(log: Path) -> None:
    run(recipe(), RigDouble(), log)
    before = log.read_bytes()
    rig = RigDouble()
    done = run(recipe(), rig, log, resume=True)
    assert (done.resumed, done.trials, done.rows) == (2, 2, 2 * whole())
    assert "play" not in rig.calls
    assert log.read_bytes() == before


def test_without_a_log_it_begins(log: Path) -> None:
    assert run(recipe(), RigDouble(), log, resume=True).resumed == 0


def renamed(old: Recipe) -> Recipe:
    return replace(old, name="other")


def heavier(old: Recipe) -> Recipe:
    trials = [replace(t, setup=replace(t.setup, payload_kg=t.setup.payload_kg + 1.0)) for t in old.trials]
    return replace(old, trials=tuple(trials))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (renamed, "was made by another recipe, rig or version; name another file, or pass force=True"),
        (heavier, "trial 0 was made with payload_kg = 0 and the recipe has 1"),
    ],
)
def test_a_log_of_another_run_is_refused_untouched(log: Path, change: object, expected: str) -> None:
    interrupted_at(30, log)
    before = log.read_bytes()
    rig = RigDouble()
    with pytest.raises(InputError, match=expected):
        run(change(recipe()), rig, log, resume=True)  # type: ignore[operator]
    assert rig.calls == []
    assert log.read_bytes() == before


def test_a_person_is_asked_where_the_set_up_changes(log: Path) -> None:
    rig = RigDouble()
    asked: list[tuple[int, int, float, float | None]] = []

    def confirm(trial: int, trials: int, setup: TrialSetup, before: TrialSetup | None) -> None:
        # the axis stands: it has not begun, or its last motion is over
        assert rig.calls[-1:] in ([], ["play"])
        asked.append((trial, trials, setup.payload_kg, before and before.payload_kg))

    three = replace(recipe(), trials=(*recipe().trials, recipe().trials[1]))
    run(three, rig, log, confirm=confirm)
    assert asked == [(1, 3, 0.0, None), (2, 3, 0.4, 0.0)]


def test_a_person_who_gives_up_ends_the_run_well(log: Path) -> None:
    def confirm(trial: int, *_: object) -> None:
        if trial == 2:
            raise KeyboardInterrupt

    rig = RigDouble()
    done = run(recipe(), rig, log, confirm=confirm)
    assert (done.interrupted, done.trials, done.rows) == (True, 1, whole())
    assert rig.calls[-1] == "stop"
