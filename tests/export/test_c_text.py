"""What is written, and what is refused."""

from __future__ import annotations

import math
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from idtool.effects.inertia import Inertia
from idtool.errors import InputError, UsageError
from idtool.export.c_controller import export_c
from idtool.export.c_literals import c_float
from idtool.parameters import Controller, Parameter
from tests.control.double import BENCH, parameters

from .twin import FLAGS

STUBS = Path(__file__).parent / "stubs"


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_literal_is_the_number(value: float) -> None:
    text = c_float(value, "x").strip("()")
    assert text.endswith("f")
    assert "." in text or "e" in text
    assert np.float32(text[:-1]) == np.float32(value)


def test_what_single_precision_cannot_hold_is_refused() -> None:
    with pytest.raises(InputError, match=r"gravity.*single precision"):
        c_float(1e39, "gravity")
    with pytest.raises(InputError, match="not a number"):
        c_float(math.nan, "gravity")


def test_symbols_and_files_begin_with_the_name(tmp_path: Path) -> None:
    result = export_c(parameters(BENCH), tmp_path / "wrist", name="wrist_1")
    assert [file.name for file in result.files] == ["wrist_1.h", "wrist_1.c", "wrist_1_servo.h", "wrist.ino"]
    assert "ffc_" not in (tmp_path / "wrist" / "wrist_1.h").read_text().replace("ffc_id", "")


@pytest.mark.parametrize("name", ["", "9a", "Upper", "a b", "a-b", "x" * 40, "é"])
def test_a_name_that_is_no_identifier_is_a_usage_error(name: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="C symbols"):
        export_c(parameters(BENCH), tmp_path / "out", name=name)
    assert not (tmp_path / "out").exists()


def test_an_effect_without_c_is_refused_unless_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Inertia, "in_c", lambda self, values: None)
    file = parameters(BENCH, inertia={"inertia": 0.02}, torque_offset={"offset": 0.01})
    with pytest.raises(InputError, match="inertia has no C form; leave it out with --without inertia"):
        export_c(file, tmp_path)
    result = export_c(file, tmp_path, without=["inertia"])
    assert result.effects == ("torque_offset",)
    assert any("inertia is left out" in note for note in result.notes)


def test_leaving_out_what_is_not_there_is_a_usage_error(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match='did you mean "inertia"'):
        export_c(parameters(BENCH, inertia={"inertia": 0.02}), tmp_path, without=["inertai"])


def test_what_the_controller_cannot_compensate_is_said_in_the_header(tmp_path: Path) -> None:
    file = parameters(BENCH, external_periodic={"frequency": 1.0, "amplitude": 0.1, "phase": 0.0})
    result = export_c(file, tmp_path)
    assert result.effects == ()
    assert "external_periodic is not compensated" in (tmp_path / "ffc.h").read_text()


def test_files_are_not_overwritten_unasked_nor_in_part(tmp_path: Path) -> None:
    (tmp_path / "ffc.c").write_text("mine")
    with pytest.raises(InputError, match="already exists"):
        export_c(parameters(BENCH), tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["ffc.c"]
    with pytest.raises(InputError, match=r"ffc\.c: is a file where a folder should be; name a folder"):
        export_c(parameters(BENCH), tmp_path / "ffc.c", force=True)
    export_c(parameters(BENCH), tmp_path, force=True)
    assert "mine" not in (tmp_path / "ffc.c").read_text()


def test_a_source_cannot_end_the_comment(tmp_path: Path) -> None:
    export_c(parameters(BENCH), tmp_path, source="a */ int evil; /*\n.toml")
    first = (tmp_path / "ffc.c").read_text().split("*/")[0]
    assert "int evil" in first


def test_the_same_file_gives_the_same_text(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        export_c(parameters(BENCH), tmp_path / folder)
    assert (tmp_path / "one" / "ffc.c").read_bytes() == (tmp_path / "two" / "ffc.c").read_bytes()


def test_a_period_too_short_to_count_the_light_mode_s_times_is_refused(tmp_path: Path) -> None:
    file = replace(parameters(BENCH), controller=Controller(2.05, 1.68, 1e-5, mode="light"))
    with pytest.raises(InputError, match="cannot count its times in periods of 1e-05 s"):
        export_c(file, tmp_path)


def test_two_axes_live_in_one_program(tmp_path: Path) -> None:
    if shutil.which("gcc") is None:
        pytest.skip("no gcc here")
    other = replace(
        parameters(BENCH, inertia={"inertia": 0.02}), controller=Controller(2.05, 1.68, 0.01, mode="light")
    )
    export_c(parameters(BENCH), tmp_path, name="shoulder")
    export_c(
        replace(other, gravity={**other.gravity, "base": Parameter(0.5)}), tmp_path, name="elbow", force=True
    )
    main = tmp_path / "main.c"
    main.write_text(
        '#include "shoulder.h"\n#include "elbow.h"\nint main(void)\n{\n    static shoulder_controller a;\n'
        "    static elbow_controller b;\n    shoulder_reset(&a);\n    elbow_reset(&b);\n"
        "    return a.state == SHOULDER_STARTING && b.state == ELBOW_STARTING ? 0 : 1;\n}\n"
    )
    sources = [main, tmp_path / "shoulder.c", tmp_path / "elbow.c"]
    done = subprocess.run(
        ["gcc", *FLAGS, *sources, "-lm", "-o", tmp_path / "two"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert subprocess.run([tmp_path / "two"], check=False).returncode == 0
