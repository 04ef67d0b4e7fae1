"""A log that holds only a part of a session: nothing that it cannot tell is told as found."""

from __future__ import annotations

import gc
import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import as_file, files
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import identify
from idtool.fit.joint import JointFit
from idtool.parameters import Parameter
from idtool.verbs.identification import Identification

from .support import GRAVITY, SINE, SWEEP, changed, record

#: The bench's own numbers.
TRUTH = {
    "base": 0.20,
    "per_payload": 0.42,
    "coulomb": 0.080,
    "static": 0.115,
    "stribeck_velocity": 0.08,
    "viscous": 0.12,
    "bristle_stiffness": 8.0,
    "bristle_damping": 0.2,
    "inertia": 0.008,
}


def steady(frame: pd.DataFrame) -> pd.Series[bool]:
    """Rows at the constant speed of their trial."""
    speed = frame["velocity_command_rad_s"].abs()
    return np.isclose(speed, speed.groupby(frame["trial"]).transform("max"), rtol=1e-3)


def forward(frame: pd.DataFrame) -> pd.Series[bool]:
    return steady(frame) & (frame["velocity_command_rad_s"] > 0.0)


def everything(frame: pd.DataFrame) -> pd.Series[bool]:
    return frame["time_s"] > -1.0


_FAST = changed(SWEEP, speed_rad_s="[0.1, 0.15, 0.2, 0.3, 0.4]", travel_rad="[0.5, 0.6, 0.6, 0.6, 0.6]")
CASES: dict[str, tuple[str, Callable[[pd.DataFrame], pd.Series[bool]], str]] = {
    "constant speeds only": (SWEEP, steady, ""),
    "fast constant speeds only": (_FAST, steady, "no_reversal"),
    "constant speeds, one way": (SWEEP, forward, "one_direction"),
    "one payload": (changed(GRAVITY, payload_kg="[0.4]"), everything, "one_payload"),
    "one fast sine": (
        changed(SINE, frequency_hz="[1.0]", amplitude_rad_s="[0.4]", duration_s="[4.0]"),
        everything,
        "",
    ),
}


def parts_of(result: Identification) -> dict[str, Parameter]:
    parameters = result.parameters
    parts = {**parameters.gravity, **parameters.static, **parameters.dynamic}
    for entry in parameters.effects:
        parts |= entry.parameters
    return parts


def told(result: Identification) -> dict[str, tuple[float, float]]:
    """Value and standard error of everything that is told as found."""
    return {
        name: (one.value, one.stderr)
        for name, one in parts_of(result).items()
        if name in TRUTH and one.identified and one.stderr is not None
    }


@pytest.mark.parametrize("name", CASES)
def test_nothing_is_found_that_the_log_cannot_tell(name: str, tmp_path: Path) -> None:
    recipe, rows, code = CASES[name]
    log = record(recipe, tmp_path / "whole.csv")
    frame = log.frame[rows(log.frame)].reset_index(drop=True)
    result = identify([replace(log, rows=frame)])
    found = told(result)
    wrong = {n: (v, e, TRUTH[n]) for n, (v, e) in found.items() if abs(v - TRUTH[n]) > 4.0 * e}
    assert not wrong
    assert all(stderr < 0.5 * abs(value) for value, stderr in found.values())
    for n, one in parts_of(result).items():
        if not one.identified:  # a bound, not an interval; and a bound that holds
            assert one.stderr is None, n
            assert one.ci95 is None, n
            truth = TRUTH.get(n, math.nan)
            assert not truth < (one.at_least or -math.inf), n
            assert not truth > (one.at_most or math.inf), n
    if code:
        assert code in {one["code"] for one in result.diagnosis["findings"]}


@pytest.mark.parametrize("tilt", [True, False])
def test_an_axis_on_its_side_is_weightless_unless_its_tilt_was_logged(tilt: bool, tmp_path: Path) -> None:
    """Where gravity never acted though it can, a controller still has to be told of it."""
    log = record(SWEEP, tmp_path / "sweep.csv")
    if not tilt:
        columns = [name for name in log.frame if "tilt" in name or "payload" in name]
        log = replace(log, rows=log.frame.drop(columns=columns))
    found = identify([log], friction="coulomb").parameters
    assert found.gravity_model is None
    assert found.weightless is not tilt
    assert identify([log], friction="coulomb", gravity="none").parameters.weightless


def test_logs_that_determine_nothing_say_so_first(tmp_path: Path) -> None:
    log = record(SINE, tmp_path / "noise.csv")
    noise = 0.1 * np.random.default_rng(0).standard_normal(len(log.frame))
    log = replace(log, rows=log.frame.assign(current_a=noise))
    notes = identify([log]).diagnosis["notes"]
    assert any(note.startswith("these logs determine no parameter at all") for note in notes[:2]), notes


def test_logs_that_determine_something_do_not(tmp_path: Path) -> None:
    notes = identify([record(SINE, tmp_path / "sine.csv")]).diagnosis["notes"]
    assert not any("no parameter at all" in note for note in notes)


def test_payload_steps_alone_of_a_soft_bristle() -> None:
    """What such a bristle leaves in time, where no static curve has it, is no spring; intervals hold."""
    with as_file(files("idtool.data")) as data:
        result = identify(data / "session" / "gravity.csv.gz")
        plant = tomllib.loads((data / "demo_rig.toml").read_text(encoding="utf-8"))
    names = [effect["name"] for effect in result.diagnosis["effects"]]
    assert [name for name in names if name != "inertia"] == ["position_ripple"]
    (spring,) = (c for c in result.diagnosis["candidates"] if c["name"] == "position_stiffness")
    assert not spring["accepted"]
    assert spring["why"] == "may be part of what is left, which depends on time"
    (ripple,) = plant["effects"]
    truth = {
        "base": plant["gravity"]["base_nm"],
        "per_payload": plant["gravity"]["per_payload_nm_per_kg"],
        "cycles": ripple["cycles_per_turn"],
        "amplitude_1": ripple["amplitude_1_nm"],
        "amplitude_2": ripple["amplitude_2_nm"],
    }
    found = parts_of(result)
    for name, value in truth.items():
        interval = found[name].ci95
        assert interval is not None
        assert interval[0] < value < interval[1], name


def fits_alive() -> int:
    return sum(isinstance(one, JointFit) for one in gc.get_objects())


def test_what_was_tried_is_let_go() -> None:
    """Fits are large, and the collector of cycles counts objects, not bytes: no cycle may keep one."""
    gc.collect()
    before = fits_alive()  # of other tests
    gc.disable()
    try:
        with as_file(files("idtool.data")) as data:
            result = identify(data / "session" / "gravity.csv.gz")
        assert fits_alive() > before
        del result
        assert fits_alive() == before
    finally:
        gc.enable()
