"""What a command reads it does not write over, --force or not."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from idtool.cli.commands import ffc_id

from idtool.errors import InputError, UsageError
from tests.control.double import parameters

_LOG = Path(__file__).resolve().parents[2] / "data" / "session" / "gravity.csv.gz"
_RIG = ("--rig", "sim:paper")


@pytest.mark.parametrize(
    ("words", "file"),
    [
        (("predict", "log.csv.gz", "-p", "params.toml", "-o", "log.csv.gz"), "log.csv.gz"),
        (("predict", "log.csv.gz", "-p", "params.toml", "-o", "params.toml"), "params.toml"),
        (("simulate", "log.csv.gz", "-p", "params.toml", "-o", "same.csv.gz"), "log.csv.gz"),
        (("export", "json", "-p", "params.toml", "-o", "params.toml"), "params.toml"),
        (("plot", "log.png", "-o", "log.png"), "log.png"),
        (("teach", "-p", "params.toml", *_RIG, "-o", "params.toml"), "params.toml"),
        (("play", "log.csv.gz", *_RIG, "-o", "log.csv.gz"), "log.csv.gz"),
        (("play", "log.csv.gz", *_RIG, "--waypoints", "log.csv.gz"), "log.csv.gz"),
        (("jog", "-p", "params.toml", *_RIG, "-o", "params.toml"), "params.toml"),
    ],
    ids=" ".join,
)
def test_what_is_read_is_not_written_over(
    words: tuple[str, ...], file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for copy in ("log.csv.gz", "log.png"):
        shutil.copy(_LOG, copy)
    Path("same.csv.gz").symlink_to("log.csv.gz")
    parameters().write("params.toml")
    before = Path(file).read_bytes()
    done = CliRunner().invoke(ffc_id, [*words, "--force"])
    assert isinstance(done.exception, UsageError)
    assert "is what is read here; name another file" in str(done.exception)
    assert Path(file).read_bytes() == before


def test_a_dash_is_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It was written as a file of that name, in place of standard output."""
    monkeypatch.chdir(tmp_path)
    parameters().write("params.toml")
    done = CliRunner().invoke(ffc_id, ["export", "json", "-p", "params.toml", "-o", "-", "--force"])
    assert isinstance(done.exception, InputError)
    assert str(done.exception) == "-: is no file (--json prints the result); name a file."
    assert [path.name for path in tmp_path.iterdir()] == ["params.toml"]


def test_a_picture_is_what_its_name_says(tmp_path: Path) -> None:
    for words in (("plot", str(_LOG), "-o"), ("teach", "-p", "params.toml", *_RIG, "--figure")):
        done = CliRunner().invoke(ffc_id, [*words, str(tmp_path / "picture.bmp")])
        assert (done.exit_code, ".png or .svg" in done.output) == (2, True)
