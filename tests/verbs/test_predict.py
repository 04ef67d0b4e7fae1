"""Prediction from a file: what its effects cannot do without is said by name."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log, Parameters
from idtool.errors import InputError
from idtool.parameters import EffectEntry, Parameter
from idtool.verbs.predict import predict


@pytest.fixture
def log() -> Log:
    """A torque, and neither a current nor a temperature."""
    time = 0.01 * np.arange(600)
    rows = {
        "trial": 0,
        "time_s": time,
        "position_rad": np.sin(time),
        "torque_nm": 0.2 * np.sign(np.cos(time)),
    }
    return Log(pd.DataFrame(rows), Axis("rotary"))


def file(name: str, **values: float) -> Parameters:
    static = {"coulomb": 0.2, "static": 0.2, "stribeck_velocity": 0.1, "viscous": 0.01}
    plain = Parameters(Axis("rotary"), static={key: Parameter(value) for key, value in static.items()})
    return plain.with_effect(EffectEntry(name, {key: Parameter(value) for key, value in values.items()}))


@pytest.mark.parametrize(
    ("effect", "values", "lacks"),
    [
        ("torque_constant_saturation", {"kappa": 0.1}, "torque constant"),
        ("thermal_drift", {"rate": 0.01, "reference": 25.0}, "temperature"),
    ],
    ids=["by the current", "by the temperature"],
)
def test_what_an_effect_cannot_do_without_is_named(
    log: Log, effect: str, values: dict[str, float], lacks: str
) -> None:
    with pytest.raises(InputError, match=f"{effect} needs {lacks}, which was not logged"):
        predict([log], file(effect, **values))


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("torque_constant_saturation", {"loss": 0.1}),
        ("thermal_drift", {"warm_up": 0.2, "time_constant": 3.0}),
    ],
    ids=["by the torque", "by the clock"],
)
def test_the_form_that_does_without_is_taken(log: Log, effect: str, values: dict[str, float]) -> None:
    plain, acting = (
        predict([log], one).frame.iloc[:, -1].to_numpy()
        for one in (file("torque_offset", offset=0.0), file(effect, **values))
    )
    assert np.all(np.isfinite(acting))
    assert np.max(np.abs(acting - plain)) > 0.002


def test_noise_of_single_rows_is_told_from_what_a_fit_compares(log: Log) -> None:
    """Seen where stamps jitter: 22 % of the torque over all rows, 6 % below the 12 Hz of the fit."""
    known = file("torque_offset", offset=0.0)

    def said(log: Log) -> list[str]:
        return [note for note in predict([log], known).notes if "noise of single rows" in note]

    torque = log.frame["torque_nm"]
    noisy = torque + 0.2 * np.random.default_rng(0).choice([-1.0, 1.0], len(torque))
    (note,) = said(replace(log, rows=log.frame.assign(torque_nm=noisy)))
    slow, every = (float(number) for number in re.findall(r"([\d.]+) %", note))
    assert every == pytest.approx(100.0 / np.sqrt(2.0), rel=0.1)
    assert slow < 0.7 * every
    # an error that is there all the time is none
    assert not said(replace(log, rows=log.frame.assign(torque_nm=1.5 * torque)))
