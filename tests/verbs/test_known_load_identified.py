"""`identify --known-load`: in N m by a constant that a load told, whose error every parameter carries."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from idtool import Axis, InputError, Parameters
from idtool.verbs.identification import Identification
from idtool.verbs.identify import identify
from testbench.pendulums import Pendulum

from .support import ffc_id

SWING = Pendulum()
LOAD = {"mass_kg": SWING.mass, "lever_m": SWING.lever}
WRONG = Axis(torque_constant=1.5 * SWING.torque_constant, extra=LOAD)


@cache
def identified(*, known_load: bool) -> Identification:
    return identify([SWING.log(seconds=12.0, axis=WRONG)], friction="coulomb", known_load=known_load)


def test_the_constant_and_all_torques_are_put_right() -> None:
    found = identified(known_load=True).parameters
    assert found.axis.torque_constant == pytest.approx(SWING.torque_constant, rel=0.01)
    assert found.static["coulomb"].value == pytest.approx(SWING.coulomb, rel=0.05)
    assert found.axis.extra["torque_constant_stderr"] > 0.0
    without = identified(known_load=False).parameters
    assert without.static["coulomb"].value == pytest.approx(1.5 * SWING.coulomb, rel=0.05)


def test_every_torque_carries_the_error_of_the_constant() -> None:
    outcome = identified(known_load=True)
    assert outcome.calibration is not None
    constant = outcome.calibration.constant
    assert constant.stderr is not None
    relative = constant.stderr / constant.value
    for one in (outcome.parameters.gravity["sin"], outcome.parameters.static["viscous"]):
        assert one.stderr is not None
        assert one.stderr >= relative * abs(one.value)
    bare = replace(outcome, calibration=None).parameters.static["viscous"]
    carried = outcome.parameters.static["viscous"]
    assert bare.stderr is not None
    assert carried.stderr is not None
    assert carried.stderr > bare.stderr
    assert outcome.diagnosis["calibration"]["key"] == "torque_constant_nm_per_a"


def test_a_load_without_a_lever_or_a_mass_is_refused() -> None:
    log = SWING.log(seconds=4.0)
    no_lever = replace(log, axis=Axis(extra={"mass_kg": 0.5}))
    with pytest.raises(InputError, match="how far from the axis"):
        identify([no_lever], known_load=True)
    no_mass = replace(log, axis=Axis(extra={"lever_m": 0.1}))
    with pytest.raises(InputError, match="no mass"):
        identify([no_mass], known_load=True)
    nonsense = replace(log, axis=Axis(extra={"lever_m": -0.1, "mass_kg": 0.5}))
    with pytest.raises(InputError, match="above zero"):
        identify([nonsense], known_load=True)


def test_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "swing.csv"
    SWING.log(seconds=8.0, axis=WRONG).write(log)
    code, _, err = ffc_id(
        capsys, "identify", log, "--known-load", "--friction", "coulomb", "-o", tmp_path / "r", "--json"
    )
    assert code == 0, err
    assert "rms over windows of one second" in (tmp_path / "r" / "report.html").read_text()
    found = Parameters.read(tmp_path / "r" / "params.toml")
    assert found.axis.torque_constant == pytest.approx(SWING.torque_constant, rel=0.02)


def test_an_arm_under_two_known_loads_is_refused_and_not_taken_for_a_slide() -> None:
    """Back-EMF that is most of the effort hides the arm from a look at the torque; a known load tells it."""
    swing = replace(SWING, viscous=3.0)
    told = Axis(torque_constant=1.0, extra={"lever_m": swing.lever})
    logs = [swing.log(seed=k, payload=payload, axis=told) for k, payload in enumerate((0.5, 0.1))]
    with pytest.raises(InputError, match=r"payload_kg: it changes and this axis is an arm"):
        identify(logs, friction="coulomb", known_load=True)
