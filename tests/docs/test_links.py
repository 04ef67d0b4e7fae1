"""Links between the pages lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from .support import PAGES, PROJECT, links, page_id


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_links_lead_somewhere(page: Path) -> None:
    for link in links(page):
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        assert target.is_relative_to(PROJECT), link
        if anchor:
            assert anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_every_page_can_be_found(page: Path) -> None:
    """From the README or an index, in one step or two."""
    indexes = [PROJECT / "README.md", *(PROJECT / "docs").rglob("README.md")]
    found = {(index.parent / link.partition("#")[0]).resolve() for index in indexes for link in links(index)}
    assert page in found or page == PROJECT / "README.md"


def test_every_picture_is_used() -> None:
    used = {(page.parent / link).resolve() for page in PAGES for link in links(page)}
    pictures = [p for p in (PROJECT / "docs").rglob("*") if p.suffix in (".png", ".svg")]
    assert [p.name for p in pictures if p not in used] == []


def anchors(page: Path) -> set[str]:
    """The anchors that the headings of a page make."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
