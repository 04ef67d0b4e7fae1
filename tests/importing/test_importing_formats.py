"""Recordings of other programs, each written here by that program's own library or in its own layout."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.importing import Imported, import_recording
from idtool.log import Log

START_NS = 1_760_000_000_123_456_789
STEP_NS = 1_000_000
ROWS = 40
JOINTS = ("shoulder", "elbow")


def angle(joint: int, row: int) -> float:
    return float(np.sin(0.1 * row + joint))


def sources(imported: Imported) -> dict[str, tuple[str, str, str]]:
    return {item.column: (item.source, item.unit.text, item.why) for item in imported.taken}


# --- ROS -----------------------------------------------------------------------------------------------


def _states(typestore: Any, *, stamped: bool = True, effort: bool = True) -> list[tuple[int, Any]]:
    """(received, JointState) of two joints, as rosbags builds messages; the stamp is 5 ms before receipt."""
    types = typestore.types
    joint_state, header = types["sensor_msgs/msg/JointState"], types["std_msgs/msg/Header"]
    time = types["builtin_interfaces/msg/Time"]
    messages = []
    for row in range(ROWS):
        received = START_NS + row * STEP_NS
        at = received - 5_000_000 if stamped else 0
        stamp = time(sec=at // 10**9, nanosec=at % 10**9)
        extra = {"seq": row} if "seq" in header.__dataclass_fields__ else {}
        messages.append(
            (
                received,
                joint_state(
                    header=header(stamp=stamp, frame_id="", **extra),
                    name=list(JOINTS),
                    position=np.array([angle(k, row) for k in range(2)]),
                    velocity=np.array([0.5 * k + row for k in range(2)]),
                    effort=np.array([k - 0.25 * row for k in range(2)]) if effort else np.array([]),
                ),
            )
        )
    return messages


def ros1_bag(folder: Path, **options: bool) -> Path:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    typestore = get_typestore(Stores.ROS1_NOETIC)
    with Writer(folder / "run.bag") as writer:
        name = "sensor_msgs/msg/JointState"
        connection = writer.add_connection("/joint_states", name, typestore=typestore)
        for received, message in _states(typestore, **options):
            writer.write(connection, received, typestore.serialize_ros1(message, name))
    return folder / "run.bag"


def _ros2_bag(folder: Path, plugin: str, compression: str = "", **options: bool) -> Path:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    typestore = get_typestore(Stores.ROS2_HUMBLE)
    bag = Writer(folder / "run", version=9, storage_plugin=StoragePlugin[plugin])
    if compression:
        bag.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
    with bag as writer:
        name = "sensor_msgs/msg/JointState"
        connection = writer.add_connection("/joint_states", name, typestore=typestore)
        for received, message in _states(typestore, **options):
            writer.write(connection, received, typestore.serialize_cdr(message, name))
    return folder / "run"


def ros2_sqlite(folder: Path, **options: bool) -> Path:
    return _ros2_bag(folder, "SQLITE3", **options)


def ros2_mcap(folder: Path, **options: bool) -> Path:
    return _ros2_bag(folder, "MCAP", **options)


def ros2_database(folder: Path, **options: bool) -> Path:
    """The file of a bag without its folder's metadata."""
    return next(_ros2_bag(folder, "SQLITE3", **options).glob("*.db3"))


@pytest.mark.parametrize(
    ("plugin", "compression"), [("SQLITE3", "FILE"), ("SQLITE3", "MESSAGE"), ("MCAP", "STORAGE")]
)
def test_compressed_bags(tmp_path: Path, plugin: str, compression: str) -> None:
    frame = import_recording(_ros2_bag(tmp_path, plugin, compression), where={"joint": ["elbow"]}).log.frame
    assert frame["position_rad"].tolist() == [angle(1, row) for row in range(ROWS)]


