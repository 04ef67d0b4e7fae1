"""The parameter file: exact round trips, any bytes at all, and what survives a change."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from idtool.effects import registry
from idtool.errors import InputError
from idtool.log import Log
from idtool.model.motion import Motion
from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC, Controller, EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.verbs.predict import predict
from tests.parameters.files import GOOD, put

SLOW = settings(
    max_examples=60,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
GAIN = st.floats(min_value=1e-300, max_value=1e12)
CONSTANTS, PERIOD = st.floats(1e-9, 1e9), st.floats(1e-4, 1.0)
POSITIVE = st.floats(min_value=1e-300, allow_nan=False, allow_infinity=False)
UNSURE = 1e100


def around(value: float) -> Any:
    """An interval that holds the value."""
    wide = st.floats(0.0, 1e3)
    return st.tuples(wide, wide).map(lambda pair: (value - pair[0], value + pair[1]))


def parameter(lower: float = 1e-6, upper: float = 1e6) -> Any:
    """Any that physics allows."""

    def of(value: float) -> Any:
        number = st.just(value)
        error = st.none() | st.floats(1e-300, UNSURE)
        known = st.builds(Parameter, number, error, st.none() | around(value))
        limit = st.none() | st.floats(-UNSURE, UNSURE)
        ends = st.tuples(limit, limit).map(lambda pair: pair if None in pair else sorted(pair))
        open_ = st.builds(
            lambda bound, ends: Parameter(value, None, None, bound, False, *ends), st.booleans(), ends
        )
        return known | open_

    return st.floats(max(lower, -1e6), min(upper, 1e6)).flatmap(of)


SCALAR = st.text(max_size=6) | st.integers(-(2**60), 2**60) | FINITE | st.booleans()
TREE = st.recursive(
    SCALAR,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=6), inner, max_size=3),
)


def part(names: Any) -> Any:
    return st.fixed_dictionaries(dict.fromkeys(names, parameter()))


def part_of(effect: str) -> Any:
    parameters = registry.get(effect).parameters
    return st.fixed_dictionaries({p.name: parameter(p.lower, p.upper) for p in parameters})


@st.composite
def parameter_sets(draw: Any) -> Parameters:
    model = draw(st.none() | st.sampled_from(sorted(GRAVITY_MODELS)))
    weightless = model is None and draw(st.booleans())
    effects = draw(st.lists(st.sampled_from(registry.names()), unique=True, max_size=3))
    return Parameters(
        axis=Axis(draw(st.sampled_from(["rotary", "linear"])), draw(st.none() | CONSTANTS)),
        gravity_model=model,
        gravity=draw(part(GRAVITY_MODELS[model])) if model else {},
        weightless=weightless,
        static=draw(st.just({}) | part(STATIC)),
        dynamic=draw(st.just({}) | part(DYNAMIC)),
        effects=tuple(EffectEntry(name, draw(part_of(name))) for name in effects),
        controller=draw(st.none() | st.builds(Controller, GAIN, GAIN, PERIOD)),
        provenance=draw(st.dictionaries(st.text(max_size=6), TREE, max_size=3)),
    )


def test_a_file_that_somebody_else_wrote_meanwhile_is_not_lost(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    mine = Parameters(axis=Axis())
    mine.write_over(path, None)
    mine.write_over(path, mine)
    theirs = Parameters(axis=Axis(torque_constant=2.0))
    theirs.write(path, force=True)
    with pytest.raises(InputError, match="was written by somebody else meanwhile; run this again"):
        mine.write_over(path, mine)
    with pytest.raises(InputError, match="somebody else"):
        mine.write_over(path, None)
    assert Parameters.read(path) == theirs


def test_what_is_not_determined_has_no_interval(tmp_path: Path) -> None:
    line = "stderr = 0.001, ci95 = [0.198, 0.202], at_bound = false, identified = true"
    for flags in ("at_bound = false, identified = false", "at_bound = true, identified = true"):
        old = GOOD.replace(line, f"{line.partition(', at_bound')[0]}, {flags}, at_most = 0.3")
        base = Parameters.read(put(tmp_path, old)).gravity["base"]
        assert base == Parameter(0.2, at_bound="true, i" in flags, identified=False, at_most=0.3)
        assert base.limits(str) == "at most 0.3"


@SLOW
@given(parameters=parameter_sets())
def test_round_trip_is_exact(tmp_path: Path, parameters: Parameters) -> None:
    path = tmp_path / "params.toml"
    parameters.write(path, force=True)
    assert Parameters.read(path) == parameters


@SLOW
@given(content=st.binary(max_size=200), spot=st.integers(0, len(GOOD)), cut=st.integers(0, 40))
def test_arbitrary_bytes_are_an_input_error_or_parameters(
    tmp_path: Path, content: bytes, spot: int, cut: int
) -> None:
    for data in (content, GOOD[:spot].encode() + content[:20] + GOOD[spot + cut :].encode()):
        with suppress(InputError):
            Parameters.read(put(tmp_path, data))


@SLOW
@given(
    tree=TREE,
    key=st.sampled_from(["schema", "axis", "gravity", "friction", "effects", "controller", "provenance"]),
)
def test_any_document_is_an_input_error_or_parameters(tree: Any, key: str) -> None:
    with suppress(InputError):
        Parameters.from_document({"schema": "ffc-id/params/1", "axis": {}, key: tree})


@pytest.mark.parametrize("name", registry.names())
def test_optional_parameters_of_an_effect_may_be_absent(tmp_path: Path, name: str) -> None:
    everything = registry.get(name).parameters
    needed = {p.name: Parameter(min(max(p.lower, 0.5), p.upper)) for p in everything if not p.optional}
    path = tmp_path / "params.toml"
    Parameters(effects=(EffectEntry(name, needed),)).write(path)
    assert Parameters.read(path).effects[0].parameters == needed
    for missing in needed:
        short = {key: value for key, value in needed.items() if key != missing}
        with pytest.raises(InputError, match="is missing"):
            Parameters(effects=(EffectEntry(name, short),)).write(path, force=True)


def test_one_line_per_parameter(tmp_path: Path) -> None:
    path = put(tmp_path, GOOD)
    Parameters.read(path).write(path, force=True)
    text = path.read_text()
    assert "coulomb_nm = {value = 0.07, at_bound = false, identified = true}\n" in text
    assert "[friction]\n" not in text
    before = text
    Parameters.read(path).write(path, force=True)
    assert path.read_text() == before


def test_uncertainty_that_is_not_finite_is_left_out(tmp_path: Path) -> None:
    odd = Parameter(1.0, math.inf, (-math.inf, math.inf), identified=False)
    Parameters(dynamic=dict.fromkeys(DYNAMIC, odd)).write(tmp_path / "p.toml")
    assert Parameters.read(tmp_path / "p.toml").dynamic["bristle_damping"] == Parameter(1.0, identified=False)


def test_what_could_not_be_read_is_not_written(tmp_path: Path) -> None:
    path = put(tmp_path, GOOD)
    good = Parameters.read(path)
    with pytest.raises(InputError, match="already exists"):
        good.write(path)
    bad = Parameters(static={**good.static, "coulomb": Parameter(math.nan)})
    with pytest.raises(InputError, match=r"coulomb_nm\.value: expected a finite number, found nan"):
        bad.write(path, force=True)
    assert path.read_text() == GOOD
    assert [file.name for file in tmp_path.iterdir()] == ["params.toml"]


def test_the_controller_s_mode_and_start_torque_are_kept(tmp_path: Path) -> None:
    from idtool.parameters import Controller

    path = tmp_path / "params.toml"
    for controller in (
        Controller(2.05, 6.0, 0.01, 0.0128, "light"),
        Controller(2.05, 1.68, 0.01),
    ):
        Parameters(controller=controller).write(path, force=True)
        assert Parameters.read(path).controller == controller
    path.write_text(path.read_text().replace("[controller]", '[controller]\nmode = "lite"'))
    with pytest.raises(InputError, match=r"controller.mode.*light"):
        Parameters.read(path)


COMMENTED = """\
# the elbow of the second unit
schema = "ffc-id/params/1"

