"""`ffc-id report DIR`: what it prints, writes and refuses."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest
from idtool.cli.main import main

from idtool.presentation import style
from tests.report import folder as synthetic


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return synthetic.make(tmp_path / "result")


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as stop:
        main(["report", *arguments])
    return int(stop.value.code or 0)


@pytest.fixture
def unpainted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are built but not painted."""
    png = b"\x89PNG\r\n\x1a\n" + b"\x00\x00\x00\rIHDR" + struct.pack(">II", 1, 1)
    monkeypatch.setattr(style, "render", lambda figure, form: png)


@pytest.mark.usefixtures("unpainted")
def test_draws_again_and_says_where(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(str(folder)) == 0
    printed = capsys.readouterr()
    assert printed.out == f"report: {folder / 'report.html'}\nfigures: 20 in {folder / 'figures'}, as PNG\n"
    recipe = folder / "next_experiment.toml"
    assert printed.err == f"next: ffc-id run --recipe {recipe} --rig SPEC -o next.csv\n"
    assert (folder / "report.html").read_text(encoding="utf-8").startswith("<!doctype html>")
    assert run(str(folder), "--svg") == 0
    assert capsys.readouterr().out.endswith("as PNG and SVG\n")
    assert len(list((folder / "figures").glob("*.svg"))) == 20
    assert run(str(folder), "--json", "-q") == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    document = json.loads(printed.out)
    assert document["report"] == str(folder / "report.html")
    assert all(Path(figure).is_file() for figure in document["figures"])
    assert len(document["figures"]) == 20


def test_bad_folders_end_in_one_sentence(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(str(tmp_path / "nowhere")) == 3
    assert "no such folder; run ffc-id identify" in capsys.readouterr().err
    (folder / "evidence.csv.gz").unlink()
    assert run(str(folder), "-q") == 3
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.count("\n") == 1
    assert printed.err.startswith("ffc-id: ")


def test_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 2
    assert run("--help") == 0
    assert "ffc-id report result" in capsys.readouterr().out