JOINT_STATE_TEXT = """\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def mcap_alone(folder: Path, *, stamped: bool = True, effort: bool = True) -> Path:
    from mcap_ros2.writer import Writer

    with open(folder / "run.mcap", "wb") as stream, Writer(stream) as writer:
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE_TEXT)
        for row in range(ROWS):
            received = START_NS + row * STEP_NS
            at = received - 5_000_000 if stamped else 0
            message = {
                "header": {"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}, "frame_id": ""},
                "name": list(JOINTS),
                "position": [angle(k, row) for k in range(2)],
                "velocity": [0.5 * k + row for k in range(2)],
                "effort": [k - 0.25 * row for k in range(2)] if effort else [],
            }
            writer.write_message("/joint_states", schema, message, log_time=received, publish_time=received)
    return folder / "run.mcap"


def mcap_of_ros1(folder: Path, *, stamped: bool = True, effort: bool = True) -> Path:
    """A ROS 1 bag converted to MCAP, as `mcap convert` does: the same bytes under profile ros1."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    typestore = get_typestore(Stores.ROS1_NOETIC)
    name = "sensor_msgs/msg/JointState"
    text, _ = typestore.generate_msgdef(name)
    with open(folder / "run1.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros1")
        schema = writer.register_schema("sensor_msgs/JointState", "ros1msg", text.encode())
        channel = writer.register_channel("/joint_states", "ros1", schema)
        for received, message in _states(typestore, stamped=stamped, effort=effort):
            data = bytes(typestore.serialize_ros1(message, name))
            writer.add_message(channel, received, data, received)
        writer.finish()
    return folder / "run1.mcap"


BAGS = [ros1_bag, ros2_sqlite, ros2_database, ros2_mcap, mcap_alone, mcap_of_ros1]


@pytest.mark.parametrize("make", BAGS)
def test_one_joint_of_a_bag(tmp_path: Path, make: Callable[..., Path]) -> None:
    imported = import_recording(make(tmp_path), where={"joint": ["elbow"]}, experiment="sine")
    imported.log.write(tmp_path / "log.csv")
    frame = Log.read(tmp_path / "log.csv").frame
    assert frame["time_s"].to_numpy() == pytest.approx(np.arange(ROWS) * 1e-3, abs=1e-9)
    assert frame["position_rad"].tolist() == [angle(1, row) for row in range(ROWS)]
    assert frame["velocity_rad_s"].tolist() == [0.5 + row for row in range(ROWS)]
    assert frame["torque_nm"].tolist() == [1 - 0.25 * row for row in range(ROWS)]
    assert sources(imported)["torque_nm"] == ("effort", "N m", "named")
    assert imported.notes == ()


@pytest.mark.parametrize("make", BAGS)
def test_which_joint_is_asked(tmp_path: Path, make: Callable[..., Path]) -> None:
    with pytest.raises(InputError, match=r'"joint" is shoulder, elbow; choose one with --where "joint='):
        import_recording(make(tmp_path))


@pytest.mark.parametrize("make", BAGS)
def test_messages_without_stamps_or_effort(tmp_path: Path, make: Callable[..., Path]) -> None:
    path = make(tmp_path, stamped=False, effort=False)
    with pytest.raises(InputError, match=r"no column looks like torque or current \(it has time, joint, pos"):
        import_recording(path, where={"joint": ["elbow"]})
    imported = import_recording(path, where={"joint": ["elbow"]}, mapping={"torque": "velocity"})
    assert imported.log.frame["time_s"].to_numpy() == pytest.approx(np.arange(ROWS) * 1e-3, abs=1e-9)
    assert "the messages carry no stamps; time is when they were received" in imported.notes


def test_efforts_that_are_currents_and_prismatic_joints(tmp_path: Path) -> None:
    path = mcap_alone(tmp_path)
    log = import_recording(
        path,
        where={"joint": ["elbow"]},
        mapping={"current_a": "effort"},
        units={"current": "mA"},
        torque_constant=2.0,
    ).log
    assert log.frame["current_a"].iloc[4] == pytest.approx(0.0)
    assert log.frame["current_a"].iloc[0] == pytest.approx(1e-3)
    linear = import_recording(path, where={"joint": ["elbow"]}, kind="linear")
    assert {"position_m", "velocity_m_s", "force_n"} <= set(linear.log.frame.columns)
    assert sources(linear)["force_n"] == ("effort", "N", "named")


