"""Reading a parameter file: what a hand writes, older files, and nonsense told in one sentence."""

from __future__ import annotations

import gzip
import math
from pathlib import Path
from typing import Any

import pytest

from idtool.parameters import Controller, Parameter, Parameters
from idtool.parameters.axis import Axis
from tests.parameters.files import GOOD, put, refused


@pytest.mark.parametrize("wrap", [str, "\ufeff{}".format, lambda text: text.replace("\n", "\r\n")])
def test_reads_a_file_written_by_hand(tmp_path: Path, wrap: Any) -> None:
    found = Parameters.read(put(tmp_path, wrap(GOOD)))
    assert found.axis == Axis("rotary", 2.67)
    assert found.gravity["base"] == Parameter(0.2, 0.001, (0.198, 0.202))
    assert found.static["coulomb"].value == 0.07
    assert found.dynamic["bristle_damping"].value == 0.297
    assert found.effects[0].name == "inertia"
    assert found.controller == Controller(2.05, 1.68, 0.01)
    assert found.provenance == {"made_by": "hand"}


def test_parts_may_be_absent(tmp_path: Path) -> None:
    found = Parameters.read(put(tmp_path, 'schema = "ffc-id/params/1"\n[axis]\nkind = "linear"\n'))
    assert found == Parameters(axis=Axis("linear"))


def rippled(kind: str, key: str, tool: str) -> str:
    rest = " ".join(f"\n{name} = {{value = 0.0}}" for name in ("phase_1_rad", "phase_2_rad"))
    unit = "nm" if kind == "rotary" else "n"
    rest += "".join(f"\namplitude_{k}_{unit} = {{value = 0.1}}" for k in (1, 2))
    return f"""schema = "ffc-id/params/1"
[axis]
kind = "{kind}"
[[effects]]
name = "position_ripple"
[effects.parameters]
{key} = {{value = 12.0, stderr = 0.6, ci95 = [11.0, 13.0]}}{rest}
[provenance]
tool = "{tool}"
"""


@pytest.mark.parametrize(
    ("kind", "key", "tool", "times"),
    [
        ("rotary", "cycles_per_turn", "ffc-id 0.2.0", 1.0),
        ("rotary", "cycles_per_rad", "ffc-id 0.1.0", 1.0),
        ("linear", "cycles_per_m", "ffc-id 0.2.0", 1.0),
        ("linear", "cycles_per_m", "ffc-id 0.1.0", 1.0 / (2.0 * math.pi)),
    ],
)
def test_waves_of_a_ripple_in_files_of_today_and_older(
    tmp_path: Path, kind: str, key: str, tool: str, times: float
) -> None:
    (entry,) = Parameters.read(put(tmp_path, rippled(kind, key, tool))).effects
    found = entry.parameters["cycles"]
    assert found.value == pytest.approx(12.0 * times)
    assert found.stderr == pytest.approx(0.6 * times)
    assert found.ci95 == pytest.approx((11.0 * times, 13.0 * times))
    assert (found.identified, found.at_bound) == (True, False)


