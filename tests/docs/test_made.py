"""What a study or a page's maker writes stands between markers; the rest of a page is written by hand."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pages.markdown import row, table, write_made

from .support import PAGES, page_id

_TEXT = "By hand.\n\n<!-- part: made by `make it` -->\n\nold\n\n<!-- end of part -->\n\nMore by hand.\n"


def test_what_is_made_is_put_between_its_markers_of_a_copy(tmp_path: Path) -> None:
    page, copy = tmp_path / "page.md", tmp_path / "copy.md"
    page.write_text(_TEXT, encoding="utf-8")
    write_made(str(page), {"part": ["new", "lines", ""]}, "it", copy)
    assert page.read_text(encoding="utf-8") == _TEXT
    assert copy.read_text(encoding="utf-8") == _TEXT.replace("old", "new\nlines")
    write_made(str(page), {"part": ["newer"]}, "it")
    assert page.read_text(encoding="utf-8") == _TEXT.replace("old", "newer")
    with pytest.raises(ValueError, match="no markers of the part 'other'"):
        write_made(str(page), {"other": []}, "it")


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_every_part_has_its_end(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    begun = re.findall(r"^<!-- ([\w ]+): made by `make [\w-]+` -->$", text, re.MULTILINE)
    assert begun == re.findall(r"^<!-- end of ([\w ]+) -->$", text, re.MULTILINE)


def test_a_table_has_a_cell_for_every_column_and_its_alignment() -> None:
    assert table(("", "b"), [("x", 1)], "lr") == ["| | b |", "|---|---:|", "| x | 1 |"]
    assert row(("a", "", "c")) == "| a | | c |"
