"""What every rig must do: simulated, a servo over its real protocol, a log played back, one supervised."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from idtool.errors import RigFault
from idtool.experiment.recipe import Recipe, parse_recipe
from idtool.experiment.runner import run
from idtool.log import Log
from idtool.rig import open_rig
from idtool.rig.base import Block, Rig, Sample, Trajectory, TrialSetup
from idtool.rig.supervisor import Supervisor

from .dynamixel.support import FLAT, Bench

TEXT = """
schema = "ffc-id/recipe/1"
name = "contract"
experiment = "sine"
[setup]
tilt_alpha_rad = 1.5707963267948966
rest_s = 0.1
[[trials]]
kind = "sine"
frequency_hz = [1.0, 2.0]
amplitude_rad_s = 0.4
duration_s = 1.0
"""
RECIPE = parse_recipe(TEXT, "contract.toml")
#: Wide enough for the supervisor of a replay, whose limits are those of the log.
WIDE = parse_recipe(TEXT.replace("[1.0, 2.0]", "[0.5]").replace("1.0\n", "2.0\n"), "wide.toml")
KINDS = ["simulated", "dynamixel", "by supply", "feetech", "volts", "replay", "supervised"]


@pytest.fixture(params=KINDS)
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Rig]:
    with ExitStack() as stack:
        made: dict[str, Callable[[], Rig]] = {
            "simulated": lambda: open_rig("sim:bench"),
            "supervised": lambda: Supervisor(open_rig("sim:bench")),
            "volts": lambda: open_rig("sim:bench,sensors=feetech"),
            "dynamixel": lambda: stack.enter_context(Bench()).rig(),
            "by supply": lambda: stack.enter_context(Bench(model=1200)).rig(),
            "feetech": lambda: stack.enter_context(Bench(kind="feetech")).rig(speed=2.0),
            "replay": lambda: recorded(tmp_path),
        }
        yield stack.enter_context(made[request.param]())


def recorded(folder: Path, name: str = "sim:bench", recipe: Recipe = RECIPE) -> Rig:
    with open_rig(name) as simulated:
        run(recipe, simulated, folder / "recorded.csv")
    return open_rig(f"replay:{folder / 'recorded.csv'}")


def setup(start: float | None = 0.0) -> TrialSetup:
    return TrialSetup(tilt_alpha_rad=FLAT.tilt_alpha_rad, start_position=start, rest_s=0.1)


def trajectory(rig: Rig, trial: int = 0) -> Trajectory:
    return Trajectory(rig.period_s, "velocity", RECIPE.trials[trial].motion.command(rig.period_s))


def test_it_says_what_it_is(rig: Rig) -> None:
    low, high = rig.limits.position
    assert low < high
    assert rig.limits.speed > 0
    assert rig.limits.current > 0
    assert 0 < rig.limits.duty <= 1
    assert 0 < rig.period_s <= 0.1
    assert rig.axis.kind in ("rotary", "linear")
    assert (rig.axis.torque_constant is not None) == (rig.measures == "current")
    assert rig.description
    assert "\n" not in rig.description


def test_nothing_moves_before_it_is_prepared(rig: Rig) -> None:
    with pytest.raises(RigFault, match="not prepared"):
        rig.step(0.0)
    with pytest.raises(RigFault, match="not prepared"):
        list(rig.play(trajectory(rig)))


def test_a_trajectory_is_played_in_blocks(rig: Rig) -> None:
    rig.prepare(setup())
    planned = trajectory(rig)
    blocks = list(rig.play(planned))
    for block in blocks:
        columns = [block.time_s, block.position, block.velocity, block.effort, block.command]
        assert (block.current is not None) == (rig.measures == "current")
        assert (block.duty is not None) == (rig.measures == "voltage")
        assert (block.bus_current is not None) == rig.measures_bus_current
        assert {len(column) for column in columns} == {len(block.time_s)}
        assert (block.temperature is not None) == rig.measures_temperature
        assert (block.voltage is not None) == rig.measures_voltage
        assert all(np.isfinite(column).all() for column in columns)
    time, position, velocity, command = (
        np.concatenate([getattr(block, name) for block in blocks])
        for name in ("time_s", "position", "velocity", "command")
    )
    assert len(blocks) > 1
    assert 0.6 * len(planned.command) < len(time) <= len(planned.command)
    assert np.all(np.diff(time) > 0)
    assert time[-1] - time[0] == pytest.approx(1.0, abs=0.04)
    # it goes where it is told to
    assert np.ptp(position) == pytest.approx(0.4 / np.pi, abs=0.03)
    assert np.corrcoef(velocity, command)[0, 1] > 0.8
    due = np.interp(time, time[0] + planned.period_s * np.arange(len(planned.command)), planned.command)
    assert np.mean(np.abs(command - due)) < 0.03


def test_its_clock_runs_on_and_it_stands_between_trials(rig: Rig) -> None:
    last: Block | None = None
    for trial in (0, 1):
        rig.prepare(setup())
        blocks = list(rig.play(trajectory(rig, trial)))
        assert abs(blocks[0].velocity[0]) < 0.1
        if last is not None:
            assert blocks[0].time_s[0] > last.time_s[-1]
        last = blocks[-1]


def test_it_steps(rig: Rig) -> None:
    rig.prepare(setup())
    samples = [rig.step(0.0) for _ in range(20)]
    assert all(isinstance(sample, Sample) for sample in samples)
    time = np.array([sample.time_s for sample in samples])
    assert np.median(np.diff(time)) == pytest.approx(rig.period_s, rel=0.3)
    assert all(np.isfinite([s.position, s.velocity, s.effort]).all() for s in samples)
    assert all((s.temperature is not None) == rig.measures_temperature for s in samples)
    if not rig.simulated:
        with pytest.raises(RigFault, match="simulated hand cannot push"):
            rig.step(0.0, 0.1)


def test_it_stops_at_any_time_any_number_of_times(rig: Rig) -> None:
    rig.stop()
    rig.prepare(setup())
    rig.stop()
    blocks = rig.play(trajectory(rig))
    next(blocks)
    rig.stop()
    rig.stop()
    rig.prepare(setup())
    assert list(rig.play(trajectory(rig, 1)))


def test_a_closed_rig_answers_with_a_fault(rig: Rig) -> None:
    rig.prepare(setup())
    rig.close()
    rig.close()
    rig.stop()
    for act in (lambda: rig.prepare(setup()), lambda: rig.step(0.0), lambda: list(rig.play(trajectory(rig)))):
        with pytest.raises(RigFault, match="closed"):
            act()


def test_leaving_it_closes_it(rig: Rig) -> None:
    def leave() -> None:
        with rig:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        leave()
    with pytest.raises(RigFault, match="closed"):
        rig.prepare(setup())


def test_a_recipe_runs_on_it(rig: Rig, tmp_path: Path) -> None:
    done = run(RECIPE, rig, tmp_path / "log.csv")
    log = Log.read(tmp_path / "log.csv")
    assert (done.trials, len(log.trials)) == (2, 2)
    assert done.rows == len(log.frame)
    assert log.axis == rig.axis
    assert ("temperature_degc" in log.frame) == rig.measures_temperature
    assert ("supply_voltage_v" in log.frame) == rig.measures_voltage
    assert ("current_a" in log.frame, "duty" in log.frame) == (
        rig.measures == "current",
        rig.measures == "voltage",
    )
    assert ("bus_current_a" in log.frame) == rig.measures_bus_current


@pytest.mark.parametrize("name", ["sim:bench", "sim:bench,sensors=feetech"])
def test_a_replay_is_the_log_again(tmp_path: Path, name: str) -> None:
    with recorded(tmp_path, name, WIDE) as rig:
        run(WIDE, rig, tmp_path / "again.csv")
    first, again = (Log.read(tmp_path / name) for name in ("recorded.csv", "again.csv"))
    assert first.frame.equals(again.frame)


def test_a_replay_wants_its_own_recipe(tmp_path: Path) -> None:
    with recorded(tmp_path) as rig:
        with pytest.raises(RigFault, match=r"was made with payload_kg = 0, not 0\.5"):
            rig.prepare(TrialSetup(payload_kg=0.5, tilt_alpha_rad=FLAT.tilt_alpha_rad))
        rig.prepare(setup())
        with pytest.raises(RigFault, match="ends before the trajectory"):
            list(rig.play(Trajectory(rig.period_s, "velocity", np.zeros(1000))))
        with pytest.raises(RigFault, match="is over"):
            rig.step(0.0)
        with pytest.raises(RigFault, match="no further one"):
            rig.prepare(setup())