[axis] # as on its plate
kind = "rotary"
torque_constant_nm_per_a = 2.67   # K, from the maker

# measured with the new gear
[friction.static]
# in the order of the paper
viscous_nm_s_per_rad = {value = 0.155, at_bound = false, identified = true}
coulomb_nm = {value = 0.07, stderr = 0.0003, at_bound = false, identified = true} # warm
static_nm = {value = 0.03, at_bound = false, identified = true}
stribeck_velocity_rad_s = {value = 0.09, at_bound = false, identified = true}

# the gear has 24 teeth
[[effects]]
name = "position_ripple"
[effects.parameters]
cycles_per_turn = {value = 24.0, at_bound = false, identified = true} # counted
amplitude_1_nm = {value = 0.012, at_bound = false, identified = true}
phase_1_rad = {value = 0.7, at_bound = false, identified = true}
amplitude_2_nm = {value = 0.003, at_bound = false, identified = true}
phase_2_rad = {value = -1.1, at_bound = false, identified = true}

# out of the box
[[effects]]
name = "inertia"
[effects.parameters]
inertia_kg_m2 = {value = 0.0059, at_bound = false, identified = true}

[provenance]
note = "by hand"
"""


def test_comments_and_layout_survive_a_change(tmp_path: Path) -> None:
    file = tmp_path / "p.toml"
    file.write_text(COMMENTED)
    before = Parameters.read(file)
    before.write(file, force=True)
    assert file.read_text() == COMMENTED
    changed = replace(
        before,
        static=before.static | {"coulomb": Parameter(0.071, 0.0002, (0.0706, 0.0714))},
        controller=Controller(2.05, 1.68, 0.01),
        effects=before.effects[:1],
    )
    changed.write(file, force=True)
    text = file.read_text()
    assert Parameters.read(file) == changed
    for line in COMMENTED[: COMMENTED.index("# out of the box")].splitlines():
        assert (
            line.replace("0.07, stderr = 0.0003", "0.071, stderr = 0.0002, ci95 = [0.0706, 0.0714]") in text
        )
    assert text.index("viscous") < text.index("coulomb") < text.index("static_nm")
    assert "inertia" not in text


def test_a_layout_that_cannot_be_kept_costs_no_value(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dotted keys, tables out of order, what is no parameter file: what is written is what was meant."""
    file = tmp_path / "p.toml"
    file.write_text(COMMENTED)
    meant = Parameters.read(file)
    scattered = COMMENTED.replace(
        "[friction.static]", 'provenance.by = "me"\nprovenance.note = "by hand"\n[friction.static]'
    ).replace('[provenance]\nnote = "by hand"\n', "")
    for text in (scattered.replace("[axis] # as on its plate", "[axis]"), "kind = 1\n", "= broken", "\x00"):
        file.write_text(text)
        meant.write(file, force=True)
        assert Parameters.read(file) == meant