#: what is replaced in GOOD, by what, and what the sentence says
BAD: dict[str, tuple[str, str, str]] = {
    "schema": ("params/1", "params/2", "schema: unknown schema 'ffc-id/params/2'; expected schema ="),
    "no schema": ('schema = "ffc-id/params/1"', "", "schema: is missing"),
    "no axis": ("[axis]", "[provenance.axis]", "[axis]: is missing"),
    "kind": ('"rotary"', '"rotery"', "axis.kind: unknown kind of axis 'rotery'; did you mean \"rotary\""),
    "other kind": ('"rotary"', '"linear"', "torque_constant_nm_per_a does not fit a linear axis"),
    "K": ("2.67", "0.0", "axis.torque_constant_nm_per_a: the torque constant must be"),
    "stranger": ("[provenance]", "[provenence]", 'provenence: unknown key; did you mean "provenance"'),
    "top number": ("schema =", "gravity_nm = 3\nschema =", "gravity_nm: unknown key"),
    "model": ('"slide"', '"slid"', "gravity.model: unknown gravity model 'slid'; did you mean \"slide\""),
    "model list": ('"slide"', '["slide"]', "gravity.model: unknown gravity model"),
    "no model": ('model = "slide"\n', "", "gravity.model: is missing"),
    "no gravity, and a number": ('"slide"', '"none"', "gravity.base_nm: unknown key"),
    "key": ("coulomb_nm", "coulom_nm", 'friction.static.coulom_nm: unknown key; did you mean "coulomb_nm"'),
    "unit of the other kind": ("coulomb_nm", "coulomb_n", 'did you mean "coulomb_nm"'),
    "key missing": ("static_nm = {value = 0.03}\n", "", "friction.static.static_nm: is missing"),
    "friction part": ("[friction.dynamic]", "[friction.dynamics]", 'did you mean "dynamic"'),
    "friction number": ("[controller]", "[controller.friction]", "controller.friction: unknown key"),
    "number": (
        "{value = 0.07}",
        "0.07",
        "friction.static.coulomb_nm: expected a table, found 0.07; write {value",
    ),
    "text": (
        "{value = 0.07}",
        '{value = "0.07"}',
        "coulomb_nm.value: expected a finite number, found '0.07'",
    ),
    "truth": ("{value = 0.07}", "{value = true}", "expected a finite number, found True"),
    "NaN": ("{value = 0.07}", "{value = nan}", "coulomb_nm.value: expected a finite number, found nan"),
    "infinite": ("{value = 0.07}", "{value = inf}", "expected a finite number, found inf"),
    "huge": ("{value = 0.07}", "{value = 1" + "0" * 400 + "}", "expected a finite number, found 1000"),
    "too huge": ("{value = 0.07}", "{value = 1" + "0" * 5000 + "}", "is not TOML"),
    "no value": ("{value = 0.07}", "{stderr = 0.07}", "coulomb_nm.value: is missing"),
    "empty": ("{value = 0.07}", "{}", "coulomb_nm.value: is missing"),
    "misspelt": ("{value = 0.07}", "{valeu = 0.07}", 'coulomb_nm.valeu: unknown key; did you mean "value"'),
    "negative": (
        "{value = 0.07}",
        "{value = -0.07}",
        "coulomb_nm.value: expected a number >= 0, found -0.07",
    ),
    "of no machine": (
        "{value = 0.2,",
        "{value = -1e300,",
        "gravity.base_nm.value: expected a number of a machine, below 1e+12, found -1e+300",
    ),
    "error of no machine": (
        "stderr = 0.001",
        "stderr = 1e300",
        "gravity.base_nm.stderr: expected a number of a machine, below 1e+100, found 1e+300",
    ),
    "limits turned": (
        "coulomb_nm = {value = 0.07}",
        "coulomb_nm = {value = 0.07, identified = false, at_least = 0.2, at_most = 0.1}",
        "friction.static.coulomb_nm: at_least is above at_most",
    ),
    "no friction to bend against": (
        "coulomb_nm = {value = 0.07}\nstatic_nm = {value = 0.03}",
        "coulomb_nm = {value = 0.0}\nstatic_nm = {value = 0.0}",
        "friction.static.coulomb_nm.value: both levels of the friction are 0",
    ),
    "negative inertia": (
        "inertia_kg_m2 = {value = 0.001}",
        "inertia_kg_m2 = {value = -0.001}",
        "effects[0].parameters.inertia_kg_m2.value: expected a number >= 0 (inertia J at the shaft",
    ),
    "zero": ("{value = 0.09}", "{value = 0}", "stribeck_velocity_rad_s.value: expected a number > 0"),
    "stderr": ("stderr = 0.001", "stderr = -0.001", "gravity.base_nm.stderr: is negative"),
    "stderr NaN": ("stderr = 0.001", "stderr = nan", "gravity.base_nm.stderr: expected a finite number"),
    "ci95": ("[0.198, 0.202]", "[0.198]", "gravity.base_nm.ci95: expected [low, high], found [0.198]"),
    "ci95 turned": ("[0.198, 0.202]", "[0.202, 0.198]", "low is above high"),
    "ci95 elsewhere": (
        "[0.198, 0.202]",
        "[0.21, 0.22]",
        "gravity.base_nm.ci95: [0.21, 0.22] does not hold the value 0.2",
    ),
    "ci95 text": ("[0.198, 0.202]", '["a", 0.202]', "ci95: expected a finite number, found 'a'"),
    "flag": ("at_bound = false", "at_bound = 0", "gravity.base_nm.at_bound: expected true or false, found 0"),
    "effect": (
        '"inertia"',
        '"inertai"',
        "effects[0].name: unknown effect 'inertai'; did you mean \"inertia\"",
    ),
    "effect list": ('"inertia"', "[1]", "effects[0].name: unknown effect [1]"),
    "effect unnamed": ('name = "inertia"', "", "effects[0].name: is missing"),
    "effect twice": (
        "[controller]",
        GOOD[GOOD.index("[[eff") : GOOD.index("[contr")] + "[controller]",
        "appears twice",
    ),
    "effect key": ("inertia_kg_m2", "inertia", 'did you mean "inertia_kg_m2"'),
    "effect key missing": ("inertia_kg_m2 = {value = 0.001}", "", "inertia_kg_m2: is missing"),
    "effects table": (
        "[[effects]]",
        "[effects]",
        "effects: expected a list of tables; write it as [[effects]]",
    ),
    "controller key": ("period_s", "period", 'controller.period: unknown key; did you mean "period_s"'),
    "controller of no machine": (
        "period_s = 0.01",
        "period_s = 1e300",
        "controller.period_s: expected a number from 0.0001 to 1, found 1e+300",
    ),
    "gain of no machine": (
        "command_gain_s = 2.05",
        "command_gain_s = 1e300",
        "controller.command_gain_s: expected a number below 1e+12, found 1e+300",
    ),
    "period of no controller": (
        "period_s = 0.01",
        "period_s = 1e-9",
        "controller.period_s: expected a number from 0.0001 to 1, found 1e-09",
    ),
    "K of no motor": (
        "torque_constant_nm_per_a = 2.67",
        "torque_constant_nm_per_a = 1e300",
        "axis.torque_constant_nm_per_a: the torque constant is 1e+300, which no motor has",
    ),
    "controller": (
        "period_s = 0.01",
        "period_s = 0",
        "controller.period_s: expected a number from 0.0001 to 1",
    ),
    "controller gone": ("period_s = 0.01", "", "controller.period_s: is missing"),
    "no TOML": ("[gravity]", "[gravity", "is not TOML ("),
    "twice": ('model = "slide"', 'model = "slide"\nmodel = "arm"', "is not TOML ("),
    "nested": ('"hand"', "[" * 5000, "is not TOML ("),
    "date": ('"hand"', "2024-99-99", "is not TOML ("),
}


