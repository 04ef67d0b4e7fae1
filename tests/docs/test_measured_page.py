"""The page on real machines says what the last run found, and has a place for every folder."""

from __future__ import annotations

import json
import re
from pathlib import Path

from pages.markdown import write_made
from pages.measured import PAGE, TARGET, parts
from testbench.recordings import RECORDINGS

FOUND = json.loads(Path("docs/measured.json").read_text(encoding="utf-8"))


def test_the_page_is_made_of_what_was_found(tmp_path: Path) -> None:
    write_made(PAGE, parts(FOUND), TARGET, tmp_path / "anew.md")
    assert (tmp_path / "anew.md").read_text(encoding="utf-8") == Path(PAGE).read_text(encoding="utf-8")


def test_every_cell_of_a_row_has_its_column() -> None:
    for table in re.findall(r"(?:^\|.*\n)+", Path(PAGE).read_text(encoding="utf-8"), re.MULTILINE):
        assert len({line.count("|") for line in table.splitlines()}) == 1, table


def test_every_folder_is_run(measured: Path) -> None:
    named = {Path(recording.file).parts[0] for recording in RECORDINGS}
    assert {folder.name for folder in measured.iterdir() if folder.is_dir()} == named
    for recording in RECORDINGS:
        assert any(measured.glob(recording.file))
    names = [recording.name for recording in RECORDINGS]
    assert len(set(names)) == len(names)
    assert {other for recording in RECORDINGS for other in recording.others} <= set(names)
