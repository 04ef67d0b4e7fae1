"""The example of docs/own-logs.md: a recording in a foreign dress."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from pages.markdown import commands_in, fences, missing

from .support import PROJECT, printed

PAGE = PROJECT / "docs" / "own-logs.md"


@pytest.mark.long
def test_the_example_reads_as_it_is_printed(tmp_path: Path) -> None:
    shutil.copy(PROJECT / "docs" / "tutorial.toml", tmp_path / "axis.toml")
    printed(["run-sweep", "--rig", "sim:axis.toml", "-o", "sweep.csv", "-q"], tmp_path)
    log = Log.read(tmp_path / "sweep.csv").frame
    recording = pd.DataFrame(
        {
            "run": log["trial"],
            "t_ms": 1e3 * log["time_s"],
            "angle_deg": np.rad2deg(log["position_rad"]) % 360,
            "iq": 1e3 * log["current_a"],
            "setpoint": log["velocity_command_rad_s"],
        }
    )
    recording.to_csv(tmp_path / "recording.csv", sep=";", decimal=",", index=False)
    blocks = fences(PAGE)
    head, first, pointed_at, taken, list_of_columns = [block.text for block in blocks[:5]]
    written = (tmp_path / "recording.csv").read_text().splitlines()
    assert [line.split(";")[0] for line in head.splitlines()] == [line.split(";")[0] for line in written[:3]]
    assert head.splitlines()[0] == written[0]
    (command,) = commands_in(first)
    assert missing(pointed_at, printed(command, tmp_path)) == []
    (command,) = commands_in(taken)
    assert missing(list_of_columns, printed(command, tmp_path)) == []
    printed(["check", "mine.csv"], tmp_path)
