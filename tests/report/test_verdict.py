"""Whether to trust a result, check by check."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from idtool.effects import registry
from idtool.parameters import Parameter, Parameters
from idtool.report import verdict
from idtool.report.evidence import read_evidence

from . import folder as synthetic


def parameters_check(static: dict[str, Parameter]) -> verdict.Check:
    evidence: Any = SimpleNamespace(parameters=Parameters(static=static))
    return verdict._parameter_check(evidence)


@pytest.mark.parametrize(
    ("static", "mark"),
    [
        ({}, "bad"),
        ({"coulomb": Parameter(0.1, identified=False), "static": Parameter(0.1, identified=False)}, "bad"),
        ({"coulomb": Parameter(0.1), "static": Parameter(0.1, identified=False)}, "care"),
        ({"coulomb": Parameter(0.1), "static": Parameter(0.1)}, "good"),
    ],
)
def test_what_the_data_determine(static: dict[str, Parameter], mark: str) -> None:
    check = parameters_check(static)
    assert check.mark == mark
    if mark == "bad":
        assert check.sentence == "The data determine no parameter at all."
    if mark == "care":
        assert check.sentence == "The data do not determine stiction."


def test_what_was_turned_down_though_no_chance_is_one_doubt(folder: Path) -> None:
    file = folder / "params.toml"
    known = {
        name: synthetic.known(value)
        for name, value in {"bristle_stiffness": 40.0, "bristle_damping": 0.1}.items()
    }
    replace(Parameters.read(file), dynamic=known).write(file, force=True)
    assert verdict.summarise(read_evidence(folder)).trust == "Yes"
    document = synthetic.read_json(folder, "diagnosis")
    synthetic.write_json(folder, "diagnosis", document | {"hidden": ["hysteresis", "compliance"]})
    summary = verdict.summarise(read_evidence(folder))
    assert summary.trust == "Yes, with one doubt"
    told = [check.sentence for check in summary.checks if check.mark == "doubt"]
    assert told == [
        "Hysteresis or compliance would explain a part of what looks like noise, and that is no chance; "
        "the intervals allow for it."
    ]
    assert summary.checks[0].sentence == told[0]


def test_friction_over_the_stroke_is_told_by_what_its_numbers_come_to() -> None:
    """A small slope was the headline where a higher coefficient carries the shape."""
    effect = registry.get("position_dependent_friction")
    together = effect.together({"slope_1": 0.0, "slope_2": -0.1, "center": 0.0, "half_stroke": 1.0})
    assert together == ("change of the friction over the stroke, peak to peak", pytest.approx(0.2))
    assert registry.get("inertia").together({"inertia": 1.0}) is None


def test_friction_alone_explains() -> None:
    parameters = Parameters(static={"coulomb": Parameter(0.1)})
    diagnosis = SimpleNamespace(verdict="adequate", effects=())
    facts = SimpleNamespace(friction="lugre")
    evidence: Any = SimpleNamespace(parameters=parameters, diagnosis=diagnosis, facts=facts, kind="rotary")
    assert verdict._story(evidence).startswith("LuGre friction explains the measured torque")
