"""The supervisor around any rig: limits, loop time, a dead encoder, and the last second."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from idtool.errors import RigFault
from idtool.parameters.axis import Axis
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup
from idtool.rig.faults import BadReading, LimitExceeded, NotFollowing
from idtool.rig.supervisor import REMEMBERED_S, Supervisor

PERIOD = 0.01


class Scripted(Rig):
    """Plays given blocks."""

    def __init__(self, blocks: list[Block], fault: RigFault | None = None) -> None:
        self.axis, self.limits = Axis("rotary", 2.0), Limits((-2.0, 2.0), 1.0, 1.0, 60.0)
        self.period_s, self.description = PERIOD, "scripted"
        self.measures_temperature = True
        self.stops = 0
        self._blocks, self._fault = blocks, fault

    def prepare(self, setup: TrialSetup) -> None:
        if setup.payload_kg:
            raise RigFault("too heavy")

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        yield from self._blocks
        if self._fault:
            raise self._fault

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        block = self._blocks.pop(0)
        assert block.temperature is not None
        readings = (block.time_s, block.position, block.velocity, block.current, block.temperature)
        return Sample(*(float(values[0]) for values in readings))

    def stop(self) -> None:
        self.stops += 1

    def close(self) -> None:
        pass


def blocks(count: int, samples: int = 10, speed: float = 0.2) -> list[Block]:
    """A motion at constant speed."""
    made = []
    for index in range(count):
        time = PERIOD * (1.0 + np.arange(index * samples, (index + 1) * samples))
        full = np.full(samples, 1.0)
        made.append(Block(time, speed * time, speed * full, 0.1 * full, speed * full, 25.0 * full))
    return made


def watch(rig: Scripted) -> tuple[list[Block], RigFault | None, Supervisor]:
    watched = Supervisor(rig)
    seen: list[Block] = []
    try:
        seen.extend(watched.play(Trajectory(PERIOD, "velocity", np.zeros(1))))
    except RigFault as fault:
        return seen, fault, watched
    return seen, None, watched


def test_what_is_well_passes() -> None:
    rig = Scripted(blocks(30))
    seen, fault, watched = watch(rig)
    assert fault is None
    assert len(seen) == 30
    assert rig.stops == 0
    assert (watched.loop.samples, watched.loop.overruns) == (300, 0)
    assert watched.loop.longest_s == pytest.approx(PERIOD)


@pytest.mark.parametrize(
    ("what", "value", "kind", "sentence"),
    [
        ("position", 2.3, LimitExceeded, "its position of 2.3 rad at"),
        ("position", -2.3, LimitExceeded, "its position of -2.3 rad at"),
        ("velocity", 1.06, LimitExceeded, "its velocity of 1.06 rad/s at"),
        ("current", -1.06, LimitExceeded, "its current of -1.06 A at"),
        ("temperature", 60.5, LimitExceeded, "its temperature of 60.5 °C at"),
        ("current", np.nan, BadReading, "no number"),
        ("temperature", np.inf, BadReading, "no number"),
    ],
)
def test_what_leaves_its_limits_is_stopped_at_once(
    what: str, value: float, kind: type[RigFault], sentence: str
) -> None:
    played = blocks(30)
    bad = getattr(played[20], what).copy()
    bad[4] = value
    played[20] = replace(played[20], **{what: bad})
    rig = Scripted(played)
    seen, fault, _ = watch(rig)
    assert type(fault) is kind
    assert sentence in str(fault)
    assert rig.stops >= 1
    # evidence is handed on; what is no number is not
    assert len(seen) == (21 if kind is LimitExceeded else 20)
    assert fault is not None
    assert fault.history.time_s[-1] == seen[-1].time_s[-1]


@given(st.integers(1, 30), st.integers(1, 30))
@settings(max_examples=30)
def test_a_fault_of_the_rig_carries_the_last_second(count: int, samples: int) -> None:
    rig = Scripted(blocks(count, samples), RigFault("the drive failed"))
    seen, fault, _ = watch(rig)
    assert str(fault) == "the drive failed"
    assert rig.stops >= 1
    assert fault is not None
    history = fault.history
    whole = np.concatenate([block.time_s for block in seen])
    wanted = whole[whole >= whole[-1] - REMEMBERED_S]
    np.testing.assert_array_equal(history.time_s, wanted)
    assert {len(history.position), len(history.temperature), len(history.command)} == {len(wanted)}
    assert history.voltage is None


def test_late_samples_are_counted_inside_a_motion_only() -> None:
    played = blocks(4)
    late = replace(played[2], time_s=played[2].time_s + 0.03)
    rig = Scripted([*played[:2], late])
    watched = Supervisor(rig)
    trajectory = Trajectory(PERIOD, "velocity", np.zeros(1))
    list(watched.play(trajectory))
    assert (watched.loop.samples, watched.loop.overruns) == (30, 1)
    assert watched.loop.longest_s == pytest.approx(0.04)
    watched.prepare(TrialSetup())
    rig._blocks = [replace(block, time_s=block.time_s + 100.0) for block in played]
    list(watched.play(trajectory))
    assert (watched.loop.samples, watched.loop.overruns) == (70, 1)


@pytest.mark.parametrize("moved", [0.0, 0.05])
def test_a_position_that_does_not_follow(moved: float) -> None:
    """Dead, or moving at a twentieth of what is commanded."""
    played = [replace(block, position=moved * block.position) for block in blocks(200)]
    seen, fault, _ = watch(Scripted(played))
    assert isinstance(fault, NotFollowing)
    # 4 % of the range of 4 rad at 0.2 rad/s
    assert seen[-1].time_s[-1] == pytest.approx(0.16 / 0.2, abs=0.12)


@pytest.mark.parametrize("frequency", [0.2, 1.0, 2.0, 4.0])
def test_the_lag_of_a_drive_is_no_fault(frequency: float) -> None:
    time = PERIOD * np.arange(1.0, 1001.0)
    amplitude = 0.9
    command = amplitude * np.sin(2 * np.pi * frequency * time)
    lag = 0.05
    velocity = amplitude * np.sin(2 * np.pi * frequency * (time - lag)) / np.hypot(1, frequency * 0.3)
    position = np.cumsum(velocity) * PERIOD - 0.2
    whole = Block(time, position, velocity, 0.1 * velocity, command, np.full(1000, 25.0))
    _, fault, _ = watch(Scripted([whole]))
    assert fault is None


def test_a_fault_while_preparing_carries_what_came_before() -> None:
    rig = Scripted(blocks(3))
    watched = Supervisor(rig)
    with pytest.raises(RigFault, match="too heavy") as caught:
        watched.prepare(TrialSetup(payload_kg=1.0))
    assert caught.value.history is None
    list(watched.play(Trajectory(PERIOD, "velocity", np.zeros(1))))
    with pytest.raises(RigFault, match="too heavy") as caught:
        watched.prepare(TrialSetup(payload_kg=1.0))
    assert len(caught.value.history.time_s) == 30


def test_steps_are_watched_too() -> None:
    rig = Scripted(blocks(200, 1))
    watched = Supervisor(rig)
    for _ in range(150):
        watched.step(0.0)
    second = watched.last_second()
    assert second is not None
    assert len(second.time_s) == 101
    rig._blocks[0] = replace(rig._blocks[0], position=np.array([5.0]))
    with pytest.raises(LimitExceeded, match="its position of 5 rad") as caught:
        watched.step(0.0)
    assert caught.value.history.position[-1] == 5.0
    assert rig.stops >= 1
