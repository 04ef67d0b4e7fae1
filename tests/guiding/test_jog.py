"""Jogging: keys out of bytes, where a tap and a held key lead, an axis that follows or meets something."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from idtool.guiding.button import REPEAT_S
from idtool.guiding.jog import BRAKE_S, ArrowKeys, Jogged, JogMotion, jog
from idtool.guiding.path import read_path
from idtool.log import Log
from idtool.rig.base import Sample, TrialSetup
from tests.control.double import Double, parameters

PERIOD, STEP, SPEED = 0.01, 0.01, 0.1
SETUP = TrialSetup(0.4, start_position=0.0)


def typed(*parts: bytes) -> ArrowKeys:
    """Keys that come so, one part a call."""
    rest = iter(parts)
    return ArrowKeys(lambda: next(rest, b""))


def test_arrows_come_whole_in_pieces_or_among_others() -> None:
    keys = typed(b"\x1b[A\x1b[D", b"\x1b", b"[", b"C", b"x\x1bOBy", b"")
    assert [keys() for _ in range(6)] == [[1, -1], [], [], [1], [-1], []]
    assert not keys.ended


def test_q_ends_it_and_so_does_a_terminal_that_is_gone() -> None:
    keys = typed(b"\x1b[Aq\x1b[A")
    assert keys() == [1]
    assert keys.ended
    assert keys() == []
    gone = ArrowKeys(lambda: b"", lambda: True)
    assert gone() == []
    assert gone.ended


def moved(presses: dict[float, int], until: float = 3.0, high: float = 1.0) -> np.ndarray:
    """Goals at every period while these keys come, time of a press -> direction."""
    motion = JogMotion(0.0, step=STEP, speed=SPEED, low=-1.0, high=high)
    goals = []
    for now in np.arange(0.0, until, PERIOD):
        for at in [at for at in presses if at <= now]:
            motion.press(presses.pop(at), at)
        goals.append(motion.advance(now, PERIOD))
    return np.array(goals)


def held(since: float, until: float, direction: int = 1) -> dict[float, int]:
    """As a keyboard sends a key that is held."""
    return {since: direction} | {float(at): direction for at in np.arange(since + 0.5, until, 0.03)}


def test_taps_move_by_steps() -> None:
    assert moved({0.1: 1})[-1] == pytest.approx(STEP)
    assert moved({0.1: 1, 0.4: 1, 0.7: 1})[-1] == pytest.approx(3 * STEP)
    assert moved({0.1: 1, 0.9: -1})[-1] == pytest.approx(0.0)


def test_a_held_key_moves_on_at_the_speed_and_its_release_brakes() -> None:
    goals = moved(held(0.1, 1.6), 4.0)
    speeds = np.diff(goals) / PERIOD
    assert np.max(speeds) == pytest.approx(SPEED)
    assert np.max(np.abs(np.diff(speeds))) <= 2 * SPEED / BRAKE_S * PERIOD * 1.5
    assert np.min(speeds) >= 0.0, "it does not come back"
    released = round((1.6 + REPEAT_S) / PERIOD)
    assert goals[-1] - goals[released] <= SPEED * BRAKE_S
    assert goals[-1] == goals[-50]


def test_the_other_key_turns_it_round_at_once() -> None:
    goals = moved(held(0.1, 1.6) | {1.6: -1}, 4.0)
    furthest = int(np.argmax(goals))
    assert furthest * PERIOD < 1.6 + BRAKE_S
    assert goals[-1] < goals[furthest]


def test_it_stays_in_its_range() -> None:
    goals = moved(held(0.1, 2.6), 4.0, high=0.05)
    assert np.max(goals) == goals[-1] == 0.05
    assert moved({0.1: 1, 0.4: 1}, high=0.005)[-1] == 0.005


def jogged(
    rig: Double,
    presses: dict[float, int],
    until: float,
    *,
    obstacle: Callable[[Sample], float] | None = None,
    behind: float = 1.0,
    model: bool = True,
    log: Path | None = None,
) -> Jogged:
    """A run in which these keys come, and q at last."""
    left = presses | {until: 0}

    def read() -> bytes:
        due = [at for at in left if at <= rig.time]
        words = {1: b"\x1b[A", -1: b"\x1b[B", 0: b"q"}
        return b"".join(words[left.pop(at)] for at in sorted(due))

    return jog(
        rig, SETUP, ArrowKeys(read), step=STEP, speed=SPEED, now=lambda: rig.time, obstacle=obstacle, log=log,
        parameters=parameters() if model else None, contact=0.4, behind=behind,
    )  # fmt: skip


def test_the_axis_goes_where_the_keys_want_it_and_the_way_can_be_played(tmp_path: Path) -> None:
    run = jogged(Double(position_gain=20.0), held(1.0, 4.0) | {5.0: -1}, 7.0, log=tmp_path / "way.csv")
    assert run.stopped is None
    assert not run.interrupted
    assert 0.2 < run.position - run.start < 0.4
    log = Log.read(tmp_path / "way.csv")
    assert log.experiment == "jog"
    assert np.max(log.frame["velocity_rad_s"]) < 1.6 * SPEED
    path, _ = read_path(tmp_path / "way.csv")
    assert np.ptp(path.position) == pytest.approx(np.ptp(log.frame["position_rad"]), rel=0.05)


@pytest.mark.parametrize("model", [True, False])
def test_it_stops_at_what_is_in_the_way_and_says_where(model: bool) -> None:
    def wall(sample: Sample) -> float:
        return -90.0 * max(sample.position - 0.1, 0.0)

    run = jogged(Double(position_gain=20.0), held(1.0, 9.0), 9.0, obstacle=wall, behind=0.05, model=model)
    assert run.stopped is not None
    assert run.stopped.why == ("contact" if model else "behind")
    assert 0.1 < run.stopped.position < 0.2
    assert (run.stopped.torque is not None) is model


class Pressed(Double):
    """Somebody presses Ctrl-C."""

    stopped = False

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        if self.time > 2.0:
            raise KeyboardInterrupt
        return super().step(position_command, external_torque_nm)

    def stop(self) -> None:
        self.stopped = True


def test_an_interrupt_stops_the_axis_and_keeps_the_rows(tmp_path: Path) -> None:
    rig = Pressed(position_gain=20.0)
    run = jogged(rig, held(1.0, 9.0), 9.0, log=tmp_path / "way.csv")
    assert run.interrupted
    assert rig.stopped
    assert len(Log.read(tmp_path / "way.csv").frame) > 150
