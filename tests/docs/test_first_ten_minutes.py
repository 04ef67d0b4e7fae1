"""docs/first-ten-minutes.md is run as it stands, on a recording in a foreign dress."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from pages.markdown import missing, steps

from .support import PROJECT, printed

PAGE = PROJECT / "docs" / "first-ten-minutes.md"


def foreign(log: Log, path: Path) -> None:
    """A log as another program would have recorded it."""
    frame = log.frame
    recording = pd.DataFrame(
        {
            "run": frame["trial"],
            "t_ms": 1e3 * frame["time_s"],
            "angle_deg": np.rad2deg(frame["position_rad"]) % 360,
            "iq": 1e3 * frame["current_a"],
        }
    )
    recording.to_csv(path, sep=";", decimal=",", index=False)


@pytest.mark.long
def test_the_page_runs_and_prints_what_it_says(tmp_path: Path) -> None:
    done = []
    for commands, said in steps(PAGE):
        text = "".join(printed(words, tmp_path) for words in commands)
        assert missing(said, text) == [], text
        done += [words[0] for words in commands]
        if "mine.csv" not in {file.name for file in tmp_path.iterdir()}:
            foreign(Log.read(tmp_path / "sample" / "sine.csv.gz"), tmp_path / "mine.csv")
    assert done == ["data", "plot", "identify", "import", "import", "plot", "check", "identify"]
    for name in ("sweep.png", "log.png", "example/report.html", "result/report.html"):
        assert (tmp_path / name).exists(), name
