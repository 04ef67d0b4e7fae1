"""A whole session on the virtual servo, through the real protocol: the plant's parameters come back."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool import ForceFreeController, Log, identify
from idtool.experiment.black_box import fault_path
from idtool.experiment.runner import run
from idtool.guiding.record import Record
from idtool.guiding.session import limits_of, teach
from idtool.rig.base import TrialSetup
from idtool.rig.faults import ServoShutdown
from idtool.rig.opening import read_plant
from testbench.bench import SHORT_SESSION

from .support import Bench, parameters_of, recipe


def session(folder: Path) -> list[Log]:
    """The logs of a short session. Not a fixture of the module: one that failed would not be made again."""
    with Bench(plant="bench") as on:
        for name, text in SHORT_SESSION.items():
            # the slow motions need no more than a hundred samples a second
            with on.rig(period=0.005 if name == "sine" else 0.01) as rig:
                run(recipe(text), rig, folder / f"{name}.csv", confirm=on.setup)
    return [Log.read(folder / f"{name}.csv") for name in SHORT_SESSION]


@pytest.mark.long
def test_the_logs_say_what_made_them_and_the_parameters_of_the_plant_come_back(tmp_path: Path) -> None:
    """Within 3 %, for coarse speeds and currents (docs/reliability.md), and three standard errors."""
    logs = session(tmp_path)
    for log in logs:
        assert log.header["rig"] == "DYNAMIXEL XH540-V150"
        assert log.axis.torque_constant == pytest.approx(2.667, abs=0.001)
        assert set(log.frame["supply_voltage_v"]) == {24.0}
        assert not log.incomplete
    found = identify(logs, seed=0)
    truth = read_plant("bench")
    assert found.diagnosis["verdict"] == "adequate"
    for part, table, unit in (
        (found.parameters.gravity, truth.gravity, {"base": "nm", "per_payload": "nm_per_kg"}),
        (
            found.parameters.static,
            truth.friction,
            {"coulomb": "nm", "static": "nm", "stribeck_velocity": "rad_s", "viscous": "nm_s_per_rad"},
        ),
        (
            found.parameters.dynamic,
            truth.friction,
            {"bristle_stiffness": "nm_per_rad", "bristle_damping": "nm_s_per_rad"},
        ),
    ):
        for name, suffix in unit.items():
            truly = table[f"{name}_{suffix}"]
            stderr = part[name].stderr
            assert stderr is not None
            assert stderr < 0.05 * truly, name
            assert abs(part[name].value - truly) < 0.03 * truly + 3.0 * stderr, name
            assert part[name].identified


def guide(on: Bench, log: Path, torque: float = 0.0) -> Record:
    """A hand pushes from 0.5 s to 1.5 s of three."""
    parameters = parameters_of("paper")

    def push(share: float) -> None:
        on.servo.axis.hand_nm = torque if 0.5 <= 3.0 * share < 1.5 else 0.0

    with on.rig() as rig:
        # a gap of a busy computer is not what is tried here
        limits = replace(limits_of(rig), gap_periods=50.0)
        controller = ForceFreeController(parameters, limits=limits)
        setup = TrialSetup(tilt_alpha_rad=math.pi / 2)
        return teach(parameters, controller, rig, setup, duration_s=3.0, log=log, progress=push).record


@pytest.mark.parametrize("torque", [0.12, -0.12])
def test_a_hand_guides_the_servo(tmp_path: Path, torque: float) -> None:
    """The axis goes the hand's way, and stands when it lets go."""
    with Bench(plant="paper") as on:
        record = guide(on, tmp_path / "run.csv", torque)
    at = np.interp([0.5, 1.0, 1.4, 2.0, 2.9], record.time, record.position)
    # the paper's law: speed = K_c times the torque of the hand
    assert (at[2] - at[1]) / 0.4 == pytest.approx(1.68 * torque, rel=0.15)
    assert abs(at[0] - record.position[0]) < 0.01
    assert abs(at[4] - at[3]) < 0.01
    assert Log.read(tmp_path / "run.csv").experiment == "teach"


def test_a_fault_while_guiding_stops_and_is_kept(tmp_path: Path) -> None:
    log = tmp_path / "run.csv"
    with Bench("overload@1", plant="paper") as on:
        with pytest.raises(ServoShutdown, match=r"overload.* the last second at full rate is in") as caught:
            guide(on, log)
        assert fault_path(log).name in str(caught.value)
        assert on.stands(0.3)
    assert 50 < len(Log.read(log).frame) < 150  # it began half a second after the torque
    assert Log.read(fault_path(log)).header["fault"] == "ServoShutdown"