def test_a_bag_of_two_topics(tmp_path: Path) -> None:
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    typestore = get_typestore(Stores.ROS2_HUMBLE)
    name = "sensor_msgs/msg/JointState"
    with Writer(tmp_path / "run", version=8) as writer:
        connections = [
            writer.add_connection(topic, name, typestore=typestore) for topic in ("/left", "/right")
        ]
        for received, message in _states(typestore):
            for connection in connections:
                writer.write(connection, received, typestore.serialize_cdr(message, name))
    with pytest.raises(InputError, match=r'"topic" is /left, /right; choose one with --where "topic=/left"'):
        import_recording(tmp_path / "run")
    where = {"topic": ["/right"], "joint": ["shoulder"]}
    assert len(import_recording(tmp_path / "run", where=where).log.frame) == ROWS


@pytest.mark.parametrize("make", BAGS)
def test_a_recording_cut_short_is_one_sentence(tmp_path: Path, make: Callable[..., Path]) -> None:
    path = make(tmp_path)
    data = next(path.glob("*.[md][cb]*")) if path.is_dir() else path
    data.write_bytes(data.read_bytes()[:600])
    with pytest.raises(InputError, match="is a damaged or unfinished recording; repair it with"):
        import_recording(path, where={"joint": ["elbow"]})


def test_a_bag_without_joint_states(tmp_path: Path) -> None:
    from mcap_ros2.writer import Writer

    with open(tmp_path / "run.mcap", "wb") as stream, Writer(stream) as writer:
        schema = writer.register_msgdef("std_msgs/msg/Float64", "float64 data")
        writer.write_message("/x", schema, {"data": 1.0}, log_time=1, publish_time=1)
    with pytest.raises(InputError, match=r"no sensor_msgs/JointState \(it has std_msgs/msg/Float64\)"):
        import_recording(tmp_path / "run.mcap")


def test_a_bag_larger_than_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("idtool.importing.ros.MAX_SAMPLES", 20)
    with pytest.raises(InputError, match="holds over 20 samples of joints; split it into parts"):
        import_recording(mcap_alone(tmp_path))


def test_without_the_extra_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = mcap_alone(tmp_path)
    monkeypatch.setitem(__import__("sys").modules, "mcap.reader", None)
    with pytest.raises(InputError, match=r"which needs mcap.reader; pip install 'ffc-id\[ros\]'"):
        import_recording(path)


# --- BAM -----------------------------------------------------------------------------------------------


def bam_log(folder: Path, entry: Callable[[int], dict[str, Any]], **facts: Any) -> Path:
    """A log as the recorders of BAM write it: one json.dump of what was run and its entries."""
    data = {
        "mass": 0.49, "length": 0.1, "kp": 100, "vin": 7.4, "motor": "xl330", "trajectory": "sin_sin", **facts
    }  # fmt: skip
    data["entries"] = [
        {"position": 0.1 * k, "speed": 0.5, "timestamp": 0.005 * k + 0.0035, "goal_position": 0.2 * k}
        | entry(k)
        for k in range(30)
    ]
    path = folder / "2026-01-15_10h28m10.json"
    with open(path, "w") as stream:
        json.dump(data, stream)
    return path


XL330 = {"load": 0.02, "input_volts": 7.3, "temp": 28, "torque_enable": True}


