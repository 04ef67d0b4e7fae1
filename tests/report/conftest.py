"""Folders drawn once and looked at by many tests."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest

from idtool.presentation import style
from idtool.report import write_report

from .folder import make


@pytest.fixture(scope="session")
def told() -> list[tuple[int, int]]:
    """What was told of the progress of `drawn`."""
    return []


@pytest.fixture(scope="session")
def drawn(tmp_path_factory: pytest.TempPathFactory, told: list[tuple[int, int]]) -> Path:
    """A rotary axis with a ripple, everything there, report drawn, its figures as SVG too."""
    folder = make(tmp_path_factory.mktemp("rotary") / "result")
    write_report(folder, svg=True, progress=lambda done, of: told.append((done, of)))
    return folder


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The same, not drawn, to be spoilt."""
    return make(tmp_path / "result")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are built but not painted, for tests that look at the page's words."""
    blank = base64.b64decode(
        "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg=="
    )
    monkeypatch.setattr(style, "render", lambda figure, form: blank)
