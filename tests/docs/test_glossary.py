"""The glossary holds the words that pages and output use, in order, and no other."""

from __future__ import annotations

import re

import pytest

from .support import PAGES, PROJECT

GLOSSARY = PROJECT / "docs" / "glossary.md"
WORDS = re.findall(r"^\| ([^|]+?) \| ", GLOSSARY.read_text("utf-8"), re.MULTILINE)[1:]
USED = " ".join(
    file.read_text("utf-8")
    for file in [
        *(page for page in PAGES if page != GLOSSARY),
        *(file for room in ("idtool", "cli") for file in (PROJECT / room).rglob("*.py")),
        *(PROJECT / "idtool").rglob("*.jinja"),
    ]
)


def test_words_stand_in_order_and_once() -> None:
    assert len(WORDS) > 20
    assert sorted(set(WORDS), key=str.lower) == WORDS


@pytest.mark.parametrize("word", [one for entry in WORDS for one in entry.split(", ")])
def test_a_word_is_used(word: str) -> None:
    assert re.search(re.escape(word).replace(r"\ ", r"[\s_]+"), USED, re.IGNORECASE)
