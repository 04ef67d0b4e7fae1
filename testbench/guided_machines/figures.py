"""What a run is judged by: the truth inside the plant, once per millisecond, not the readings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from idtool.control.admittance.states import GUIDING
from idtool.model.motion import Array
from testbench.guided_machines import hands, plant
from testbench.guided_machines.hands import Arm, Script
from testbench.guided_machines.plant import COUNT
from testbench.guided_machines.session import PER, STATE, Run

Figures = dict[str, float]
#: A second in periods.
_S = round(1.0 / hands.PERIOD)


def _part(run: Run, mark: int) -> tuple[int, int, int]:
    """First period in which a hand touches, the one in which it leaves, the last of that mark."""
    periods = np.flatnonzero(run.script[:, plant.MARK] == mark)
    gripped = periods[run.script[periods, plant.GRIP] > 0.0]
    first, last = int(periods[0]), int(periods[-1]) + 1
    if not len(gripped):
        return first, first, last
    begin = int(gripped[0])
    off = np.flatnonzero(run.script[begin:last, plant.GRIP] == 0.0)
    return begin, begin + int(off[0]) if len(off) else last, last


def _stop(run: Run, let_go: int, last: int) -> float:
    """Time after which the axis stays within one count, ms."""
    rest = run.truth[0, let_go * PER : min(last, let_go + 140) * PER]
    away = np.flatnonzero(np.abs(rest - rest[-1]) > COUNT)
    return float(away[-1] + 1) if len(away) else 0.0


def _travel(run: Run, first: int, last: int) -> Array:
    """Place of the slide from the first of these periods on, mm."""
    q = run.truth[0, first * PER : last * PER]
    place: Array = 1e3 * run.ratio * (q - q[0])
    return place


def alone(run: Run) -> Figures:
    """Starts without a hand, and what the axis moved, mm, while nobody touched it for 0.4 s and more."""
    touched = (run.script[:, plant.GRIP] > 0.0) | (run.script[:, plant.LOAD] != 0.0)
    last = np.maximum.accumulate(np.where(touched, np.arange(len(touched)), -(10**6)))
    since = np.arange(len(touched)) - last
    asked = np.flatnonzero(run.script[:, plant.TARE] > 0.0)
    after = np.arange(len(touched)) > (asked[0] + 430 if len(asked) else 0)
    guiding = run.felt[:, STATE] == GUIDING
    started = guiding[1:] & ~guiding[:-1] & (since[1:] >= 2) & after[1:]
    speed = np.abs(run.truth[1].reshape(-1, PER)).mean(axis=1)
    crept = 1e3 * run.ratio * hands.PERIOD * float(np.sum(speed[(since > 40) & after]))
    return {"starts": float(np.sum(started)), "crept": crept}


def kind(run: Run, arm: Arm) -> Figures:
    """The old goals."""
    pushed = round((2.0 if arm.stiffness > 300.0 else 3.5) * _S)
    forces, swings, stops, ripples, energies, away = [], [], [], [], [], []
    for mark in range(1, 5):
        begin, let_go, last = _part(run, mark)
        way = 1.0 if mark % 2 else -1.0
        steady = slice((begin + pushed - _S) * PER, (begin + pushed) * PER)
        forces.append(way * float(np.mean(run.truth[3, steady])))
        swings.append(1e3 * run.ratio * float(np.std(run.truth[1, steady])))
        whole = slice(begin * PER, let_go * PER)
        energies.append(-float(np.sum(run.truth[3, whole] * run.truth[1, whole])) * run.ratio)  # 1 ms: mJ
        ripples.append(float(np.ptp(run.truth[0, last * PER - 500 : last * PER])) / COUNT)
        if mark <= 2:
            stops.append(_stop(run, let_go, last))
    for mark in (5, 6):
        begin, let_go, _ = _part(run, mark)
        moved = np.abs(_travel(run, begin, let_go)) > 0.5
        away.append(0.5e-3 * float(np.argmax(moved)) if moved.any() else 5.0)  # 0.5 N/s
    begin, _, last = _part(run, 7)
    drift = abs(float(run.truth[0, last * PER - 1] - run.truth[0, begin * PER + 500])) / COUNT
    return {
        "force": float(np.mean(forces)),
        "heaviest": max(forces),
        "break_away": max(away),
        "stop": max(stops),
        "drift": drift,
        "ripple": max(ripples),
        "swing": max(swings),
        "energy": max(energies),
    }


def reversing(run: Run, arm: Arm) -> Figures:
    """Stops after a hand that pushed back, ms, and the way until then, mm."""
    parts = [_part(run, mark) for mark in range(1, 7)]
    beyond = [float(np.max(np.abs(_travel(run, let_go, let_go + _S)))) for _, let_go, _ in parts]
    return {"turned": max(_stop(run, let_go, last) for _, let_go, last in parts), "beyond": max(beyond)}


def breathing(run: Run, arm: Arm) -> Figures:
    """How far the middle of the swing moved from the first breath to the last, mm."""
    breath = round(1000.0 / 0.3)
    found = {}
    for mark, newton in enumerate(hands.BREATHS, start=1):
        begin, let_go, _ = _part(run, mark)
        place = _travel(run, begin, let_go)
        found[f"wander_{newton:g}"] = abs(float(np.mean(place[-breath:]) - np.mean(place[:breath])))
    return found


def brisk(run: Run, arm: Arm) -> Figures:
    """The least way that a brisk hand was followed, mm."""
    parts = [_part(run, mark) for mark in range(1, 7)]
    return {"followed": min(float(np.max(np.abs(_travel(run, b, let_go)))) for b, let_go, _ in parts)}


def leaning(run: Run, arm: Arm) -> Figures:
    """How far it ran once the hand left that leant on it through the tare, mm."""
    begin, _, last = _part(run, 1)
    return {"ran": float(np.max(np.abs(_travel(run, begin, last)))), "refused": float(run.outcome != 0)}


def loading(run: Run, arm: Arm) -> Figures:
    """How far 0.4 kg moved it, mm; without a button a load is a hand."""
    found = {}
    for mark, name in ((1, "hung_on"), (2, "taken_off")):
        begin, _, last = _part(run, mark)
        found[name] = float(np.max(np.abs(_travel(run, begin, last))))
    return found


def ending(run: Run, arm: Arm) -> Figures:
    """How far it left the end of the stroke, mm."""
    begin, let_go, _ = _part(run, 1)
    return {"left": -float(_travel(run, begin, let_go)[-1])}


def trembling(run: Run, arm: Arm) -> Figures:
    """Speed beside its mean while led, mm/s rms, and pushes in which it stopped."""
    swings, stopped = [], 0
    for mark in range(1, 7):
        begin, let_go, _ = _part(run, mark)
        speed = run.truth[1, (begin + 80) * PER : let_go * PER]
        swings.append(1e3 * run.ratio * float(np.std(speed)))
        stopped += int(np.any(run.felt[begin + 60 : let_go, STATE] != GUIDING))
    return {"tremble": max(swings), "false_stops": float(stopped)}


#: name -> (script, judge, where it starts, rad)
SCENARIOS: dict[str, tuple[Callable[[Arm], Script], Callable[[Run, Arm], Figures], float]] = {
    "kind": (hands.kind, kind, 0.0),
    "reversing": (hands.reversing, reversing, 0.0),
    "breathing": (hands.breathing, breathing, 0.0),
    "brisk": (hands.brisk, brisk, 0.0),
    **{f"leaning_{n:g}": (lambda arm, n=n: hands.leaning(n), leaning, 0.0) for n in hands.LEANS},  # type: ignore[misc]
    "loading": (hands.loading, loading, 0.0),
    "ending": (hands.ending, ending, 1.9),
    "trembling": (hands.trembling, trembling, 0.0),
}
