"""check, the fits, identify, diagnose, predict and demo as a user runs them."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from idtool import Log, Parameters

from .support import ffc_id, program

Change = Callable[[list[str]], list[str]]


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Logs of the bench, quick to fit."""
    folder = tmp_path_factory.mktemp("bench")
    shorter = {"gravity": ("--payloads", "0,0.5,1,1.5"), "sweep": ("--travel", "2.6"), "sine": ()}
    for name, options in shorter.items():
        done = ffc_id(f"run-{name}", "--rig", "sim:bench", *options, "-o", folder / f"{name}.csv", "-q")
        assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def result(logs: Path) -> Path:
    done = ffc_id("identify", "gravity.csv", "sweep.csv", "sine.csv", "-o", "result", "-q", cwd=logs)
    assert done.returncode == 0, done.stderr
    assert "verdict: adequate" in done.stdout
    assert done.stderr == ""
    return logs / "result"


def one_sentence(done: subprocess.CompletedProcess[str], code: int, part: str) -> None:
    assert done.returncode == code, done.stderr
    assert part in done.stderr
    assert "Traceback" not in done.stderr
    if code == 3:
        assert done.stderr.startswith("ffc-id: ")
        assert len(done.stderr.strip().splitlines()) == 1


def test_check_says_what_the_logs_determine(logs: Path) -> None:
    done = ffc_id("check", "gravity.csv", "sweep.csv", "sine.csv", "--json", cwd=logs)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "ffc-id/check/1"
    can = {verdict["what"] for verdict in document["session"]["can"]}
    assert {"gravity: per payload", "friction: sigma0 and sigma1", "effect: load_dependent_friction"} <= can
    alone = json.loads(ffc_id("check", "sine.csv", "--json", cwd=logs).stdout)
    cannot = {verdict["what"]: verdict for verdict in alone["session"]["cannot"]}
    run = "ffc-id run-gravity --rig sim:bench -o gravity.csv"
    assert cannot["gravity: per payload"]["run"] == run
    assert "payload" in cannot["effect: load_dependent_friction"]["why"]


def test_identify_leaves_a_whole_folder(result: Path) -> None:
    diagnosis = json.loads((result / "diagnosis.json").read_text())
    assert diagnosis["schema"] == "ffc-id/diagnosis/1"
    assert diagnosis["verdict"] == "adequate"
    assert [effect["name"] for effect in diagnosis["effects"]] == ["inertia"]
    assert diagnosis["error"]["metric"] == "rmse_nm"
    assert set(diagnosis["error"]["by_experiment"]) == {"gravity", "sweep", "sine"}
    assert all(candidate["why"] for candidate in diagnosis["candidates"])
    assert Parameters.read(result / "params.toml").static["coulomb"].value == pytest.approx(0.08, rel=0.02)
    assert "<html" in (result / "report.html").read_text()
    assert len(list((result / "figures").glob("*.png"))) >= 10


def test_predict_writes_the_four_columns(logs: Path, result: Path) -> None:
    done = ffc_id(
        "run", "--recipe", "validation", "--rig", "sim:bench", "-o", "validation.csv", "-q", cwd=logs
    )
    assert done.returncode == 0, done.stderr
    done = ffc_id(
        "predict", "validation.csv", "-p", "result/params.toml", "-o", "out.csv", "--json", cwd=logs
    )
    assert done.returncode == 0, done.stderr
    error = json.loads(done.stdout)["errors"]["validation"]
    frame = pd.read_csv(logs / "out.csv")
    assert list(frame.columns) == ["trial", "time_s", "torque_nm", "torque_predicted_nm"]
    left = frame["torque_nm"] - frame["torque_predicted_nm"]
    assert float((left**2).mean() ** 0.5) == pytest.approx(error["rmse"], rel=1e-6)
    noise = json.loads((result / "diagnosis.json").read_text())["error"]["noise_floor"]
    assert error["rmse"] < 1.2 * noise


