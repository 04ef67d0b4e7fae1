"""Fewer rows for a search: what passes the filter stays, and the noise is told as it then is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter

from idtool.signals import record
from idtool.signals.recording import Recording
from idtool.signals.thin import _averaged, _local_cubic, thin
from testbench.plants import Plant, record_session

PAPER = Plant(0.070, 0.030, 0.090, 0.155, 0.051, 0.297, 0.006, 0.2295, 0.4457)


def recording() -> Recording:
    return record(record_session(PAPER, "lab", 3, ("sine",)))


def test_what_passes_the_filter_stays() -> None:
    whole = recording()
    few = thin(whole)
    every = len(whole.motion) / len(few.motion)
    assert every > 1.9
    # five rows a period of the bandwidth, and no row more than whole rows to leave out make of it
    assert 5.0 <= 1.0 / (few.motion.period * whole.filter.bandwidth_hz) < 5.0 * (every + 1.0) / every
    assert few.filter.bandwidth_hz == pytest.approx(whole.filter.bandwidth_hz, rel=0.2)  # whole taps
    assert 0.5 * whole.noise / np.sqrt(every) < few.noise < whole.noise
    # the filtered torque at the same instants, within what the noise between them allows
    first = whole.motion.trial[whole.row] == 0
    again = few.motion.trial[few.row] == 0
    torque = few.filtered(few.torque)[again]
    expected = np.interp(
        few.motion.time[few.row][again],
        whole.motion.time[whole.row][first],
        whole.filtered(whole.torque)[first],
    )
    assert np.sqrt(np.mean((torque - expected) ** 2)) < 0.02 * np.std(expected) + whole.noise


@pytest.mark.parametrize("half", [2, 3, 6])
def test_the_local_cubic_is_that_of_savitzky_and_golay(half: int) -> None:
    values = np.random.default_rng(half).standard_normal(200)
    averaged = _averaged(values, _local_cubic(half))
    np.testing.assert_allclose(averaged, savgol_filter(values, 2 * half + 1, 3), atol=1e-12)


def test_nothing_to_thin() -> None:
    few = thin(recording())
    assert thin(few) is few


def test_noise_is_told_as_it_passes_the_filter() -> None:
    whole = recording()
    few = []
    for seed in range(20):
        noise = 0.01 * np.random.default_rng(seed).standard_normal(len(whole.motion))
        few.append(thin(replace(whole, torque=noise, noise=0.01)))
    filtered = np.concatenate([one.filtered(one.torque) for one in few])
    operator = few[0].operator
    gain = np.sqrt(operator.overlap(0) / len(operator))
    assert np.std(filtered) == pytest.approx(few[0].noise * gain, rel=0.03)