def test_bam_xl330(tmp_path: Path) -> None:
    path = bam_log(tmp_path, lambda k: XL330 | {"present_current": 10 * k, "torque_enable": k < 20})
    imported = import_recording(path, torque_constant=0.4)
    imported.log.write(tmp_path / "log.csv")
    log = Log.read(tmp_path / "log.csv")
    assert log.experiment == "sin_sin"
    assert log.header["bam"] == {
        "mass": 0.49, "length": 0.1, "kp": 100, "vin": 7.4, "motor": "xl330", "trajectory": "sin_sin",
    }  # fmt: skip
    frame = log.frame
    assert frame["current_a"].to_numpy() == pytest.approx(0.01 * np.arange(30))
    assert frame["position_command_rad"].to_numpy() == pytest.approx(0.2 * np.arange(30))
    assert frame["velocity_rad_s"].tolist() == [0.5] * 30
    assert frame["supply_voltage_v"].tolist() == [7.3] * 30
    assert frame["temperature_degc"].tolist() == [28] * 30
    assert frame["drive_on"].tolist() == [1] * 20 + [0] * 10
    assert log.axis.extra == {"mass_kg": 0.49, "lever_m": 0.1}
    assert any("the drive was off in 10 rows" in note for note in imported.notes)
    assert not any("presumed" in note for note in imported.notes)
    on = import_recording(path, torque_constant=0.4, where={"torque_enable": ["True"]})
    assert len(on.log.frame) == 20


def test_bam_load_is_the_duty_and_signed(tmp_path: Path) -> None:
    counts = [0, 885, 65536 - 885, 177, 65536 - 177]
    path = bam_log(tmp_path, lambda k: XL330 | {"load": counts[k % 5]})
    frame = import_recording(path).log.frame
    assert frame["duty"].tolist() == pytest.approx([0.0, 1.0, -1.0, 0.2, -0.2] * 6)
    feetech = bam_log(tmp_path, lambda k: XL330 | {"load": [500, 1024 + 500][k % 2]}, motor="sts3215")
    log = import_recording(feetech).log
    assert log.frame["duty"].tolist() == [0.5, -0.5] * 15


@pytest.mark.parametrize(
    ("extra", "source"),
    [
        ({"measured_current": 0.3, "control": 0.4, "load": 0.1}, "measured_current"),
        ({"torque_demand": 4.0, "control": 0.3}, "control"),
    ],
    ids=["Feetech HLS", "eRob"],
)
def test_bam_currents_in_ampere(tmp_path: Path, extra: dict[str, float], source: str) -> None:
    imported = import_recording(
        bam_log(tmp_path, lambda _: extra, arm_mass=0.1, damping=0.1), torque_constant=2.0
    )
    assert sources(imported)["current_a"] == (source, "A", "named")
    assert imported.log.frame["current_a"].tolist() == [0.3] * 30


BAD_JSON = {
    "no current": (
        '{"entries": [{"timestamp": 0, "position": 0, "load": 1}]}',
        'holds the duty in counts of "", whose full duty is not known here',
    ),
    "nothing": ('{"entries": [{"timestamp": 0, "position": 0}]}', "neither a current nor the duty"),
    "no list": ('{"a": 1}', 'without a list of "entries"'),
    "no numbers": ('{"entries": [1, 2]}', 'without a list of "entries"'),
    "no time": ('{"entries": [{"position": 1}]}', 'have no "timestamp"'),
    "empty": ('{"entries": []}', "has no data rows"),
    "cut": ('{"entries": [{"position": 1', "JSON that cannot be read"),
    "deep": ('{"entries":' + "[" * 100_000, "JSON that cannot be read"),
}


@pytest.mark.parametrize("case", BAD_JSON)
def test_bad_json_is_one_sentence(tmp_path: Path, case: str) -> None:
    text, expected = BAD_JSON[case]
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(InputError) as caught:
        import_recording(tmp_path / "run.json")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


# --- DYNAMIXEL -----------------------------------------------------------------------------------------


