"""A payload adds to what has to be accelerated; where the data show it, that is in the base model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from idtool.parameters import Parameters
from idtool.verbs.identify import identify
from testbench.plants import Plant, record_session

CLEAN = Plant(0.080, 0.115, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)


def found(per_payload: float) -> tuple[Parameters, str]:
    """What is identified on an axis with payload steps."""
    effects = {"inertia": {"inertia_kg_m2": 0.0, "per_payload_m2": per_payload}} if per_payload else {}
    logs = record_session(replace(CLEAN, effects=effects), "lab", 0, ("gravity", "sine"), hard=True)
    result = identify(logs, seed=0)
    return result.parameters, result.diagnosis["verdict"]


def test_what_a_payload_adds_is_found_and_is_no_effect(tmp_path: Path) -> None:
    """The inertia was 20 % too large without it, and a clean axis unexplained."""
    parameters, verdict = found(0.01)
    assert verdict == "adequate"
    (entry,) = parameters.effects
    assert entry.parameters["inertia"].value == pytest.approx(0.008, rel=0.03)
    assert entry.parameters["per_payload"].value == pytest.approx(0.01, rel=0.03)
    parameters.write(tmp_path / "params.toml")
    assert "per_payload_m2 = " in (tmp_path / "params.toml").read_text()
    again = Parameters.read(tmp_path / "params.toml")
    assert again.effects == parameters.effects


def test_without_it_there_is_one_inertia() -> None:
    parameters, _ = found(0.0)
    assert set(parameters.effects[0].parameters) == {"inertia"}
