"""sensor_msgs/JointState from ROS 1 bags, ROS 2 bags and MCAP recordings, one row per joint and message.

`rosbags` reads the bags and `mcap` recordings that stand alone; no ROS need be installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from idtool.errors import InputError
from idtool.importing.conversion import SI_UNITS
from idtool.importing.names import Meaning
from idtool.importing.table import Table

#: The most samples of one joint that are read; at 1 kHz and seven joints that is three quarters of an hour.
MAX_SAMPLES = 20_000_000

_MAGIC = {".bag": b"#ROSBAG", ".mcap": b"\x89MCAP", ".db3": b"SQLite format 3"}
_TYPES = ("sensor_msgs/JointState", "sensor_msgs/msg/JointState")
_MEANINGS = {
    "time": Meaning("time", "time", "s"),
    "position": Meaning("position", "position", SI_UNITS),
    "velocity": Meaning("velocity", "velocity", SI_UNITS),
    "effort": Meaning("effort", "torque", SI_UNITS),
}


class _Message(NamedTuple):
    topic: str
    received_ns: int
    content: Any


def is_bag(path: Path) -> bool:
    """Whether `path` is a bag, an MCAP recording or the folder of a ROS 2 bag."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    try:
        with open(path, "rb") as stream:
            start = stream.read(16)
    except (OSError, ValueError):
        return False  # said where files are read
    return any(start.startswith(magic) for magic in _MAGIC.values())


def read(path: Path) -> Table:
    """Every joint of every JointState in a recording; `topic` and `joint` tell them apart.

    Time counts from the first message, by the stamps in the messages or, where these are zero, by when
    each was received. Fields that a publisher left empty are missing.

    Raises:
        InputError: the packages are not installed, the recording is damaged or holds no JointState.
    """
    if path.is_file() and _starts(path, ".bag") and path.suffix != ".bag":
        raise InputError("is a ROS 1 bag by another name", remedy="let its name end in .bag")
    messages = _mcap if path.is_file() and _starts(path, ".mcap") else _bag
    rows = _rows(_guarded(messages, path))
    frame = pd.DataFrame(rows)
    stamps = frame.pop("stamp").to_numpy()
    received = frame.pop("received").to_numpy()
    notes = []
    if (stamps == 0).all():
        stamps = received
        notes.append("the messages carry no stamps; time is when they were received")
    frame.insert(0, "time", (stamps - stamps.min()) * 1e-9)
    frame = frame.dropna(axis="columns", how="all")
    if frame["topic"].nunique() == 1:
        frame = frame.drop(columns="topic")
    meanings = {name: item for name, item in _MEANINGS.items() if name in frame}
    single = tuple(name for name in ("topic", "joint") if name in frame)
    return Table(frame, notes=notes, meanings=meanings, single=single)


def _starts(path: Path, suffix: str) -> bool:
    with open(path, "rb") as stream:
        return stream.read(16).startswith(_MAGIC[suffix])


def _guarded(messages: Callable[[Path], Iterator[_Message]], path: Path) -> Iterator[_Message]:
    """The messages; whatever a reader of a foreign format raises becomes one sentence."""
    try:
        yield from messages(path)
    except ImportError as error:
        raise InputError(
            f"is a ROS recording, which needs {error.name}", remedy="pip install 'ffc-id[ros]'"
        ) from error
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            "is a damaged or unfinished recording",
            remedy="repair it with rosbag reindex, ros2 bag reindex or mcap recover, or record it again",
        ) from error


def _bag(path: Path) -> Iterator[_Message]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    # bags of ROS 2 before Iron do not say what their messages look like
    store = get_typestore(Stores.LATEST)
    with AnyReader([path], default_typestore=store) as reader:
        wanted = [connection for connection in reader.connections if connection.msgtype in _TYPES]
        if not wanted:
            raise _no_joints({connection.msgtype for connection in reader.connections})
        for connection, received, raw in reader.messages(connections=wanted):
            yield _Message(connection.topic, received, reader.deserialize(raw, connection.msgtype))


def _mcap(path: Path) -> Iterator[_Message]:
    from mcap.reader import make_reader
    from mcap_ros1.decoder import DecoderFactory as Ros1
    from mcap_ros2.decoder import DecoderFactory as Ros2

    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[Ros2(), Ros1()])
        summary = reader.get_summary()
        if summary is None:
            raise EOFError
        names = {schema.id: schema.name for schema in summary.schemas.values()}
        topics = [c.topic for c in summary.channels.values() if names.get(c.schema_id) in _TYPES]
        if not topics:
            raise _no_joints(set(names.values()))
        for _, channel, message, content in reader.iter_decoded_messages(topics=topics):
            yield _Message(channel.topic, message.log_time, content)


def _no_joints(types: set[str]) -> InputError:
    there = ", ".join(sorted(types)[:6]) or "no messages"
    return InputError(
        f"holds no sensor_msgs/JointState (it has {there})",
        remedy="record the topic that the joint state broadcaster publishes",
    )


def _rows(messages: Iterator[_Message]) -> dict[str, Any]:
    rows: dict[str, list[Any]] = {name: [] for name in ("topic", "joint", "stamp", "received")}
    fields: dict[str, list[float]] = {name: [] for name in ("position", "velocity", "effort")}
    for topic, received, content in messages:
        joints = list(content.name) or [""]
        count = len(joints)
        rows["topic"] += [topic] * count
        rows["joint"] += joints
        rows["stamp"] += [_nanoseconds(content.header.stamp)] * count
        rows["received"] += [received] * count
        for name, values in fields.items():
            found = getattr(content, name)
            values += [float(found[k]) if k < len(found) else np.nan for k in range(count)]
        if len(rows["stamp"]) > MAX_SAMPLES:
            raise InputError(f"holds over {MAX_SAMPLES} samples of joints", remedy="split it into parts")
    if not rows["stamp"]:
        raise InputError("has no data rows", remedy="record it again")
    return rows | fields


def _nanoseconds(stamp: Any) -> int:
    """A stamp as `rosbags` and ROS 2 spell it, or as ROS 1 does."""
    if hasattr(stamp, "nanosec"):
        return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
    return int(stamp.secs) * 1_000_000_000 + int(stamp.nsecs)
