"""The rooms of the house: imports flow one way."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import idtool

PACKAGE = Path(idtool.__file__).parent
PROJECT = PACKAGE.parent

#: Every room; one may import itself and those before it, never one behind it.
ROOMS = (
    "errors",
    "io",
    "model",
    "effects",
    "parameters",
    "control",
    "log",
    "signals",
    "importing",
    "rig",
    "virtual_servo",
    "experiment",
    "guiding",
    "fit",
    "diagnosis",
    "verbs",
    "compare",
    "report",
    "export",
    "fleet",
)


def imported(file: Path) -> Iterator[str]:
    """The modules of the project that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield node.module or ""
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def arrows(room: str) -> Iterator[tuple[str, str]]:
    """(file, room) for every import of a room from a file of this one."""
    place = PACKAGE / room
    for file in sorted(place.rglob("*.py")) if place.is_dir() else [PACKAGE / f"{room}.py"]:
        for name in imported(file):
            parts = name.split(".")
            if parts[0] == "idtool" and len(parts) > 1:
                yield file.relative_to(PROJECT).as_posix(), parts[1]


def test_every_room_has_its_place_in_the_order() -> None:
    folders = {file.parent.name for file in PACKAGE.glob("*/*.py")}
    files = {file.stem for file in PACKAGE.glob("*.py")} - {"__init__"}
    assert folders | files == set(ROOMS)
    assert files == {"errors"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_rooms_before_it(room: str) -> None:
    allowed = {*ROOMS[: ROOMS.index(room) + 1], "__version__"}
    assert [arrow for arrow in arrows(room) if arrow[1] not in allowed] == []


def test_no_room_imports_the_command_line() -> None:
    for file in PACKAGE.rglob("*.py"):
        assert not any(name.startswith(("idtool.cli", "cli.", "click")) for name in imported(file)), file


#: What tests of the admittance law still take from the study of it.
_GUIDED = ("studies.guided_", "studies.teach", "studies.guiding")


def test_tests_studies_and_benchmarks_share_the_testbench_and_no_study_is_imported() -> None:
    for folder in ("tests", "benchmarks", "testbench", "pages"):
        for file in (PROJECT / folder).rglob("*.py"):
            names = {name for name in imported(file) if name.split(".")[0] == "studies"}
            assert {name for name in names if not name.startswith(_GUIDED)} == set(), file
