"""The session of the README runs as it is printed."""

from __future__ import annotations

from pathlib import Path

import pytest

from pages.markdown import commands_in

from .support import PROJECT, printed


@pytest.mark.long
def test_the_session_of_the_readme_runs(tmp_path: Path) -> None:
    """Everything under "Your axis", in order, in one folder."""
    readme = (PROJECT / "README.md").read_text(encoding="utf-8")
    commands = commands_in(readme.partition("## Your axis")[2].partition("\n## ")[0])
    assert {"run-gravity", "identify", "teach", "diagnose"} <= {words[0] for words in commands}
    for words in commands:
        printed(words, tmp_path)
    for name in ("result/report.html", "predicted.csv", "params.toml", "diagnosis/report.html"):
        assert (tmp_path / name).exists(), name
