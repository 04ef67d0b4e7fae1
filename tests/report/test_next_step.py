"""The one step after an identification."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from idtool.parameters import Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.report import write_report
from idtool.report.next_step import next_step_of
from tests.report import folder as synthetic

CORRECTION = {"variable": "position", "with_direction": False, "held_out": {"before": 0.01, "after": 0.006}}
CASES: list[tuple[dict[str, Any], list[str], str, str]] = [
    ({"verdict": "effect_found", "next_experiment": None}, [], "choose how", "tune -p result/params.toml"),
    (
        {"verdict": "unexplained", "next_experiment": None},
        [],
        "another day",
        "predict OTHER-DAY.csv -p result/params.toml",
    ),
    (
        {"verdict": "unexplained", "next_experiment": None, "unexplained": {"correction": CORRECTION}},
        [],
        "a smooth correction over the position was found (error on held-out trials −40 %)",
        "predict OTHER-DAY.csv -p result/params.toml --correction result/correction.toml",
    ),
    ({}, [], "", "run --recipe result/next_experiment.toml --rig SPEC"),
    # no other run cures a column that is wrong
    ({}, ["the current pushes along"], "contradict", "plot logs/gravity.csv"),
]


@pytest.mark.parametrize(("changed", "wiring", "why", "command"), CASES)
def test_the_gravest_reason_decides(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    changed: dict[str, Any],
    wiring: list[str],
    why: str,
    command: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = synthetic.make(Path("result"))
    synthetic.write_json(folder, "diagnosis", synthetic.read_json(folder, "diagnosis") | changed)
    evidence = synthetic.read_json(folder, "evidence")
    evidence["logs"][0] |= {"file": "gravity.csv", "wiring": wiring}
    synthetic.write_json(folder, "evidence", evidence)
    step = next_step_of(folder, ["logs/gravity.csv", "logs/sweep.csv"])
    assert why in step.reason
    assert " ".join(step.words).startswith(command)


def test_after_the_textbook_model_effects_are_looked_for(tmp_path: Path) -> None:
    folder = synthetic.make(tmp_path / "result")
    candidates = [{"name": "inertia", "accepted": True}, {"name": "torque_offset", "accepted": False}]
    changed = {"verdict": "unexplained", "next_experiment": None, "effects": [], "candidates": candidates}
    synthetic.write_json(folder, "diagnosis", synthetic.read_json(folder, "diagnosis") | changed)
    step = next_step_of(folder, ["gravity.csv", "sweep.csv"])
    assert step.words == ("identify", "gravity.csv", "sweep.csv", "-o", f"{folder}-searched")
    page = write_report(folder).read_text()
    assert "no effect was looked for" in page
    assert "no effect in the library" not in page
    assert "that no effect" not in page


def test_a_shape_without_a_name_is_named(tmp_path: Path) -> None:
    folder = synthetic.make(tmp_path / "result")
    found = synthetic.read_json(folder, "diagnosis") | {"verdict": "unexplained", "next_experiment": None}
    synthetic.write_json(folder, "diagnosis", found)
    evidence = synthetic.read_json(folder, "evidence")
    evidence["notes"] = ["what is left looks like this: bump over the position: +0.05 N m at -0.1 rad."]
    synthetic.write_json(folder, "evidence", evidence)
    assert "bump over the position: +0.05 N m at -0.1 rad: see whether" in next_step_of(folder).reason


def test_a_step_can_be_taken(tmp_path: Path) -> None:
    """Nothing says how far the hand of an arm goes per radian; ampere are no torque."""
    folder = synthetic.make(tmp_path / "result")
    found = synthetic.read_json(folder, "diagnosis") | {"verdict": "effect_found", "next_experiment": None}
    synthetic.write_json(folder, "diagnosis", found)
    slide = Parameters.read(folder / "params.toml")
    assert "--lever" not in next_step_of(folder).words
    arm = replace(slide, gravity_model="arm", gravity={"sin": Parameter(0.3), "cos": Parameter(-0.1)})
    arm.write(folder / "params.toml", force=True)
    step = next_step_of(folder)
    assert step.words[-2:] == ("--lever", "M")
    assert "lever" in step.reason
    replace(arm, axis=Axis(effort="current")).write(folder / "params.toml", force=True)
    assert next_step_of(folder).words[0] == "calibrate"
