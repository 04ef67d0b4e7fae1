"""A bristle that bends for what the model lacks: an arm whose gears take friction of the load, read late."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log
from idtool.model.motion import Array
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from idtool.verbs.identification import Identification
from idtool.verbs.identify import identify

_STEP_S = 0.014
#: Torque of the load that is level, N m; friction over it.
_WEIGHT, _SHARE = 4.0, 0.4
_LATE_S = 0.02


def _goals(gain: float, time: Array) -> list[Array]:
    return [
        1.25 * gain * np.sin(2.0 * np.pi * 0.35 * time) * np.sin(2.0 * np.pi * 0.11 * time),
        0.45 * gain * (1.0 + np.tanh(1.2 * (time - 2.5))),
        0.4 * gain * np.sin(2.0 * np.pi * 0.9 * time),
    ]


def _log(position: Array, time: Array, rng: np.random.Generator, late: float = _LATE_S) -> Log:
    velocity = np.gradient(position, _STEP_S)
    load = _WEIGHT * np.sin(position)
    friction = (0.05 + _SHARE * np.abs(load)) * np.tanh(velocity / 0.02) + 0.4 * velocity
    torque = 0.045 * np.gradient(velocity, _STEP_S) + load + friction
    noise = rng.normal(size=(2, len(time)))
    torque = np.interp(time - late, time, torque) + 0.02 * noise[0]
    read = {"time_s": time, "position_rad": position + 2e-4 * noise[1], "torque_nm": torque}
    return Log(pd.DataFrame({"trial": 0, **read}), Axis("rotary"))


@pytest.fixture(scope="module")
def logs() -> list[Log]:
    rng, time = np.random.default_rng(2), np.arange(0.0, 6.0, _STEP_S)
    return [_log(position, time, rng) for gain in (0.4, 0.8) for position in _goals(gain, time)]


@pytest.fixture(scope="module")
def found(logs: list[Log]) -> Identification:
    return identify(logs)


def test_the_last_base_model_has_no_presliding_and_says_so(logs: list[Log]) -> None:
    base = base_of_rows(record(logs), "lugre", "auto")
    laws = [fit.model.spec.friction == "lugre" for fit in base.fits]
    assert laws == [True] * (len(laws) - 1) + [False]
    assert base.stepped_down[-1][0][0].startswith("no presliding is modelled")
    # the static curve, asked for, has no other beside it
    static = base_of_rows(record(logs), "stribeck", "auto").fits
    assert all(fit.model.spec.friction != "lugre" for fit in static)


def test_effects_are_looked_for_without_presliding_too(found: Identification) -> None:
    """Beside LuGre friction along the stroke is named, 22 % of the torque, which is not there."""
    named = {effect["name"] for effect in found.diagnosis["effects"]}
    assert named == {"inertia", "load_dependent_friction", "transport_delay"}
    entry = found.parameters.effect("load_dependent_friction")
    assert entry is not None
    assert entry.parameters["mu"].value == pytest.approx(_SHARE, rel=0.05)
    assert found.parameters.gravity["sin"].value == pytest.approx(_WEIGHT, rel=0.02)


def test_turns_tell_drive_and_backdrive_from_another_gravity(found: Identification) -> None:
    """... and no row shows them here."""
    why = {one["name"]: one["why"] for one in found.diagnosis["candidates"]}
    assert "only turns tell it from friction under load" in why["drive_backdrive"]


def test_readings_of_another_computer_may_be_very_late() -> None:
    """One effect alone does not make up for a bristle that bends for two."""
    rng, time = np.random.default_rng(2), np.arange(0.0, 6.0, _STEP_S)
    logs = [_log(position, time, rng, late=0.07) for gain in (0.4, 0.8) for position in _goals(gain, time)]
    found = identify(logs)
    named = {effect["name"] for effect in found.diagnosis["effects"]}
    assert named == {"inertia", "load_dependent_friction", "transport_delay"}
    entry = found.parameters.effect("transport_delay")
    assert entry is not None
    assert entry.parameters["delay"].value == pytest.approx(-0.07, abs=_STEP_S)
