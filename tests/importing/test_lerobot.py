"""LeRobot datasets: lists of joints into the log of one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.importing.recording import import_recording

NAMES = ["shoulder_pan.pos", "elbow_flex.pos"]
#: The raw register of a Feetech: the sign above the magnitude, 1000 at full.
LOAD = np.array([100, 1024 + 250, 0, 1000])


def dataset(folder: Path, **observations: Any) -> Path:
    """Two episodes of two samples, two joints."""
    state = [[10.0, -20.0], [11.0, -21.0], [12.0, -22.0], [13.0, -23.0]]
    columns = {
        "observation.state": state,
        "action": [[a + 1.0, b + 1.0] for a, b in state],
        "timestamp": np.array([0.0, 0.05, 0.0, 0.05], dtype=np.float32),
        "frame_index": [0, 1, 0, 1],
        "episode_index": [0, 0, 1, 1],
        **observations,
    }
    lists = [name for name in columns if name == "action" or name.startswith("observation.")]
    (folder / "meta").mkdir()
    info = {"robot_type": "so101_follower", "features": {name: {"names": NAMES} for name in lists}}
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    (folder / "data" / "chunk-000").mkdir(parents=True)
    pd.DataFrame(columns).to_parquet(folder / "data" / "chunk-000" / "file-000.parquet")
    return folder


def load(**more: Any) -> dict[str, Any]:
    volts = [[12.0, 12.1]] * 4
    return {"observation.load": [[0, int(v)] for v in LOAD], "observation.voltage": volts} | more


@pytest.mark.parametrize("given", ["folder", "file"])
def test_a_joint_of_a_dataset_is_a_log(tmp_path: Path, given: str) -> None:
    folder = dataset(tmp_path, **load())
    path = folder if given == "folder" else next(folder.glob("data/**/*.parquet"))
    done = import_recording(path, where={"joint": ["elbow_flex"]})
    frame = done.log.frame
    assert np.allclose(frame["position_rad"], np.radians([-20, -21, -22, -23]))
    assert np.allclose(frame["position_command_rad"], np.radians([-19, -20, -21, -22]))
    assert frame["duty"].tolist() == [0.1, -0.25, 0.0, 1.0]
    assert set(frame["supply_voltage_v"]) == {12.1}
    assert frame["trial"].tolist() == [0, 0, 1, 1]
    assert done.log.header["lerobot"] == {"robot_type": "so101_follower"}
    assert any("use_degrees" in note for note in done.notes)


def test_which_joint_is_asked(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"shoulder_pan.*elbow_flex"):
        import_recording(dataset(tmp_path, **load()))


def test_a_current_is_taken_for_nothing_until_somebody_says_whose_it_is(tmp_path: Path) -> None:
    currents = {"observation.current": [[0.1, 0.2 + 0.01 * k] for k in range(4)]}
    folder = dataset(tmp_path, **load(**currents))
    done = import_recording(folder, where={"joint": ["elbow_flex"]})
    assert not {"current_a", "bus_current_a"} & set(done.log.frame)
    assert any("--map current_a=reported_current" in note for note in done.notes)
    told = import_recording(
        folder, where={"joint": ["elbow_flex"]}, mapping={"bus_current_a": "reported_current"}
    )
    assert told.log.frame["bus_current_a"].iloc[1] == pytest.approx(0.21)


def test_positions_and_goals_alone_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing that tells of a motor's torque; record the load"):
        import_recording(dataset(tmp_path))


def test_a_dataset_without_data(tmp_path: Path) -> None:
    (tmp_path / "meta").mkdir()
    (tmp_path / "meta" / "info.json").write_text("{}")
    with pytest.raises(InputError, match="without data"):
        import_recording(tmp_path)


def test_lists_of_unlike_length(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no list of numbers of one length"):
        import_recording(dataset(tmp_path, **load(action=[[1.0], [1.0, 2.0], [1.0], [1.0]])))


def test_joints_without_names_are_numbered(tmp_path: Path) -> None:
    folder = dataset(tmp_path, **load())
    (folder / "meta" / "info.json").write_text("{}")
    done = import_recording(folder, where={"joint": ["joint1"]})
    assert len(done.log.frame) == 4
