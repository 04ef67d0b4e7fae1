"""The page of the Python interface and the example notebook run, and show every public name."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path
from typing import Any

import matplotlib
import pytest

import idtool
from idtool.io.catalogue import fetch, read_catalogue
from pages.markdown import fences
from pages.notebook import NOTEBOOK, cells, execute, outputs

from .support import PROJECT

matplotlib.use("Agg")
_PAGE = PROJECT / "docs" / "api.md"


@pytest.fixture
def inside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own with the sample session in it."""
    fetch(read_catalogue().get("sample"), tmp_path / "sample")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.long
@pytest.mark.usefixtures("inside")
def test_the_examples_of_the_page_run_one_after_another() -> None:
    names: dict[str, Any] = {}
    examples = [fence.text for fence in fences(_PAGE) if fence.language == "python"]
    assert len(examples) == 8
    for code in examples:
        execute(code, names)
    assert names["result"].parameters.static["coulomb"].identified


def test_every_public_name_has_its_example() -> None:
    imported = " ".join(
        re.findall(r"^from idtool import (.+)$", _PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert set(idtool.__all__) - {"Result"} == set(re.split(r",? ", imported))
    assert "## Result" in _PAGE.read_text(encoding="utf-8")


@pytest.mark.long
def test_the_notebook_runs_and_gives_what_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = PROJECT / NOTEBOOK
    shown = [cell for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"] if "outputs" in cell]
    names: dict[str, Any] = {}
    for number, (code, cell) in enumerate(zip(cells(notebook), shown, strict=True), start=1):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            given = outputs(*execute(code, names), number)
        assert [sorted(one.get("data", ())) for one in given] == [
            sorted(one.get("data", ())) for one in cell["outputs"]
        ]
    assert "position_ripple" in names["result"].effects
    assert any(
        "position_ripple" in "".join(one["data"]["text/plain"])
        for c in shown
        for one in c["outputs"]
        if "data" in one
    )
