"""The benchmarks still run; what they measure is not judged here."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks import commands, dynamic, files, hard, kernel, scaling, session, sessions, starts, startup
from benchmarks.compiled import FAST, PLAIN, Library, compiler
from benchmarks.table import Section, goals_table
from idtool.fit.model import JointModel
from idtool.signals import record

_SINE, _SWEEP = (2, 3), (4, 5)
PARTS: dict[str, Callable[[], Section]] = {
    "kernel": lambda: kernel.measure(_SINE, rounds=1),
    "dynamic": lambda: dynamic.measure(
        _SINE, _SWEEP, population=4, generations=1, most=1, rounds=1, seeds=(1,)
    ),
    "scaling": lambda: scaling.measure((1_000, 2_000), apart=False),
    "startup": lambda: startup.measure(rounds=1),
    "commands": lambda: commands.measure(1, ("ffc-id --help", "ffc-id fit-gravity")),
    "files": lambda: files.measure(rounds=1),
    "session": lambda: session.measure((0, 15), _SWEEP[:1], _SINE[:1], rounds=1),
    "hard": lambda: hard.measure((3_000,)),
}


@pytest.mark.long
@pytest.mark.parametrize("name", PARTS)
def test_every_part_makes_its_table(name: str) -> None:
    section = PARTS[name]()
    for part in (section, *section.more):
        assert part.rows
        assert all(len(row) == len(part.head) for row in part.rows)
    text = section.markdown() + goals_table([section]).markdown()
    assert text.count("|---") >= 2
    assert "nan" not in text


def test_the_loop_in_c_is_ours(tmp_path: Path) -> None:
    if compiler() is None:
        pytest.skip("no C compiler (cc, or what CC names)")
    rng = np.random.default_rng(2)
    rows = 2000
    first = np.zeros(rows, dtype=bool)
    first[[0, 700]] = True
    arrays = (rng.normal(size=rows), np.full(rows, 0.005), rng.uniform(0.5, 500.0, rows), first, np.ones(2))
    columns = rng.normal(size=(3, rows))
    ours = kernel.tangents(arrays, columns)
    library = Library(tmp_path, PLAIN)
    for mine, theirs in zip(ours, library.propagate_tangents(*arrays, columns), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-13)
    for split in (False, True):
        for mine, theirs in zip(ours, library.propagate(*arrays, split=split), strict=False):
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-13)


def test_fast_arithmetic_stays_in_its_library(tmp_path: Path) -> None:
    if compiler() is None:
        pytest.skip("no C compiler (cc, or what CC names)")
    Library(tmp_path, FAST)
    assert np.float64(5e-324) * np.float64(2.0) > 0.0


def test_a_bristle_taken_to_be_straight_is_held_there() -> None:
    recording = record([sessions.log_of("sine", trials=_SINE[:1])])
    spec = starts.spec_of(recording)
    free, held = (kind.build(recording, spec) for kind in (JointModel, starts.Unbent))
    x = free.coordinates({**dict.fromkeys(free.names, 0.0), **sessions.truth()})
    bent, straight = (np.abs(model.evaluate(x, model.presliding_scale(x)).start) for model in (free, held))
    assert straight.max() < 1e-6 * bent.max()


def test_the_controller_s_step_is_measured_with_every_effect() -> None:
    from benchmarks import control
    from idtool.effects import registry

    assert {entry.name for entry in control.whole_library()} == set(registry.names())
    section = control.measure(rounds=1, count=150)
    assert [row[0] for row in section.rows] == [
        f"mode {mode}, {name}"
        for mode in ("paper", "light")
        for name in ("base model", f"all {len(registry.names())} effects")
    ]
    assert section.goals[0].met is not None
