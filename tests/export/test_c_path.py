"""A taught path in flash: the table, and the C that plays it beside `play`."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.control import Limits
from idtool.errors import InputError
from idtool.export.c_controller import export_c
from idtool.export.c_path import path_table
from idtool.guiding.path import TaughtPath, limited, smoothed
from idtool.guiding.playback import play
from idtool.guiding.player import REST_S
from idtool.log import Log
from idtool.rig.base import Sample, TrialSetup
from tests.control.double import Double, parameters
from tests.export.twin import FLAGS

LIMITS = Limits(-1.5, 1.5)
APPROACHING, FOLLOWING, DONE, BEHIND = range(4)
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")

_LIBRARY = """
#include "ffc_path.h"
static ffc_path_player player;
void begin(float position, int loops) { ffc_path_begin(&player, position, (uint8_t)loops); }
float step(float position) { ffc_path_step(&player, position); return player.position_command; }
int state(void) { return (int)player.state; }
float lag(void) { return player.lag; }
float at(uint32_t us) { float speed; return ffc_path_at(us, &speed); }
float speed_at(uint32_t us) { float speed; (void)ffc_path_at(us, &speed); return speed; }
"""


def taught() -> TaughtPath:
    """Up, a pause, and half the way back."""
    time = np.arange(0.0, 6.0, 0.01)
    return smoothed(time, np.interp(time, [0.5, 2.5, 3.5, 5.0], [0.2, 1.0, 1.0, 0.4]), "rotary")


@pytest.fixture(scope="module")
def player(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The C as a library of this machine, compiled with every warning an error."""
    folder = tmp_path_factory.mktemp("path")
    result = export_c(parameters(), folder, limits=LIMITS, path=taught())
    assert [file.name for file in result.files][-1] == "ffc_path.h"
    (folder / "library.c").write_text(_LIBRARY)
    command = ["gcc", *FLAGS, "-Wno-unused-function", "-O1", "-shared", "-fPIC", "-I", folder]
    subprocess.run([*command, folder / "library.c", "-lm", "-o", folder / "path.so"], check=True)
    library = ctypes.CDLL(str(folder / "path.so"))
    for name in ("step", "lag", "at", "speed_at"):
        getattr(library, name).restype = ctypes.c_float
    library.begin.argtypes = [ctypes.c_float, ctypes.c_int]
    library.step.argtypes = [ctypes.c_float]
    return library


def test_the_table_keeps_the_path_in_few_places() -> None:
    path = taught()
    table = path_table(path)
    assert np.max(np.abs(table.at(path.time) - path.position)) <= 1e-3 * np.ptp(path.position)
    assert table.bytes < 300
    assert len(table.counts) * table.step_s < path.duration + 2 * table.step_s


def test_a_path_that_is_too_long_for_a_board_is_refused() -> None:
    path = taught()
    with pytest.raises(InputError, match="a board plays"):
        path_table(replace(path, time=path.time * 1000.0))
    time = np.arange(0.0, 1900.0, 0.05)
    with pytest.raises(InputError, match="places"):
        path_table(TaughtPath(time, np.random.default_rng(0).normal(size=len(time)), "rotary"))


def test_a_path_needs_a_range_and_its_own_kind_of_axis(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="range"):
        export_c(parameters(), tmp_path, path=taught())
    with pytest.raises(InputError, match="linear axis"):
        export_c(parameters(), tmp_path, limits=LIMITS, path=replace(taught(), kind="linear"))


@needs_gcc
def test_the_c_reads_the_table_as_python_does(player: ctypes.CDLL) -> None:
    path, _ = limited(taught(), low=-1.5, high=1.5, speed=LIMITS.speed)
    table = path_table(path)
    us = np.arange(0, round(1e6 * path.duration) + 300_000, 7_777)
    there = np.array([player.at(ctypes.c_uint32(t)) for t in us.tolist()])
    assert np.max(np.abs(there - table.at(1e-6 * us))) < 1e-5
    speeds = np.array([player.speed_at(ctypes.c_uint32(t)) for t in us.tolist()])
    assert np.max(np.abs(speeds - [path.at(1e-6 * t)[1] for t in us.tolist()])) < 0.03 * np.max(speeds)


@needs_gcc
def test_fed_the_same_positions_it_commands_what_play_commands(player: ctypes.CDLL, tmp_path: Path) -> None:
    path, _ = limited(taught(), low=-1.5, high=1.5, speed=LIMITS.speed)
    rig = Double(position_gain=20.0, limits=replace(Double().limits, position=(-1.5, 1.5)))
    played = play(path, rig, TrialSetup(0.4, start_position=0.003), loops=2, log=tmp_path / "played.csv")
    assert played.stopped is None
    frame = Log.read(tmp_path / "played.csv").frame
    time = frame["time_s"].to_numpy()
    listened = 1 + int(np.sum(time - time[0] < REST_S - 1e-9))
    position = frame["position_rad"].to_numpy()[listened - 1 :]
    commands = frame["position_command_rad"].to_numpy()[listened:]
    player.begin(position[0], 2)
    ours = np.array([player.step(q) for q in position[:-1]])
    assert np.max(np.abs(ours - commands)) < 2e-3 * np.ptp(path.position)
    assert player.lag() == pytest.approx(played.lag_s, abs=2e-3)
    player.step(position[-1])
    assert player.state() == DONE


@needs_gcc
@pytest.mark.parametrize("place", [0.1, 0.7], ids=["on the way there", "on the path"])
def test_it_stops_where_something_is_in_the_way(player: ctypes.CDLL, place: float) -> None:
    def wall(sample: Sample) -> float:
        return -90.0 * max(sample.position - place, 0.0)

    rig = Double(position_gain=20.0)
    rig.prepare(TrialSetup(0.4, start_position=0.0))
    sample = rig.step(0.0)
    player.begin(sample.position, 1)
    for _ in range(1000):
        sample = rig.step(player.step(sample.position), wall(sample))
    assert player.state() == BEHIND
    assert sample.position < place + 0.2
    assert player.step(sample.position) == pytest.approx(player.step(0.0)), "it stays there"
