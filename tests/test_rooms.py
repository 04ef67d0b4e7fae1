"""The rooms of the house: imports flow one way."""

from __future__ import annotations

import graphlib
import tomllib
from pathlib import Path

import pytest

import idtool
from pages.architecture import PAGE, ROOMS, arrows, imported, page

PACKAGE = Path(idtool.__file__).parent
PROJECT = PACKAGE.parent


def test_every_room_has_its_place_in_the_order() -> None:
    folders = {file.parent.name for file in PACKAGE.glob("*/*.py")}
    files = {file.stem for file in PACKAGE.glob("*.py")} - {"__init__"}
    assert folders | files == set(ROOMS)
    assert files == {"version", "errors"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_rooms_before_it(room: str) -> None:
    order = list(ROOMS)
    allowed = order[: order.index(room) + 1]
    assert [arrow for arrow in arrows(PACKAGE, room) if arrow[1] not in allowed] == []


def test_no_room_imports_the_command_line() -> None:
    for file in PACKAGE.rglob("*.py"):
        assert not any(name.startswith(("idtool.cli", "cli.", "click")) for name in imported(file)), file


#: A method that shows its own object: what it draws or lists is told the object's type.
SHOWS_ITSELF = (
    ("idtool.log.log", "idtool.log.figure"),
    ("idtool.parameters.parameters", "idtool.parameters.rows"),
)


def test_no_modules_import_each_other_in_a_circle() -> None:
    files = [
        file
        for folder in ("idtool", "cli", "studies", "testbench")
        for file in (PROJECT / folder).rglob("*.py")
    ]
    parts = {file: file.relative_to(PROJECT).with_suffix("").parts for file in files}
    names = {file: ".".join(part for part in parts[file] if part != "__init__") for file in files}
    known = set(names.values())
    graph = {name: (set(imported(file)) & known) - {name} for file, name in names.items()}
    for package in {file.parent for file in files if file.name == "__init__.py"}:
        name = ".".join(package.relative_to(PROJECT).parts)
        inside = {other for other in known if other.startswith(f"{name}.")}
        for other in inside:
            graph[other].discard(name)  # `from package import module` names both
    for one, other in SHOWS_ITSELF:
        graph[one].remove(other)
    graphlib.TopologicalSorter(graph).prepare()  # CycleError names the circle


def test_tests_studies_and_benchmarks_share_the_testbench_and_no_study_is_imported() -> None:
    for folder in ("tests", "benchmarks", "testbench", "pages"):
        for file in (PROJECT / folder).rglob("*.py"):
            assert not any(name.split(".")[0] == "studies" for name in imported(file)), file


def test_the_picture_and_the_list_are_of_these_imports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(PROJECT)
    text = PAGE.read_text(encoding="utf-8")
    assert page(text) == text
    drawn = {line.split()[0] for line in text.splitlines() if " --> " in line}
    assert drawn == set(ROOMS) - {"version", "errors", "io", "model"}


def test_every_room_is_installed() -> None:
    listed = tomllib.loads((PROJECT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    folders = {file.parent.relative_to(PROJECT) for file in PACKAGE.rglob("*.py")}
    beside = {"idtool.cli", "idtool.recipes", "idtool.data"}
    assert set(listed) == {".".join(folder.parts) for folder in folders} | beside


@pytest.mark.parametrize("folder", ["idtool", "cli"])
def test_nothing_writes_into_a_frozen_object(folder: str) -> None:
    for file in (PROJECT / folder).rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        assert "object.__setattr__" not in text, file
        assert "__dict__[" not in text, file
