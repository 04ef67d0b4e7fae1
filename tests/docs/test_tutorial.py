"""The tutorial runs as it is printed, and prints what it says."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from pages.markdown import alike, missing, steps
from pages.tutorial import TAKEN, refreshed

from .support import PROJECT, printed

TUTORIAL = PROJECT / "docs" / "tutorial.md"


@pytest.mark.long
def test_the_tutorial_runs_and_prints_what_it_says(tmp_path: Path) -> None:
    shutil.copy(PROJECT / "docs" / "tutorial.toml", tmp_path / "axis.toml")
    done = 0
    for found, said in steps(TUTORIAL):
        text = "".join(printed(command, tmp_path) for command in found)
        done += len(found)
        assert missing(said, text) == [], text
    assert done == 10
    for picture in TAKEN.values():
        assert (tmp_path / picture).exists()


@pytest.mark.parametrize(
    ("said", "printed", "same"),
    [
        ("5.93 N moves it", "5.95 N  moves it", True),
        ("5.93 N moves it", "7.93 N moves it", False),
        ("effect: thermal_drift", "effect: backlash", False),
        ("std error 6.5e-05", "std error 6.6e-05", True),
    ],
)
def test_lines_are_compared_by_words_and_numbers(said: str, printed: str, same: bool) -> None:
    assert alike(said, printed) == same


def test_a_line_that_is_not_printed_shows() -> None:
    assert missing("a 1\n...\nc 3\n", "a 1\nb 2\nc 3\n") == []
    assert missing("a 1\nd 4\n", "a 1\nb 2\n") == ["d 4"]


def test_an_output_is_refreshed_line_by_line() -> None:
    assert refreshed("a 1\n...\nc 3\n", "a  2\nb 2\nc 4\n") == ("a  2\n...\nc 4\n", [])
    assert refreshed("a 1\nd 4\n", "a 2\nb 2\n") == ("a 2\nd 4\n", ["d 4"])
