"""The study of the diagnosis: how outcomes are judged, noted and gone on from."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

import testbench.outcomes
from idtool import Log, Parameters, identify
from testbench.diagnosis_cases import cases
from testbench.judging import absurdities, most_torque
from testbench.other_plants.session import make, save
from testbench.outcomes import KINDS, Case, Result, outcomes


def test_a_tolerated_name_neither_counts_nor_harms() -> None:
    case = Case("one effect", 1, ("torque_offset",), "other")
    exact = Result(case, effects=("torque_offset",), found=("torque_offset",))
    assert exact.named
    both = replace(exact, found=("torque_offset", "hysteresis"))
    assert not both.named
    assert both.extra == ("hysteresis",)
    allowed = replace(both, tolerated=("hysteresis",))
    assert allowed.named
    assert not allowed.extra
    assert not replace(allowed, found=("hysteresis",)).named
    assert not replace(exact, failed="ValueError: no").named


def test_a_cut_run_goes_on_from_its_notes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done, cut, left = (Case("none", seed, (), "other") for seed in (1, 2, 3))
    notes = tmp_path / "notes.jsonl"
    numbers = {"before": 0.2, "after": 0.1, "fresh": 0.1, "seconds": 2.0}
    kept = Result(done, verdict="adequate", coulomb=(1.0, 0.9, 1.1), note={"axis": "arm"}, **numbers)
    half = json.dumps(asdict(Result(cut)))
    notes.write_text(json.dumps(asdict(kept)) + "\n" + half[: len(half) // 2])
    asked = []

    class Here:
        """A pool that works here and now."""

        def __init__(self, jobs: int) -> None:
            assert jobs == 1

        def __enter__(self) -> Here:
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def submit(self, work: object, case: Case) -> object:
            from concurrent.futures import Future

            asked.append(case)
            future: Future[Result] = Future()
            future.set_result(Result(case, verdict="unexplained", **numbers))
            return future

    monkeypatch.setattr(testbench.outcomes, "ProcessPoolExecutor", Here)
    results = outcomes([done, cut, left], _unused, notes, 1)
    assert asked == [cut, left]
    assert results[0] == kept
    assert [r.case for r in results] == [done, cut, left]
    asked.clear()
    assert outcomes([done, cut, left], _unused, notes, 1) == results
    assert asked == []


def _unused(case: Case) -> Result:
    raise AssertionError(case)


def test_sizes_of_a_study_add_sessions_of_the_kinds_asked_for() -> None:
    few = list(cases(("ours",), 1, 1, 2, 1, 1))
    assert {case.axis for case in few} == {"ours"}
    other = list(cases(("other",), 1, 1, 2, 1, 1))
    assert {case.axis for case in other} == {"other"}
    assert {case.kind for case in other} == set(KINDS)
    assert set(few) | set(other) <= set(cases(("ours", "other"), 3, 2, 4, 2, 2))


def test_a_level_beyond_the_torque_measured_is_absurd(tmp_path: Path) -> None:
    session = make("clean", [], 6)
    save(session, tmp_path)
    logs = [Log.read(tmp_path / "clean" / f"{run}.csv") for run in session.logs if run != "validation"]
    parameters: Parameters = identify(logs).parameters
    most = most_torque(logs)
    assert absurdities(parameters, logs, most) == []
    assert absurdities(parameters, logs, 10.0 * most) == ["prediction beyond the torque measured"]
    level = parameters.static["coulomb"]
    high = replace(level, value=20.0 * most, ci95=(19.0 * most, 21.0 * most))
    absurd = replace(parameters, static={**parameters.static, "coulomb": high})
    assert absurdities(absurd, logs, most) == ["coulomb above the torque measured"]
    wrong = replace(level, ci95=(2.0 * level.value, 3.0 * level.value))
    outside = replace(parameters, static={**parameters.static, "coulomb": wrong})
    assert absurdities(outside, logs, most) == ["coulomb outside its interval"]
