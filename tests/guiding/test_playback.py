"""A taught path: smoothed, inside the limits, edited by a person, played, and stopped where something is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.errors import InputError
from idtool.guiding.path import (
    TaughtPath,
    cut_by,
    limited,
    read_path,
    smoothed,
    waypoints,
    write_waypoints,
)
from idtool.guiding.playback import play
from idtool.log import Log, LogWriter
from idtool.parameters.axis import Axis
from idtool.rig.base import Sample, TrialSetup
from tests.control.double import Double, parameters

SETUP = TrialSetup(0.4, start_position=0.0)
TIME = np.arange(0.0, 6.0, 0.01)


def hand(trembling: float = 0.0) -> np.ndarray:
    """Up, a pause, and half the way back."""
    way = np.interp(TIME, [0.5, 2.5, 3.5, 5.0], [0.0, 0.8, 0.8, 0.4])
    return way + trembling * np.sin(2 * np.pi * 10.0 * TIME)


def taught(path: Path, position: np.ndarray) -> Path:
    with LogWriter(
        path, ["trial", "time_s", "position_rad", "current_a"], Axis("rotary", 2.67), "teach"
    ) as log:
        log.append(np.column_stack([0 * TIME, 5.0 + TIME, position, 0 * TIME]))
    return path


def test_trembling_is_taken_off_and_the_way_stays(tmp_path: Path) -> None:
    path, axis = read_path(taught(tmp_path / "taught.csv", hand(0.01)))
    assert axis.kind == "rotary"
    apart = smoothed(TIME, hand(0.01), "rotary").position - smoothed(TIME, hand(), "rotary").position
    assert np.max(np.abs(apart[200:-200])) < 0.001
    assert abs(path.position[0]) < 0.012
    assert path.position[-1] == pytest.approx(0.4, abs=0.012)


def test_a_path_begins_where_the_hand_does(tmp_path: Path) -> None:
    path, _ = read_path(taught(tmp_path / "taught.csv", hand()))
    assert path.duration < 5.0 - 0.5 + 1.0
    assert path.at(0.0)[1] == 0.0
    assert path.at(99.0) == (pytest.approx(0.4, abs=0.01), 0.0)


def test_limits_slow_the_whole_path_and_cut_its_ends() -> None:
    path = smoothed(TIME, hand(), "rotary")
    same, scale = limited(path, low=-9, high=9, speed=9, acceleration=99, scale=0.5)
    assert scale == 0.5
    assert same.duration == pytest.approx(2 * path.duration)
    slow, scale = limited(path, low=-9, high=0.6, speed=0.2, acceleration=99)
    assert scale == pytest.approx(0.5, abs=0.02)
    assert np.max(np.abs(np.gradient(slow.position, slow.time))) <= 0.2 * 1.001
    assert np.max(slow.position) == 0.6
    gentle, scale = limited(path, low=-9, high=9, speed=9, acceleration=0.3)
    speeds = np.gradient(gentle.position, gentle.time)
    assert np.max(np.abs(np.gradient(speeds, gentle.time))) <= 0.31
    assert scale < 1.0


def test_what_is_cut_off_a_path_is_said() -> None:
    path = smoothed(TIME, hand(), "rotary")
    top = float(np.max(path.position))
    assert cut_by(path, -9.0, 9.0) is None
    said = f"goes to {top:.4g} rad, beyond -9 to 0.6 rad, and is cut"
    assert said in str(cut_by(path, -9.0, 0.6))


def test_waypoints_are_few_and_come_back(tmp_path: Path) -> None:
    path = smoothed(TIME, hand(), "rotary")
    file = tmp_path / "points.toml"
    count = write_waypoints(file, path)
    assert count == len(waypoints(path)) < 30
    back, _ = read_path(file)
    apart = [back.at(t + 0.12)[0] - path.at(t)[0] for t in np.arange(0.0, path.duration, 0.05)]
    assert np.max(np.abs(apart)) < 0.03
    with pytest.raises(InputError, match="exists"):
        write_waypoints(file, path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('schema = "other"', "ffc-id/waypoints/1"),
        ('schema = "ffc-id/waypoints/1"\naxis = {kind = "rotary"}\npoints = []', "two points"),
        (
            'schema = "ffc-id/waypoints/1"\naxis = {kind = "rotary"}\n'
            "points = [{time_s = 0.0, position_rad = 0.0}, {time_s = 0.0, position_rad = 1.0}]",
            "do not rise",
        ),
        (
            'schema = "ffc-id/waypoints/1"\naxis = {kind = "rotary"}\n'
            "points = [{time_s = 0.0, position_rad = 0.0}, {time_s = 1.0, position_rad = nan}]",
            r"points\[1\].position_rad",
        ),
        (
            'schema = "ffc-id/waypoints/1"\naxis = {kind = "rotary"}\n'
            "points = [{time_s = 0.0, position_rad = 0.0}, {time_s = 1e300, position_rad = 1.0}]",
            r"lasts 1e\+300 s, longer than the 28800 s",
        ),
    ],
)
def test_a_file_of_waypoints_that_is_none(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "points.toml").write_text(text)
    with pytest.raises(InputError, match=words):
        read_path(tmp_path / "points.toml")


def test_an_axis_that_never_moved_is_no_path(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not move"):
        read_path(taught(tmp_path / "taught.csv", 0 * TIME))


def test_a_clock_that_counts_no_seconds_is_no_path(tmp_path: Path) -> None:
    file = taught(tmp_path / "taught.csv", hand())
    frame = Log.read(file).frame
    nanoseconds = replace(Log.read(file), rows=frame.assign(time_s=1e9 * frame["time_s"]))
    nanoseconds.write(tmp_path / "ns.csv")
    with pytest.raises(InputError, match=r"ns\.csv: the path lasts .* its time must count seconds"):
        read_path(tmp_path / "ns.csv")


def straight() -> TaughtPath:
    return smoothed(np.array([0.0, 3.0]), np.array([0.3, 0.9]), "rotary")


def test_played_from_anywhere_it_follows_its_path(tmp_path: Path) -> None:
    played = play(
        straight(),
        Double(position_gain=20.0),
        SETUP,
        parameters=parameters(),
        log=tmp_path / "p.csv",
        loops=2,
    )
    assert played.stopped is None
    assert played.rms_error < 0.01
    assert played.lag_s == pytest.approx(1 / 20.0, abs=0.02)
    log = Log.read(tmp_path / "p.csv")
    assert log.experiment == "play"
    start = log.frame["position_rad"].to_numpy()[:150]
    assert np.max(np.abs(np.diff(start))) < 0.01 * 0.6, "to the first point slowly"
    assert np.sum(np.diff(np.sign(log.frame["position_rad"] - 0.6)) != 0) == 3, "up, back, up"


def test_it_stops_at_what_is_in_the_way_and_says_where() -> None:
    def wall(sample: Sample) -> float:
        return -20.0 * max(sample.position - 0.6, 0.0)

    rig = Double(position_gain=20.0)
    shown: list[float] = []
    played = play(
        straight(), rig, SETUP, parameters=parameters(), contact=0.4, obstacle=wall,
        watch=lambda *row: shown.append(row[-1]),
    )  # fmt: skip
    assert np.isnan(shown[0]), "nothing is felt before it has listened"
    assert shown[-1] == pytest.approx(-0.4, abs=0.1)
    assert np.nanmax(np.abs(shown[: len(shown) // 2])) < 0.1
    assert played.stopped is not None
    assert played.stopped.why == "contact"
    assert played.stopped.position == pytest.approx(0.62, abs=0.03)
    assert played.stopped.torque == pytest.approx(-0.42, abs=0.1)
    free = play(straight(), Double(position_gain=20.0), SETUP, parameters=parameters(), contact=0.4)
    assert free.stopped is None


def test_without_a_model_it_stops_where_it_stays_behind() -> None:
    played = play(
        straight(), Double(), SETUP, behind=0.1, obstacle=lambda s: -90.0 * max(s.position - 0.6, 0.0)
    )
    assert played.stopped is not None
    assert played.stopped.why == "behind"
    assert played.stopped.torque is None


def test_a_file_of_another_payload_is_felt_from_the_start() -> None:
    """It listens at rest; what the payload is wrong by is not taken for a contact."""
    rig = replace(Double(position_gain=20.0), real_payload=0.5)
    assert play(straight(), rig, SETUP, parameters=parameters(), contact=0.4).stopped is None


def test_it_stops_on_the_way_to_the_start_too() -> None:
    def wall(sample: Sample) -> float:
        return -90.0 * max(sample.position - 0.1, 0.0)

    played = play(straight(), Double(), SETUP, parameters=parameters(), contact=0.4, obstacle=wall)
    assert played.stopped is not None
    assert played.stopped.why == "contact"
    assert played.stopped.position < 0.2
    assert not len(played.time)
