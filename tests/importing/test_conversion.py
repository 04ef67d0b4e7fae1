"""Units that a person gives for a column."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from idtool.errors import UsageError
from idtool.importing.conversion import given_unit
from idtool.importing.names import role_of
from idtool.log.format import columns_of
from idtool.model.units import Kind

PROJECT = Path(__file__).parents[2]
#: `--unit position=deg` on a page or in a message; what is in capitals or braces is to be filled in.
_ADVICE = re.compile(r"--unit ([a-z_]+)=([^\s`),\"{]+)")


@pytest.mark.parametrize(
    ("text", "role", "factor"),
    [
        ("-A", "current", -1.0),
        ("-2.69mA", "current", -2.69e-3),
        ("-1", "torque", -1.0),
        ("-deg", "position", -math.pi / 180),
    ],
)
def test_a_minus_before_a_unit_turns_the_column_round(text: str, role: str, factor: float) -> None:
    """It was taken for one of the marks in which spellings of a unit differ, and told nobody."""
    assert given_unit(text, role, "rotary").factor == pytest.approx(factor)


@pytest.mark.parametrize("kind", ["rotary", "linear"])
@pytest.mark.parametrize("role", list(columns_of("rotary")))
def test_every_unit_that_a_refusal_lists_is_accepted(role: str, kind: Kind) -> None:
    with pytest.raises(UsageError) as refused:
        given_unit("furlong", role, kind)
    _, listed, rest = str(refused.value).partition("; use one of ")
    for unit in rest.partition(", or a factor")[0].partition(", count:")[0].split(", ") if listed else ():
        assert given_unit(unit, role, kind).text == unit


def test_every_unit_that_a_page_or_a_message_recommends_is_accepted() -> None:
    files = [*PROJECT.glob("docs/*.md"), *PROJECT.glob("*.md")]
    files += [file for folder in ("idtool", "cli") for file in (PROJECT / folder).rglob("*.py")]
    advice = {found for file in files for found in _ADVICE.findall(file.read_text(encoding="utf-8"))}
    assert ("duty", "percent") in advice
    for left, text in advice:
        if text.rpartition(":")[2].rstrip(".").isupper():  # UNIT, count:N
            continue
        role, kind = role_of(left)
        assert given_unit(text.rstrip("."), role, kind or "rotary").factor
