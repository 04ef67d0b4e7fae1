"""The sessions of the study of the diagnosis: axes of our own rig, and axes that share no code with it."""

from __future__ import annotations

import tempfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from idtool.log import Log
from testbench.cases import DISTURBANCES, EFFECTS, disturb, draw_effects, noise_of
from testbench.draws import between
from testbench.other_plants.cases import OtherCase
from testbench.other_plants.cases import cases as other_cases
from testbench.other_plants.effects import DISTURBANCES as OTHER_DISTURBANCES
from testbench.other_plants.session import make, save
from testbench.outcomes import KINDS, Case, Result
from testbench.plants import SESSION, either_bristle, random_plant, record_session

GRADES = ("lab", "dynamixel")


@dataclass(frozen=True)
class Recorded:
    """A session and what is true of it.

    Attributes:
        logs: to identify from.
        fresh: a run of another kind.
        coulomb: true level, N m (N).
        known: what is known before anything is found.
    """

    logs: list[Log]
    fresh: Log
    coulomb: float
    known: Result


def cases(
    axes: tuple[str, ...], null: int, single: int, several: int, unknown: int, real: int
) -> Iterator[Case]:
    """All sessions; a larger number adds some and changes none."""
    if "ours" in axes:
        yield from _ours(null, single, several, unknown)
    if "other" in axes:
        for other in other_cases(null, single, several, unknown, real, seed=7):
            yield Case(_kind(other), other.seed, other.what, "other")


def _kind(case: OtherCase) -> str:
    if case.composed:
        return KINDS[4]
    if any(name in OTHER_DISTURBANCES for name in case.what):
        return KINDS[3]
    return KINDS[min(len(case.what), 2)]


def _ours(null: int, single: int, several: int, unknown: int) -> Iterator[Case]:
    """Grades, the temperature column, pauses and steep ramps take turns."""

    def case(kind: str, number: int, what: tuple[str, ...]) -> Case:
        seed = zlib.crc32(repr((kind, number, what)).encode())
        # what pauses show cannot be found without them
        pauses = "breakaway_dwell" in what or number // 4 % 2 == 1
        hard = number // 8 % 2 == 1 if kind != KINDS[1] else seed % 2 == 1
        return Case(kind, seed, what, "ours", GRADES[number % 2], number // 2 % 2 == 0, pauses, hard)

    yield from (case(KINDS[0], k, ()) for k in range(null))
    for name in EFFECTS:
        yield from (case(KINDS[1], k, (name,)) for k in range(single))
    rng = np.random.default_rng(7)
    for k in range(several):
        names = rng.choice(list(EFFECTS), size=2 + k % 2, replace=False)
        yield case(KINDS[2], k, tuple(str(name) for name in names))
    for name in DISTURBANCES:
        yield from (case(KINDS[3], k, (name,)) for k in range(unknown))


def record(case: Case) -> Recorded:
    """Draw and record."""
    return _record_ours(case) if case.axis == "ours" else _record_other(case)


def _record_ours(case: Case) -> Recorded:
    rng = np.random.default_rng(case.seed)
    plant = either_bristle(random_plant(rng), rng)
    unknown = case.kind == KINDS[3]
    session = (*SESSION, "pauses") if case.pauses else SESSION
    truth = draw_effects(plant, () if unknown else case.what, rng, case.sensors, session)
    logs = record_session(
        truth.plant,
        case.sensors,
        case.seed,
        (*session, "validation"),
        temperature=case.temperature,
        hard=case.hard,
    )
    size = truth.size
    partly: tuple[str, ...] = ()
    depends_on: tuple[str, ...] = ()
    if unknown:
        size = (between(rng, 1.0, 10.0),)
        logs = disturb(logs, case.what[0], case.seed, size[0] * noise_of(case.sensors))
        partly, depends_on = DISTURBANCES[case.what[0]].partly, DISTURBANCES[case.what[0]].variables
    bends = max(plant.coulomb, plant.static) / plant.bristle_stiffness
    note: dict[str, str | float] = {"ramps": "steep" if case.hard else "gentle", "presliding": bends}
    known = Result(case, truth.effects, size, case.sensors, partly, depends_on, note)
    return Recorded(logs[:-1], logs[-1], plant.coulomb, known)


def _record_other(case: Case) -> Recorded:
    session = make("session", case.what, case.seed, composed=case.kind == KINDS[4])
    with tempfile.TemporaryDirectory() as folder:
        save(session, Path(folder))
        logs = [Log.read(Path(folder) / "session" / f"{run}.csv") for run in session.logs]
    truth = session.truth
    named = tuple(truth["effects"])
    if case.kind == KINDS[4]:  # what is too small to matter need not be named
        named = tuple(n for n in named if truth["distinct"][n] >= 0.05 * truth["coulomb"])
    rest = tuple(n for n in truth["effects"] if n not in named)
    sizes = named or ([truth["disturbance"]] if truth["disturbance"] else [])
    note = {key: truth[key] for key in ("axis", "friction_law", "rate_hz", "commands")}
    known = Result(
        case,
        named,
        tuple(truth["rms"][n] / truth["noise"] for n in sizes),
        truth["sensors"],
        (*truth["tolerated"], *rest),
        tuple(truth["depends_on"]),
        note,
    )
    return Recorded(logs[:-1], logs[-1], truth["coulomb"], known)