def test_diagnose_starts_from_a_parameter_file(logs: Path, result: Path) -> None:
    done = ffc_id(
        "diagnose", "sweep.csv", "sine.csv", "-p", "result/params.toml", "-o", "diagnosis", "--json",
        "--without", "backlash", "--tolerance", "1", "--validate", "gravity.csv", cwd=logs,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["verdict"] == "adequate"
    assert set(document["validation"]["errors"]) == {"gravity"}
    assert "left out as asked: backlash." in document["notes"]
    assert Parameters.read(logs / "diagnosis" / "params.toml").provenance["tolerance_percent"] == 1.0
    assert (logs / "diagnosis" / "params.toml").exists()


def replaced(old: str, new: str, rows: slice = slice(None)) -> Change:
    def change(lines: list[str]) -> list[str]:
        return [
            line.replace(old, new) if k in range(len(lines))[rows] else line for k, line in enumerate(lines)
        ]

    return change


def header_rows(lines: list[str]) -> int:
    return next(k for k, line in enumerate(lines) if not line.startswith("#")) + 1


def cells(name: str, value: Callable[[int], str]) -> Change:
    """A column with other values, by the row."""

    def change(lines: list[str]) -> list[str]:
        n = header_rows(lines)
        place = lines[n - 1].strip().split(",").index(name)
        rows = [line.strip().split(",") for line in lines[n:]]
        for k, row in enumerate(rows):
            row[place] = value(k)
        return lines[:n] + [",".join(row) + "\n" for row in rows]

    return change


def appended(name: str, value: str) -> Change:
    def change(lines: list[str]) -> list[str]:
        n = header_rows(lines)
        added = [*["" for _ in lines[: n - 1]], name, *[value for _ in lines[n:]]]
        return [
            f"{line.rstrip()},{cell}\n" if cell else line for line, cell in zip(lines, added, strict=True)
        ]

    return change


def every(value: str) -> Callable[[int], str]:
    return lambda _: value


def arrival(row: int) -> str:
    """Packets of 20 rows every 0.1 s."""
    return f"{0.1 * (row // 20) + 1e-5 * (row % 20):.5f}"


BAD: dict[str, tuple[Change, str]] = {
    "no unit": (replaced("current_a", "current"), 'column "current" has no unit'),
    "misspelt": (replaced("current_a", "curent_a"), 'needs a column "current_a"'),
    "zero constant": (replaced("2.67", "0"), "above zero"),
    "constant current": (cells("current_a", every("0.1")), "is the same on every row"),
    "empty": (lambda lines: [], "the file is empty"),
    "no rows": (lambda lines: lines[: header_rows(lines)], "has no data rows"),
    "few rows": (lambda lines: lines[: header_rows(lines) + 20], "only 20 rows"),
    "no drive": (appended("drive_on", "0"), "nothing drove the axis"),
    "one row": (lambda lines: lines[: header_rows(lines) + 1], "only 1 row;"),
    "tilt in degrees": (
        cells("tilt_alpha_rad", every("90")),
        'column "tilt_alpha_rad" holds 90, not an angle within',
    ),
    "payload below nothing": (
        cells("payload_kg", every("-0.1")),
        'column "payload_kg" holds -0.1, not a mass',
    ),
    "times of arrival": (cells("time_s", arrival), 'column "time_s" comes in bursts'),
    "short": (lambda lines: lines[: header_rows(lines) + 300], "too few to hold any out"),
    "time goes back": (lambda lines: [*lines, lines[-50]], "time goes backwards"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_logs_are_one_sentence_and_leave_nothing(logs: Path, tmp_path: Path, name: str) -> None:
    change, part = BAD[name]
    lines = (logs / "sine.csv").read_text().splitlines(keepends=True)
    (tmp_path / "bad.csv").write_text("".join(change(lines)))
    done = ffc_id("identify", "bad.csv", "-o", "out", "-q", cwd=tmp_path)
    one_sentence(done, 3, part)
    assert not (tmp_path / "out").exists()


def test_a_session_without_a_row_to_compare(logs: Path, tmp_path: Path) -> None:
    lines = (logs / "sine.csv").read_text().splitlines(keepends=True)
    n = header_rows(lines)
    (tmp_path / "slow.csv").write_text("".join([*lines[:n], *lines[n::100]]))
    for words in (["check"], ["identify", "-o", "out"]):
        one_sentence(ffc_id(*words, "slow.csv", "-q", cwd=tmp_path), 3, "no row is left to be compared")


def test_half_a_last_row_is_used_up_to_the_last_whole_one(logs: Path, tmp_path: Path) -> None:
    text = (logs / "sine.csv").read_text()
    (tmp_path / "cut.csv").write_text(text[: int(0.8 * len(text))])
    done = ffc_id("check", "cut.csv", "--json", cwd=tmp_path)
    assert done.returncode == 0
    assert (
        "was cut short; it is used up to its last whole row" in json.loads(done.stdout)["logs"][0]["findings"]
    )
    assert Log.read(tmp_path / "cut.csv").incomplete


def test_a_column_of_another_unit_is_told_of(logs: Path, tmp_path: Path) -> None:
    text = (logs / "sine.csv").read_text()
    (tmp_path / "deg.csv").write_text(text.replace("position_rad", "position_deg", 1))
    done = ffc_id("check", "deg.csv", cwd=tmp_path)
    said = "note: deg.csv: column position_deg is not read; ffc-id import makes it position_rad."
    assert done.stderr.splitlines()[0] == said
    assert "is not read" not in ffc_id("check", str(logs / "sine.csv"), cwd=tmp_path).stderr


def test_row_numbers_are_told_of_once(logs: Path, tmp_path: Path) -> None:
    for name in ("gravity", "sine"):
        Log.read(logs / f"{name}.csv").frame.to_csv(tmp_path / f"{name}.csv")
    done = ffc_id("check", "gravity.csv", "sine.csv", "-q", "--torque-constant", "1", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr.count("numbers the rows") == 1


def test_wrong_uses_name_the_remedy(logs: Path, result: Path) -> None:
    one_sentence(ffc_id("fit-gravity", "sweep.csv", "-p", "p.toml", cwd=logs), 3, "run-gravity")
    one_sentence(ffc_id("fit-dynamic", "sine.csv", "-p", "p.toml", cwd=logs), 3, "fit-static first")
    assert "made if missing" not in ffc_id("fit-dynamic", "--help").stdout
    told = "f.txt: expected a name that ends in .png or .svg"
    one_sentence(ffc_id("fit-static", "sine.csv", "-p", "p.toml", "--figure", "f.txt", cwd=logs), 2, told)
    one_sentence(ffc_id("completion", cwd=logs), 2, "Choose from: bash, zsh, fish")
    one_sentence(ffc_id("identify", "nosuch.csv", "-o", "x", cwd=logs), 3, "no such file")
    one_sentence(ffc_id("identify", ".", "-o", "x", cwd=logs), 3, "is a folder")
    one_sentence(ffc_id("identify", "sine.csv", "-o", "result", cwd=logs), 3, "pass --force")
    one_sentence(ffc_id("identify", "sine.csv", "-o", "sine.csv", cwd=logs), 3, "is a file where a folder")
    one_sentence(ffc_id("predict", "sine.csv", "-p", "no.toml", "-o", "y.csv", cwd=logs), 3, "no such file")
    one_sentence(
        ffc_id("identify", "sine.csv", "-o", "x", "--friction", "lugr", cwd=logs), 2, 'did you mean "lugre"?'
    )
    one_sentence(ffc_id("identfy"), 2, 'did you mean "identify"')
    assert not (logs / "p.toml").exists()
    assert not (logs / "x").exists()


@pytest.mark.long
def test_demo_shows_the_whole_loop(tmp_path: Path) -> None:
    done = program("demo", "-o", "demo", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert max(abs(row["off_percent"]) for row in document["recovered"]) < 5.0
    assert [effect["name"] for effect in document["diagnosis"]["effects"]] == ["position_ripple", "inertia"]
    held_out = document["diagnosis"]["error"]["held_out"]
    assert held_out["after"] < 0.6 * held_out["before"]
    for figures in document["teach"].values():
        assert 15.0 < figures["speed_mm_s"] < 23.0
        assert figures["stop_ms"] <= 48.0
    assert (tmp_path / "demo" / "report.html").exists()
