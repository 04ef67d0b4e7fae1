"""The tables of legal changes of state, walked by sessions with a random hand, button and faults."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from idtool.control import ForceFreeController, State
from idtool.control.admittance.law import AdmittanceLaw
from idtool.control.admittance.states import GRIP_TRANSITIONS, MAY_HOLD
from idtool.control.states import AROUND, LAWS, legal
from idtool.rig.base import TrialSetup

from .double import PAPER, Double
from .test_button import LIMITS, PUSH, file


def walked(mode: str, seed: int, steps: int = 6000) -> tuple[set[tuple[State, State]], set[tuple[int, int]]]:
    """Changes of state from step to step of a minute in which everything comes at random, and of what the
    admittance knows of the hand."""
    random = np.random.default_rng(seed)
    rig = Double(PAPER, seed=seed, bristle=0.004)
    rig.prepare(TrialSetup(0.4, start_position=0.0))
    controller = ForceFreeController(file(mode), 0.01, limits=LIMITS)
    hand, down, command, states, grips = 0.0, True, 0.0, [State.STARTING], [MAY_HOLD]
    for _ in range(steps):
        stopping = states[-1] is State.STOPPING  # which is short
        rarely = 0.04 if stopping else 0.003
        # a tare is seldom left alone, or none was ever used
        if random.random() < (0.2 if stopping else 0.003 if states[-1] is State.TARING else 0.03):
            hand = PUSH * random.choice([0.0, 0.0, 0.0, 0.6, 1.0, -1.0])
        if random.random() < (2.0 * rarely if down else 0.03):
            down = not down
        if mode == "light" and controller.ready and random.random() < 0.05:
            controller.tare()
        if controller.status.fault is not None and random.random() < 0.05:
            controller.recover()
        sample = rig.step(command, hand)
        current = np.nan if random.random() < rarely else sample.current
        command = controller.step(sample.position, sample.velocity, current, 0.4, enabled=down)
        states.append(controller.status.state)
        if isinstance(controller.law, AdmittanceLaw):
            grips.append(int(controller.law._s.grip))
    return {(a, b) for a, b in pairwise(states) if a is not b}, {(a, b) for a, b in pairwise(grips) if a != b}


@pytest.mark.parametrize("mode", LAWS)
def test_every_change_of_state_is_in_the_tables_and_every_row_is_walked(mode: str) -> None:
    walks = [walked(mode, seed) for seed in range(6)]
    assert set().union(*(states for states, _ in walks)) == legal(mode)
    names = list(GRIP_TRANSITIONS)
    named = {(names[a], names[b]) for _, grips in walks for a, b in grips}
    table = {(grip, to) for grip, ways in GRIP_TRANSITIONS.items() for to, _ in ways}
    assert named == (table if mode == "light" else set())


def test_the_page_prints_every_row() -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "teach.md").read_text(encoding="utf-8")
    rows = [(state, *way) for table in LAWS.values() for state, ways in table.items() for way in ways]
    rows += [
        (f"hand {grip}", f"hand {to}", when) for grip, ways in GRIP_TRANSITIONS.items() for to, when in ways
    ]
    rows += [(state or "any other", to, when) for state, to, when in AROUND]
    for row in rows:
        assert f" | {' | '.join(row)} |" in page