@pytest.mark.parametrize("case", BAD)
def test_nonsense_is_one_sentence(tmp_path: Path, case: str) -> None:
    old, new, expected = BAD[case]
    assert old in GOOD
    assert expected in refused(put(tmp_path, GOOD.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("", "the file is empty"),
        (b"\xff\x00\xfe", "is not a text file"),
        (b"#" * (8 << 20) + b"#", "holds over 8 MiB, too much for a parameter file"),
        (gzip.compress(GOOD.encode())[:-9], "cut short"),
        ("gravity = 3\n", "schema: is missing"),
        ('schema = "ffc-id/params/1"\naxis = 3\n', "axis is not a table"),
        ('schema = "ffc-id/params/1"\nfriction = 3\n[axis]\n', "friction: expected a table"),
        ('schema = "ffc-id/params/1"\ngravity = [1]\n[axis]\n', "gravity: expected a table"),
        ('schema = "ffc-id/params/1"\neffects = [1]\n[axis]\n', "effects[0]: expected a table"),
        ('schema = "ffc-id/params/1"\ncontroller = 1\n[axis]\n', "controller: expected a table"),
        ('schema = "ffc-id/params/1"\nprovenance = 1\n[axis]\n', "provenance: expected a table"),
    ],
)
def test_files_that_are_none(tmp_path: Path, content: str | bytes, expected: str) -> None:
    assert expected in refused(put(tmp_path, content))


def test_paths_that_are_no_file(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path / "absent.toml")
    assert "is a folder where a parameter file should be" in refused(tmp_path)


@pytest.mark.parametrize(("beyond", "passes"), [(0.9e-6, True), (1.3e-6, False)])
def test_a_value_may_be_beyond_its_interval_by_rounding(tmp_path: Path, beyond: float, passes: bool) -> None:
    content = GOOD.replace(
        "{value = 0.2, stderr = 0.001, ci95 = [0.198, 0.202]",
        f"{{value = {0.2 + beyond}, stderr = 0.001, ci95 = [0.198, 0.2]",
    )
    if passes:
        assert Parameters.read(put(tmp_path, content)).gravity["base"].value == 0.2 + beyond
    else:
        assert "does not hold the value" in refused(put(tmp_path, content))


@pytest.mark.parametrize(("constant", "passes"), [(1e-9, True), (0.9e-9, False), (1e9, True), (1.1e9, False)])
def test_a_motor_has_no_such_constant(tmp_path: Path, constant: float, passes: bool) -> None:
    """Beyond these a power of ten slipped."""
    file = put(tmp_path, GOOD.replace("2.67", repr(constant)))
    if passes:
        assert Parameters.read(file).axis.torque_constant == constant
    else:
        assert "which no motor has (expected 1e-09 to 1e+09)" in refused(file)
