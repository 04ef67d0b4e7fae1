"""The search for the motion: derivatives beside it, a soft loss, and one of two starts that end alike."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import optimize

from idtool.model.motion import Array
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.signals import record
from idtool.simulation import search
from idtool.simulation.coordinates import start
from idtool.simulation.search import MotionSearch
from idtool.simulation.stage import Stage, measured_position
from idtool.simulation.starts import regress, scales_of
from testbench.pendulums import Pendulum

SWING = Pendulum()
LATE = EffectEntry("transport_delay", {"delay": Parameter(0.0123)})
BY_LOAD = EffectEntry("load_dependent_friction", {"mu": Parameter(0.1), "doubling_load": Parameter(0.4)})


def searched() -> MotionSearch:
    log = SWING.log(seconds=4.0)
    recording = record([replace(log, axis=SWING.parameters().axis)], every_row=True)
    return MotionSearch([log], recording, measured_position([log], recording), None)


def test_one_payload_tells_no_gravity_per_kilogram() -> None:
    """What is in proportion to it is in the base; both would be found, and cancel."""
    log = SWING.log(seconds=4.0)
    lying = log.frame["position_rad"] * 0.1, 0.2 * np.sign(np.sin(7.0 * log.frame["time_s"]))
    slide = log.frame.assign(payload_kg=0.2, position_rad=lying[0], current_a=lying[1] + 0.1)
    found = regress(record([replace(log, axis=SWING.parameters().axis, rows=slide)], every_row=True))
    assert "per_payload" not in found.gravity


def worst(one: MotionSearch, file: Parameters) -> Array:
    """How far derivatives are from differences, over the largest, shape (coordinates,)."""
    coordinates = one.coordinates(file, scales_of(one.recording))
    x = start(file, coordinates)
    along = one.residual(file, coordinates, search._stepped(x))[1]
    step = 1e-6 * np.eye(len(x))
    found = [
        (
            one.residual(file, coordinates, (x + h)[None])[0]
            - one.residual(file, coordinates, (x - h)[None])[0]
        )
        for h in step
    ]
    found_along = np.column_stack(found) / 2e-6
    return np.asarray(np.abs(along - found_along).max(axis=0) / np.abs(found_along).max(axis=0))


def test_derivatives_of_every_number_that_is_varied() -> None:
    """With friction of the load, and read late within its window."""
    file = SWING.parameters()
    static = {**file.static, "static": Parameter(0.08), "stribeck_velocity": Parameter(0.5)}
    file = replace(file, static=static).with_effect(BY_LOAD).with_effect(LATE)
    one = searched()
    assert np.all(worst(one, file) < 1e-3)
    simulated = one.evaluations
    one.residual(file, one.coordinates(file, scales_of(one.recording)), search._stepped(np.zeros(9)))
    assert one.evaluations == simulated + 1


def test_rows_whose_derivatives_make_no_sense_have_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motion that would be elsewhere altogether after the smallest step, or that is lost."""
    one, file = searched(), SWING.parameters()
    plain = Stage.run_along

    def wild(*given: Any) -> Array:
        path, along = plain(*given), given[-1]
        if along.shape[1]:
            along[3, 1], along[4, 0], along[5, 2], path[6] = np.inf, np.nan, -1e9, np.nan
        return path

    monkeypatch.setattr(Stage, "run_along", wild)
    coordinates = one.coordinates(file, scales_of(one.recording))
    off, along = one.residual(file, coordinates, search._stepped(start(file, coordinates)))
    assert np.all(np.isfinite(off))
    assert np.all(along[3:7] == 0.0)
    assert np.all(along[7:20].any(axis=1))


def test_the_loss_is_soft() -> None:
    """As SciPy's soft_l1, of which the cost is half the sum."""
    errors = np.linspace(-9.0, 9.0, 19)
    whole = optimize.least_squares(lambda x: errors + x, [0.0], loss="soft_l1", max_nfev=1).cost
    soft = search._soft(errors)
    assert 0.5 * soft @ soft == pytest.approx(whole, rel=1e-12)
    step = 1e-6
    slope = (search._soft(errors + step) - search._soft(errors - step)) / (2.0 * step)
    np.testing.assert_allclose(search._soft_slope(errors), slope, rtol=1e-8)
    # the second derivative of sqrt(1 + r^2), which is half the loss
    curvature = (1.0 + errors**2) ** -1.5
    np.testing.assert_allclose((search._curvature(soft) * search._soft_slope(errors)) ** 2, curvature)


def test_of_two_starts_that_end_alike_one_is_followed() -> None:
    one = searched()
    assert one.windows == 4
    file = SWING.parameters()
    found = one.fit(file, one.coordinates(file, scales_of(one.recording)), 1)
    worse = [replace(found, cost=share * found.cost) for share in (1.6, 1.2, 1.0, 1.5)]
    assert one.apart(worse) == [worse[2], worse[3]]
    assert one.apart(worse[:1]) == worse[:1]