def test_a_model_that_overflows_is_refused_instead_of_predicting_nan(tmp_path: Path) -> None:
    time = np.arange(0.0, 10.0, 0.01)
    frame = pd.DataFrame(
        {
            "trial": 0,
            "time_s": time,
            "position_rad": 0.3 * np.sin(time),
            "velocity_rad_s": 0.3 * np.cos(time),
            "torque_nm": 0.1 * np.sign(np.cos(time)) + 0.01 * np.sin(7.0 * time),
        }
    )
    known = Parameters.read(put(tmp_path, GOOD))

    def overflowing(motion: Motion) -> np.ndarray:
        return np.where(motion.time > 3.005, np.inf, 0.0)

    with pytest.raises(InputError, match=r"time_s 3\.01: the model gives no number on 699 rows"):
        predict([Log(frame, known.axis)], known, overflowing)  # type: ignore[arg-type]


def test_an_effect_is_shown_in_short() -> None:
    """As a notebook shows `result.effects`."""
    entry = EffectEntry(
        "backlash",
        {
            "gap": Parameter(0.0123456, 0.00045, (0.0114, 0.0133)),
            "share": Parameter(0.5),
            "left": Parameter(1.0, at_bound=True),
            "right": Parameter(2.0, identified=False),
            "stiffness": Parameter(3.0, identified=False, at_least=1.5),
        },
    )
    assert repr({"backlash": entry}) == (
        "{'backlash': <backlash: gap 0.01235 ± 0.00045, share 0.5, left 1 (at its bound), "
        "right 2 (not determined), stiffness 3 (at least 1.5)>}"
    )
