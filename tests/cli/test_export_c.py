"""`ffc-id export c`, the real program."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from idtool.parameters import Parameter, Parameters
from testbench.board.files import with_effects

from .support import ffc_id

ANY = ["--any-position"]
FILES = ["ffc.c", "ffc.h", "ffc_servo.h", "guide.ino"]


@pytest.fixture
def params(tmp_path: Path) -> Path:
    path = tmp_path / "params.toml"
    with_effects("inertia", "position_ripple").write(path)
    return path


def test_writes_header_source_and_sketch(params: Path, tmp_path: Path) -> None:
    done = ffc_id("export", "c", "-p", params, "-o", tmp_path / "guide", "--range", "-1.5", "1.5")
    assert done.returncode == 0, done.stderr
    assert sorted(file.name for file in (tmp_path / "guide").iterdir()) == FILES
    assert "#define POSITION_MAX 1.5f" in (tmp_path / "guide" / "ffc.c").read_text()
    assert "#define IDLE 600" in (tmp_path / "guide" / "ffc.c").read_text()
    assert "effects: inertia, position_ripple" in done.stdout


@pytest.mark.parametrize("light", [False, True], ids=["published", "light"])
def test_the_mode_is_that_of_the_file(light: bool, tmp_path: Path) -> None:
    params, header = tmp_path / "params.toml", tmp_path / "guide" / "ffc.h"
    with_effects("inertia", light=light).write(params)
    done = ffc_id("export", "c", "-p", params, "-o", tmp_path / "guide", "--any-position")
    assert done.returncode == 0, done.stderr
    assert f"#define FFC_LIGHT {int(light)}\n" in header.read_text()


def test_a_range_in_degrees_is_that_range(params: Path, tmp_path: Path) -> None:
    for name, words in (
        ("rad", ("--range", "-1.5", f"{math.pi / 2}")),
        ("deg", ("--range-deg", "-85.94367", "90")),
    ):
        assert ffc_id("export", "c", "-p", params, "-o", tmp_path / name, *words).returncode == 0
    one, other = ((tmp_path / name / "ffc.c").read_text() for name in ("rad", "deg"))
    assert one == other


def test_json_is_one_document(params: Path, tmp_path: Path) -> None:
    arguments = ["--without", "inertia", "--period", "0.005", "--any-position", "--json"]
    done = ffc_id("export", "c", "-p", params, "-o", tmp_path / "guide", *arguments)
    document = json.loads(done.stdout)
    assert document["effects"] == ["position_ripple"]
    assert [Path(file).name for file in document["files"]] == ["ffc.h", "ffc.c", "ffc_servo.h", "guide.ino"]
    assert any("inertia" in note for note in document["notes"])
    assert "PERIOD_US 5000UL" in (tmp_path / "guide" / "ffc.h").read_text()


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        ([*ANY, "--name", "Not C"], 2, "C symbols"),
        ([*ANY, "--without", "inertai"], 2, 'did you mean "inertia"'),
        (["--range", "1", "-1"], 3, "range"),
        ([*ANY, "--period", "0"], 2, "--period"),
        ([], 2, "--range LOW HIGH"),
        (["--range", "-1", "1", "--range-deg", "-60", "60"], 2, "say the same in two units"),
        ([*ANY, "--range", "-1", "1"], 2, "--any-position"),
    ],
)
def test_mistakes_are_one_sentence(
    params: Path, tmp_path: Path, arguments: list[str], code: int, words: str
) -> None:
    done = ffc_id("export", "c", "-p", params, "-o", tmp_path / "guide", *arguments)
    assert done.returncode == code
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "guide").exists()


def test_refuses_to_overwrite_unasked(params: Path, tmp_path: Path) -> None:
    first, second = (
        ffc_id("export", "c", "-p", params, "-o", tmp_path / "guide", "--any-position") for _ in range(2)
    )
    assert (first.returncode, second.returncode) == (0, 3)
    assert "--force" in second.stderr
    assert (
        ffc_id("export", "c", "-p", params, "-o", tmp_path / "guide", "--any-position", "--force").returncode
        == 0
    )


def test_a_file_that_cannot_carry_a_controller_says_what_it_lacks(tmp_path: Path) -> None:
    whole = with_effects()
    path = tmp_path / "params.toml"
    Parameters(
        whole.axis, whole.gravity_model, {n: Parameter(p.value) for n, p in whole.gravity.items()}
    ).write(path)
    done = ffc_id("export", "c", "-p", path, "-o", tmp_path / "guide", "--any-position")
    assert done.returncode == 3
    assert "friction" in done.stderr


def test_help_of_a_group_names_its_commands() -> None:
    done = ffc_id("export", "--help")
    assert done.returncode == 0
    assert "C99" in done.stdout
    wrong = ffc_id("export", "d")
    assert wrong.returncode == 2
    assert "no command" in wrong.stderr


def test_a_path_goes_into_flash_and_its_size_is_told(params: Path, tmp_path: Path) -> None:
    points = tmp_path / "points.toml"
    points.write_text(
        'schema = "ffc-id/waypoints/1"\naxis = {kind = "rotary"}\n'
        "points = [{time_s = 0.0, position_rad = 0.0}, {time_s = 2.0, position_rad = 1.0}]\n"
    )
    common = ("export", "c", "-p", params, "-o", tmp_path / "guide", "--path", points)
    done = ffc_id(*common, "--range", "-1.5", "1.5", "--path-speed", "0.5")
    assert done.returncode == 0, done.stderr
    assert "bytes of flash" in done.stderr
    assert sorted(file.name for file in (tmp_path / "guide").iterdir()) == sorted([*FILES, "ffc_path.h"])
    without = ffc_id(*common, "--any-position", "--force")
    assert without.returncode == 3
    assert "add --range" in without.stderr
