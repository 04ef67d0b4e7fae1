"""`ffc-id init`, and the axis file in use."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.log import Log
from idtool.parameters.axis import Axis
from idtool.parameters.axis_file import AxisFile
from idtool.rig.bus.settings import Settings

from .support import PROGRAM, ffc_id
from .terminal import Terminal

WHOLE = [
    "--kind", "rotary", "--torque-constant", "2.67", "--name", "elbow", "--range", "-1.5", "1.5",
    "--max-speed", "1", "--max-current", "1.2",
]  # fmt: skip


def test_from_options(tmp_path: Path) -> None:
    done = ffc_id("init", *WHOLE, cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.startswith("written: axis.toml\n")
    assert done.stderr == "next: ffc-id import recording.csv -o log.csv\n"
    file = AxisFile.read(tmp_path / "axis.toml")
    assert file == AxisFile(
        Axis("rotary", 2.67, {"unit": "elbow"}),
        {"lowest": -1.5, "highest": 1.5, "speed": 1.0, "current": 1.2},
    )
    assert 'schema = "ffc-id/axis/1"' in (tmp_path / "axis.toml").read_text()

    degrees = ffc_id("init", "--kind", "rotary", "--range-deg", "-90", "45", "-o", "deg.toml", cwd=tmp_path)
    assert degrees.returncode == 0
    ends = AxisFile.read(tmp_path / "deg.toml").limits
    assert ends == pytest.approx({"lowest": -np.pi / 2, "highest": np.pi / 4})

    again = ffc_id("init", "--kind", "linear", cwd=tmp_path)
    assert again.returncode == 3
    assert "axis.toml: already exists" in again.stderr
    forced = ffc_id("init", "--kind", "linear", "--max-speed", "0.2", "--force", "--json", cwd=tmp_path)
    assert json.loads(forced.stdout) == {
        "schema": "ffc-id/axis/1",
        "axis": {"kind": "linear"},
        "limits": {"speed_m_s": 0.2},
        "file": "axis.toml",
    }


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        ([], 2, "pass --kind rotary or --kind linear"),
        (["--kind", "rotery"], 2, 'did you mean "rotary"?'),
        (["--kind", "rotary", "--torque-constant", "-1"], 3, "must be a finite number above zero"),
        (["--kind", "rotary", "--range", "1", "-1"], 3, "the lowest position is not below the highest"),
        (["--kind", "rotary", "--range", "0", "1", "--range-deg", "0", "60"], 2, "say the same in two units"),
        (["--kind", "linear", "--range-deg", "0", "60"], 2, "--range-deg is for a rotary axis"),
        (["--kind", "rotary", "--max-speed", "nan"], 2, "nan is no finite number"),
        (["--kind", "rotary", "-o", "no/axis.toml"], 3, "make the folder no first"),
    ],
)
def test_refusals(arguments: list[str], code: int, expected: str, tmp_path: Path) -> None:
    done = ffc_id("init", *arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (code, "")
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_in_a_terminal_it_asks_for_what_no_option_says(tmp_path: Path) -> None:
    with Terminal([PROGRAM, "init", "--max-speed", "0.5"], cwd=tmp_path) as screen:
        screen.until("kind of axis (rotary, linear) [rotary]: ")
        screen.send("liner\n")
        screen.until('did you mean "linear"?')
        screen.send("linear\n")
        screen.until("force constant, N/A: ")
        screen.send("thirty\n")
        screen.until('"thirty" is no number')
        screen.send("35\n")
        screen.until("name of this unit: ")
        screen.send("\n")
        screen.until("lowest position, m: ")
        screen.send("-0.1\n")
        screen.until("highest position, m: ")
        screen.send("\n")
        # the speed was told
        screen.until("highest current, A: ")
        screen.send("\n")
        assert screen.finish() == 0
    assert AxisFile.read(tmp_path / "axis.toml") == AxisFile(
        Axis("linear", 35.0), {"lowest": -0.1, "speed": 0.5}
    )


@pytest.fixture
def bare(tmp_path: Path) -> Path:
    """A folder with a log that says nothing of its axis, and an axis file."""
    assert ffc_id("init", *WHOLE, cwd=tmp_path).returncode == 0
    time = 0.01 * np.arange(400)
    frame = pd.DataFrame(
        {
            "time_s": time,
            "position_rad": np.sin(time),
            "velocity_rad_s": np.cos(time),
            "current_a": 0.1 * np.cos(time),
        }
    )
    frame.to_csv(tmp_path / "bare.csv", index=False)
    return tmp_path


def test_a_bare_log_is_read_with_it(bare: Path) -> None:
    without = ffc_id("check", "bare.csv", cwd=bare)
    assert without.returncode == 0, "without a torque constant everything is in A"
    assert ffc_id("check", "bare.csv", "--axis", "axis.toml", cwd=bare).returncode == 0
    both = ffc_id("check", "bare.csv", "--axis", "axis.toml", "--torque-constant", "2", cwd=bare)
    assert both.returncode == 2
    assert "leave --torque-constant away" in both.stderr
    log = Log.read(bare / "bare.csv", axis=AxisFile.read(bare / "axis.toml").axis)
    assert log.axis == Axis("rotary", 2.67, {"unit": "elbow"})

    done = ffc_id("import", "bare.csv", "-o", "log.csv", "--axis", "axis.toml", cwd=bare)
    assert done.returncode == 0, done.stderr
    assert Log.read(bare / "log.csv").axis == log.axis
    twice = ffc_id("import", "bare.csv", "-o", "x.csv", "--axis", "axis.toml", "--kind", "linear", cwd=bare)
    assert twice.returncode == 2
    assert "leave them away" in twice.stderr


def test_a_file_of_another_axis_is_refused(bare: Path) -> None:
    linear = ffc_id("init", "--kind", "linear", "--torque-constant", "35", "-o", "linear.toml", cwd=bare)
    assert linear.returncode == 0
    done = ffc_id("check", "bare.csv", "--axis", "linear.toml", cwd=bare)
    assert done.returncode == 3
    assert "bare.csv, [axis]: is of another axis than the axis file" in done.stderr
    with pytest.raises(InputError, match="a servo turns"):
        Settings.read({"axis": str(bare / "linear.toml")})


def test_a_servo_takes_its_limits_from_it(bare: Path) -> None:
    settings = Settings.read({"axis": str(bare / "axis.toml"), "speed": "0.5"})
    assert (settings.constant, settings.low, settings.high) == (2.67, -1.5, 1.5)
    # what the rig's own words say is stronger
    assert (settings.speed, settings.current) == (0.5, 1.2)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("ffc-id/axis/1", "ffc-id/params/1", "an axis file has schema"),
        ("[limits]", "[limts]", 'limts: unknown key; did you mean "limits"?'),
        ("highest_rad", "higest_rad", 'limits.higest_rad: unknown key; did you mean "highest_rad"?'),
        ("highest_rad", "highest_m", 'did you mean "highest_rad"?'),
        ("highest_rad = 1.5", "highest_rad = true", "expected a finite number, found True"),
        ("current_a = 1.2", "current_a = 0", "expected a finite number above zero, found 0"),
        ("torque_constant_nm_per_a", "torque_constant", 'did you mean "torque_constant_nm_per_a"?'),
        ("kind =", "knd =", 'axis.knd: unknown key; did you mean "kind"?'),
        ("[axis]", "[axes]", 'axes: unknown key; did you mean "axis"?'),
    ],
)
def test_mistakes_in_the_file(old: str, new: str, expected: str, bare: Path) -> None:
    file = bare / "axis.toml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(InputError) as error:
        AxisFile.read(file)
    assert expected in str(error.value)
    assert str(error.value).startswith(str(file))
