"""The error of the simulated position stands beside that of the torque."""

from __future__ import annotations

from dataclasses import replace

from idtool.compare.comparison import compare
from idtool.compare.position_errors import position_errors
from idtool.parameters import Parameter
from testbench.pendulums import Pendulum

SWING = Pendulum()
TRUTH = SWING.parameters()


def test_a_comparison_tells_whose_position_is_nearer() -> None:
    log = SWING.log(seconds=8.0, noise=0.0)
    good = TRUTH
    bad = replace(good, static={**good.static, "viscous": Parameter(2.0 * SWING.viscous)})
    found = compare(good, bad, [log])
    assert found.positions is not None
    one, other = found.positions
    assert one["unit"] == "mrad"
    assert 5.0 * float(one["rms_1s_windows"]) < float(other["rms_1s_windows"])
    assert found.to_document()["position"]["b"] == other
    assert compare(good, bad).to_document()["position"] is None


def test_there_is_none_where_nothing_can_be_simulated() -> None:
    log = SWING.log(seconds=8.0, noise=0.0)
    assert position_errors([], TRUTH) is None
    assert position_errors([log], replace(TRUTH, effects=())) is None
    assert position_errors([replace(log, rows=log.frame.drop(columns="position_rad"))], TRUTH) is None