def test_control_items_in_counts(tmp_path: Path) -> None:
    rows = "".join(f"{10 * k},{2048 + k},{k - 2},{65536 - 100 - k},{120},{31}\n" for k in range(5))
    header = (
        "Time(ms),[ID:001] Present Position,[ID:001] Present Velocity,"
        "[ID:001] Present Current,[ID:001] Present Input Voltage,[ID:001] Present Temperature\n"
    )
    (tmp_path / "graph.csv").write_text(header + rows)
    imported = import_recording(tmp_path / "graph.csv", torque_constant=2.67)
    frame = imported.log.frame
    k = np.arange(5)
    assert frame["time_s"].to_numpy() == pytest.approx(0.01 * k)
    assert frame["position_rad"].to_numpy() == pytest.approx((2048 + k) * 2 * np.pi / 4096)
    assert frame["velocity_rad_s"].to_numpy() == pytest.approx((k - 2) * 0.229 * np.pi / 30)
    assert frame["current_a"].to_numpy() == pytest.approx(-(100 + k) * 2.69e-3)
    assert frame["supply_voltage_v"].tolist() == pytest.approx([12.0] * 5)
    told = "\n".join(imported.notes)
    assert '"[ID:001] Present Current" lost its sign' in told
    assert "presumed:" in told
    assert "count:4096" in told
    given = import_recording(
        tmp_path / "graph.csv", torque_constant=2.67, units={"current": "mA", "velocity": "0.01rpm"}
    )
    assert given.log.frame["current_a"].iloc[0] == pytest.approx(-0.1)
    assert given.log.frame["velocity_rad_s"].iloc[0] == pytest.approx(-0.02 * np.pi / 30)


def test_control_items_already_converted_and_of_two_servos(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time_s,Present Position,Present Current\n0,1.5,0.5\n0.01,1.6,0.5\n")
    frame = import_recording(tmp_path / "a.csv", torque_constant=1.0).log.frame
    assert frame["position_rad"].tolist() == [1.5, 1.6]
    header = "time_s,[ID:001] Present Position,[ID:002] Present Position,[ID:001] Present Current\n"
    (tmp_path / "b.csv").write_text(header + "0,1,2,3\n0.01,1,2,3\n")
    with pytest.raises(InputError, match=r"may all be the position; choose with --map position_rad=\[ID:"):
        import_recording(tmp_path / "b.csv", torque_constant=1.0)
    chosen = import_recording(
        tmp_path / "b.csv", torque_constant=1.0, mapping={"position_rad": "[ID:002] Present Position"}
    )
    assert chosen.log.frame["position_rad"].tolist() == pytest.approx([2 * 2 * np.pi / 4096] * 2)


# --- MATLAB v7.3 and HDF5 -------------------------------------------------------------------------------


def test_matlab_v73_as_matlab_writes_it(tmp_path: Path) -> None:
    hdf5storage = pytest.importorskip("hdf5storage")
    time = np.arange(50) * 1e-3
    content = {
        "t": time[:, None], "q": np.sin(time)[:, None], "tau": np.cos(time)[:, None],
        "extra": np.column_stack([time, 2 * time]), "note": "made by hand", "gtau": 35.15,
    }  # fmt: skip
    path = tmp_path / "run.mat"
    hdf5storage.savemat(str(path), content, format="7.3", matlab_compatible=True, oned_as="column")
    assert path.read_bytes().startswith(b"MATLAB 7.3")
    imported = import_recording(path)
    frame = imported.log.frame
    np.testing.assert_array_equal(frame["time_s"], time)
    np.testing.assert_array_equal(frame["torque_nm"], np.cos(time))
    np.testing.assert_array_equal(frame["extra_2"], 2 * time)


def test_hdf5_of_groups_and_tables(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    time = np.arange(20) * 1e-3
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["rig/t"], file["rig/q"], file["rig/tau"] = time, time**2, time + 1
    imported = import_recording(
        tmp_path / "run.h5", mapping={"time": "rig.t", "position": "rig.q", "torque": "rig.tau"}
    )
    np.testing.assert_array_equal(imported.log.frame["torque_nm"], time + 1)
    table = pd.DataFrame({"t": time, "q": time**2, "tau": time}).to_records(index=False)
    with h5py.File(tmp_path / "table.h5", "w") as file:
        file["run"] = table
    mapping = {"time": "run.t", "position": "run.q", "torque": "run.tau"}
    assert len(import_recording(tmp_path / "table.h5", mapping=mapping).log.frame) == 20


def test_stamps_of_either_ros_are_the_same() -> None:
    from idtool.importing.ros import _nanoseconds

    assert _nanoseconds(SimpleNamespace(sec=2, nanosec=5)) == 2_000_000_005
    assert _nanoseconds(SimpleNamespace(secs=2, nsecs=5)) == 2_000_000_005
