"""The one list of the extras: every extra of pyproject.toml, with the packages that it brings."""

from __future__ import annotations

import re
import tomllib

import pytest

from .support import PROJECT

EXTRAS = tomllib.loads((PROJECT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
#: What these bring is told in words: plugins, stubs and other extras.
IN_WORDS = ("test", "dev")


def rows() -> dict[str, str]:
    text = (PROJECT / "docs" / "extras.md").read_text("utf-8")
    return dict(re.findall(r"^\| `(\w+)` \| ([^|]*) \|", text, re.MULTILINE))


def test_every_extra_has_its_row_and_no_other() -> None:
    assert set(rows()) == set(EXTRAS)


@pytest.mark.parametrize("extra", [name for name in EXTRAS if name not in IN_WORDS])
def test_a_row_names_the_packages(extra: str) -> None:
    packages = {re.match(r"[\w-]+", one)[0] for one in EXTRAS[extra]}  # type: ignore[index]
    assert packages == {re.match(r"[\w-]+", one)[0] for one in rows()[extra].split(", ")}  # type: ignore[index]


@pytest.mark.parametrize(
    "page", ["README.md", "docs/README.md", "docs/import.md", "docs/fleet.md", "docs/hardware.md"]
)
def test_pages_that_name_an_extra_link_the_list(page: str) -> None:
    assert "extras.md)" in (PROJECT / page).read_text("utf-8")
