"""Sessions of the other axes: what the log holds is what the physics did, and the truth is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.log import Log
from testbench.other_plants.axes import Machine, draw
from testbench.other_plants.cases import cases
from testbench.other_plants.effects import DISTURBANCES, EFFECTS
from testbench.other_plants.evidence import LARGEST, STANDS_OUT, play, smallest, stands_out, torque
from testbench.other_plants.motion import TICK
from testbench.other_plants.physics import Plant
from testbench.other_plants.runs import Planner
from testbench.other_plants.sensors import noise_of, sample
from testbench.other_plants.session import make, save


def machines(seed: int, count: int) -> list[tuple[Machine, np.random.Generator]]:
    rng = np.random.default_rng(seed)
    return [(draw(rng), rng) for _ in range(count)]


def test_a_reading_is_the_torque_of_the_motion_and_noise() -> None:
    """The instants' torque by inverse dynamics against what the log would hold without reading noise."""
    for machine, rng in machines(3, 6):
        plant = Plant(machine.axis)
        planner = Planner(machine, rng)
        ((recorded,),) = play(machine, plant, [("sweep", planner.sweep()[1])], 5, noisy=True)
        times = np.arange(0.0, recorded.trial.seconds - 0.1, 1.0 / machine.rate)
        reading = sample(machine, recorded.motion[:, 2], times, recorded.rest, held=True)
        needed = sample(machine, torque(plant, recorded), times, 0, held=True)
        assert np.sqrt(np.mean((reading - needed) ** 2)) < 0.3 * noise_of(machine)


@pytest.mark.parametrize("grade", ["lab", "drive"])
def test_torque_and_motion_are_read_at_the_same_instant(grade: str) -> None:
    """A torque that a drive holds tick by tick stands for the middle of its ticks."""
    machine = replace(machines(3, 1)[0][0], grade=grade, rate=200)
    ticks = np.arange(8000) * TICK
    times = np.arange(0.1, 7.5, 0.005)
    held = np.sin(2.0 * np.pi * 3.0 * (ticks + 0.5 * TICK))  # what a tick holds is its middle's
    reading = sample(machine, held, times, 0, held=True)
    true = np.sin(2.0 * np.pi * 3.0 * times)
    slope = np.gradient(true, times)
    lag = float(np.sum((reading - true) * slope) / np.sum(slope**2))
    assert abs(lag) < 0.05 * TICK


@pytest.mark.parametrize("name", ["position_ripple", "transport_delay", "sudden wear"])
def test_a_session_has_what_was_asked_for_and_reads_as_logs(name: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    session = make("it", [name], 11)
    save(session, tmp_path)
    truth = session.truth
    assert truth["effects"] == ([name] if name in EFFECTS else [])
    assert truth["disturbance"] == (name if name in DISTURBANCES else None)
    for run in session.logs:
        log = Log.read(tmp_path / "it" / f"{run}.csv")
        assert np.all(np.diff(log.frame["time_s"]) > 0.0)
    low = max(truth["noise"], 0.05 * truth["coulomb"])
    assert low <= truth["rms"][name] <= 1.3 * max(1.5 * low, LARGEST * truth["noise"])
    assert truth["distinct"][name] >= STANDS_OUT * low


def test_the_same_seed_gives_the_same_session() -> None:
    assert make("a", [], 4) == make("a", [], 4)
    assert make("a", [], 4).logs != make("a", [], 5).logs


def test_soft_bristles_are_as_frequent_as_stiff_ones() -> None:
    shares = []
    for machine, _ in machines(1, 400):
        axis = machine.axis
        shares.append(max(axis.coulomb, axis.static) / axis.stiffness / axis.half_stroke > 0.05)
    assert 0.4 < np.mean(shares) < 0.6


def test_what_looks_like_the_base_model_does_not_stand_out() -> None:
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((500, 4))
    assert stands_out(columns, [], columns @ [1.0, 2.0, 0.0, -1.0]) < 1e-9
    other = rng.standard_normal(500)
    assert stands_out(columns, [other], 3.0 * other) < 1e-9
    assert stands_out(columns, [], other) == pytest.approx(1.0, abs=0.1)


def test_more_sessions_change_none() -> None:
    few, many = list(cases(1, 1, 3, 1, 1, seed=2)), list(cases(2, 2, 6, 2, 2, seed=2))
    assert set(few) <= set(many)
    assert len({case.name for case in many}) == len(many)
    assert {name for case in many for name in case.what} >= set(EFFECTS) | set(DISTURBANCES)


def test_an_effect_must_have_a_share_of_friction_even_where_readings_are_quiet() -> None:
    for machine, _ in machines(2, 20):
        assert smallest(machine) >= 0.05 * machine.axis.coulomb
        assert smallest(machine) >= noise_of(machine)
