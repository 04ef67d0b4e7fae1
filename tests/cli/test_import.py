"""`ffc-id import`: the real program, its words, exit codes and files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from idtool.log import Log

from .support import ffc_id

GOOD = "t_ms,angle_deg,i_mA,note\n0,0,100,a\n10,90,200,b\n20,180,300,c\n"


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.csv"
    path.write_text(GOOD)
    return path


def swinging(path: Path, names: str = "t_ms,angle_deg,i_mA,note") -> Path:
    """A recording of 20 s in ms, deg and mA, whatever its columns say."""
    time = np.arange(4000) * 5.0
    way = 2.0 * np.pi * time / 4000.0
    current = 100.0 * np.cos(way) + 30.0 * np.sign(np.cos(way)) + np.random.default_rng(0).normal(0, 1, 4000)
    rows = (f"{t:g},{a:.3f},{i:.2f},b\n" for t, a, i in zip(time, 90.0 * np.sin(way), current, strict=True))
    path.write_text(names + "\n" + "".join(rows))
    return path


def test_says_what_it_took_for_what(tmp_path: Path) -> None:
    recording = swinging(tmp_path / "run.csv")
    done = ffc_id("import", recording, "-o", "log.csv", "--torque-constant", "2.5", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout == ""
    assert done.stderr == (
        "  time_s        from t_ms [ms]\n"
        "  position_rad  from angle_deg [deg]\n"
        "  current_a     from i_mA [mA]\n"
        "  kept as they are: note\n"
        "log.csv: 4000 rows, 1 trial, rotary axis.\n"
        "next: ffc-id check log.csv\n"
    )
    log = Log.read(tmp_path / "log.csv")
    assert log.axis.torque_constant == 2.5
    assert np.ptp(log.frame["current_a"]) == pytest.approx(0.26, rel=0.05)


def test_a_unit_is_said_once_and_that_it_told_what_the_column_is(tmp_path: Path) -> None:
    recording = swinging(tmp_path / "run.csv", "t [ms],Winkel [deg],iq_mA,note")
    done = ffc_id("import", recording, "-o", "log.csv", cwd=tmp_path)
    assert done.stderr.splitlines()[:3] == [
        "  time_s        from t [ms]",
        "  position_rad  from Winkel [deg]  (by its unit)",
        "  current_a     from iq_mA [mA]",
    ]


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("t_s,angle_deg,i_mA,note", '! column "time_s" steps by 5 s, no rate at which a servo is recorded'),
        ("t_ms,angle_deg,i_A,note", "! the current goes up to 131 A, which no drive of an axis gives"),
    ],
)
def test_what_check_would_refuse_or_doubt_the_import_says_already(
    tmp_path: Path, names: str, said: str
) -> None:
    recording = swinging(tmp_path / "run.csv", names)
    done = ffc_id("import", recording, "-o", "log.csv", "--torque-constant", "0.25", cwd=tmp_path)
    assert said in done.stderr
    assert done.stderr.endswith("next: ffc-id plot log.csv\n")
    sentence = said.removeprefix("! ")
    checked = ffc_id("check", "log.csv", cwd=tmp_path)
    assert sentence in checked.stdout + checked.stderr
    asked = ffc_id("import", recording, "-o", "log.csv", "--force", "--json", "-q", cwd=tmp_path)
    assert json.loads(asked.stdout)["doubts"][0].startswith(sentence)


def test_json_is_one_document_and_quiet_is_quiet(recording: Path, tmp_path: Path) -> None:
    target = tmp_path / "log.csv"
    done = ffc_id(
        "import", recording, "-o", target, "--torque-constant", "2.5", "--json", "-q", "--experiment", "sine"
    )
    assert (done.returncode, done.stderr) == (0, "")
    document = json.loads(done.stdout)
    assert document["schema"] == "ffc-id/import/1"
    assert (document["rows"], document["trials"], document["experiment"]) == (3, 1, "sine")
    assert document["columns"]["position_rad"]["source"] == "angle_deg"
    again = ffc_id(
        "import", recording, "-o", target, "--torque-constant", "2.5", "-q", "--force", "--experiment", "sine"
    )
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["absent.csv", "-o", "log.csv"], 3, "ffc-id: absent.csv: no such file; check the path."),
        (
            ["run.csv", "-o", "run.csv", "--torque-constant", "1"],
            2,
            "is what is read here; name another file",
        ),
        (["run.csv", "-o", "no/log.csv", "--torque-constant", "1"], 3, "make the folder no first"),
        (["run.csv", "-o", "log.csv", "--where", "note=z"], 3, "no row has note = z; it holds a, b, c."),
        (["run.csv", "-o", "log.csv", "--unit", "position=dge"], 2, '"dge" is no unit of angle'),
        (["run.csv", "-o", "log.csv", "--map", "position_rad"], 2, "write it as --map NAME=VALUE;"),
        (["run.csv", "-o", "log.csv", "--unwrap", "-1"], 2, "above zero;"),
        (["run.csv", "-o", "run.csv", "--force"], 2, "is what is read here; name another file"),
        (["run.csv"], 2, "Missing option '-o'"),
    ],
)
def test_refusals(recording: Path, tmp_path: Path, arguments: list[str], code: int, expected: str) -> None:
    done = ffc_id("import", *arguments, cwd=tmp_path)
    assert done.returncode == code
    assert done.stdout == ""
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    if code == 3:
        assert done.stderr.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["run.csv"]
    assert recording.read_text() == GOOD


def test_a_joint_of_a_bag(tmp_path: Path) -> None:
    from mcap_ros2.writer import Writer

    text = (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
        + "=" * 80
        + "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
        + "=" * 80
        + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    )
    with open(tmp_path / "run.mcap", "wb") as stream, Writer(stream) as writer:
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", text)
        for k in range(5):
            message = {
                "header": {"stamp": {"sec": 1, "nanosec": k * 1_000_000}, "frame_id": ""},
                "name": ["a", "b"],
                "position": [k, -k],
                "velocity": [1, 2],
                "effort": [3, 4],
            }
            writer.write_message("/joint_states", schema, message)
    done = ffc_id("import", "run.mcap", "-o", "log.csv", cwd=tmp_path)
    assert done.returncode == 3
    assert done.stderr == (
        'ffc-id: run.mcap: holds several axes: column "joint" is a, b; choose one with --where "joint=a" '
        '(trials of one: --trial-by "joint").\n'
    )
    done = ffc_id("import", "run.mcap", "-o", "log.csv", "--where", "joint=b", cwd=tmp_path)
    assert done.returncode == 0
    assert "torque_nm       from effort [N m]" in done.stderr
    assert Log.read(tmp_path / "log.csv").frame["position_rad"].tolist() == [0, -1, -2, -3, -4]
