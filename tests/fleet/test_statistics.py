"""Spread, outliers and drift: what is found, and how seldom something is found that is not there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from idtool.diagnosis.holm import holm
from idtool.fleet import statistics
from idtool.fleet.summary import SessionRow, summarise
from idtool.parameters import Parameter, Parameters

NAN = float("nan")


def unknown(count: int) -> np.ndarray:
    return np.full(count, NAN)


@pytest.mark.parametrize("count", [2, 5, 9, 10, 40])
def test_spread_is_the_standard_deviation_of_normal_values(count: int) -> None:
    rng = np.random.default_rng(count)
    found = [statistics.spread(rng.normal(3.0, 2.0, count)) for _ in range(4000)]
    assert np.mean(found) == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("count", [5, 8, 30])
def test_normal_units_hardly_ever_stand_out(count: int) -> None:
    rng = np.random.default_rng(7)
    alarms = np.mean(
        [statistics.outliers(rng.standard_normal(count), unknown(count)).any() for _ in range(3000)]
    )
    assert 0.004 < alarms < 0.02


@pytest.mark.parametrize("sizes", [(3, 3, 3, 3, 3), (3,) * 25, (6, 4, 3, 9)])
def test_normal_sessions_hardly_ever_stand_out(sizes: tuple[int, ...]) -> None:
    rng = np.random.default_rng(7)
    alarms = np.mean(
        [
            any(mask.any() for mask in statistics.odd_sessions([rng.standard_normal(n) for n in sizes]))
            for _ in range(1000)
        ]
    )
    assert 0.003 < alarms < 0.02


def test_what_does_stand_out_is_found_and_hides_nothing() -> None:
    rng = np.random.default_rng(1)
    values = 1.0 + 0.01 * rng.standard_normal(20)
    values[[3, 11]] = 1.3, 0.7
    assert np.flatnonzero(statistics.outliers(values, unknown(20))).tolist() == [3, 11]
    blocks = [1.0 + k + 0.01 * rng.standard_normal(4) for k in range(6)]
    blocks[2][1] += 0.2
    masks = statistics.odd_sessions(blocks)
    assert [np.flatnonzero(mask).tolist() for mask in masks] == [[], [], [1], [], [], []]


def test_too_few_say_nothing() -> None:
    assert not statistics.outliers(np.array([1.0, 1.0, 1.0, 9.0]), unknown(4)).any()
    assert not any(mask.any() for mask in statistics.odd_sessions([np.array([1.0, 1.0, 9.0])]))
    assert statistics.odd_sessions([]) == []
    assert np.isnan(statistics.spread(np.array([1.0])))


def test_values_lie_no_closer_together_than_their_errors() -> None:
    values = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.1])
    assert not statistics.outliers(values, np.full(7, 0.05)).any()
    assert statistics.outliers(values, np.full(7, 1e-4)).tolist() == [False] * 6 + [True]
    assert not statistics.outliers(values, unknown(7)).any()


@given(
    st.lists(st.floats(-1e3, 1e3).map(lambda x: round(x, 3)), min_size=5, max_size=12),
    st.floats(0.1, 10),
    st.floats(-10, 10),
)
def test_outliers_do_not_depend_on_the_unit(values: list[float], scale: float, shift: float) -> None:
    one = np.array(values)
    far = np.abs(one - np.median(one)) / (statistics.spread(one) or 1.0)
    if np.abs(far - statistics.limit(len(one))).min() > 1e-6:
        other = statistics.outliers(scale * one + shift, unknown(len(one)))
        if statistics.spread(one) > 1e-9:
            assert other.tolist() == statistics.outliers(one, unknown(len(one))).tolist()


def test_drift_is_found_whatever_the_levels_of_the_units() -> None:
    rng = np.random.default_rng(2)
    days = np.array([0.0, 100.0, 200.0, 300.0])
    blocks = [(days, 5.0 * k + 0.02 * days / 365.25 + 0.001 * rng.standard_normal(4)) for k in range(4)]
    found = statistics.drift(blocks)
    assert found
    assert found.per_year == pytest.approx(0.02, rel=0.1)
    assert found.p_value < 1e-3
    assert found.sessions == 16


def test_no_drift_is_seldom_called_one() -> None:
    rng = np.random.default_rng(3)
    days = np.array([0.0, 90.0, 180.0])
    p_values = []
    for _ in range(2000):
        found = statistics.drift([(days, rng.standard_normal(3)) for _ in range(6)])
        assert found
        p_values.append(found.p_value)
    assert 0.01 < np.mean(np.array(p_values) < 0.05) < 0.06


def test_drift_needs_two_days_of_a_unit() -> None:
    assert statistics.drift([]) is None
    assert statistics.drift([(np.array([5.0, 5.0]), np.array([1.0, 2.0]))]) is None
    short = statistics.drift([(np.array([0.0, 1.0]), np.array([1.0, 2.0]))])
    assert short
    assert short.p_value > 0.3


@given(st.dictionaries(st.text(max_size=3), st.floats(0, 1), max_size=8))
def test_holm_never_lowers_a_p_value_and_keeps_their_order(p_values: dict[str, float]) -> None:
    corrected = holm(p_values)
    assert set(corrected) == set(p_values)
    for name, p in p_values.items():
        assert p <= corrected[name] <= min(1.0, p * len(p_values))
        for other, q in p_values.items():
            if p < q:
                assert corrected[name] <= corrected[other]


def test_what_data_do_not_determine_does_not_count(tmp_path: Path) -> None:
    folder = tmp_path
    rows = []
    for k in range(6):
        name = f"A{k}"
        (folder / name).mkdir()
        static = {
            "coulomb": Parameter(0.08 + 0.001 * k, 0.0005),
            "static": Parameter(9.0, identified=False),
            "stribeck_velocity": Parameter(9.0, at_bound=True),
            "viscous": Parameter(0.1, 0.001, at_bound=k == 5),
        }
        Parameters(static=static).write(folder / name / "params.toml")
        rows.append(SessionRow(name, unit=name))
    rows.append(SessionRow("bad", error="bad: no."))
    fleet = summarise(rows, folder)
    assert {line.key: line.units for line in fleet.parameters} == {
        "coulomb_nm": 6,
        "viscous_nm_s_per_rad": 5,
    }
    coulomb = fleet.parameters[0]
    assert (coulomb.lowest, coulomb.highest, coulomb.median) == pytest.approx((0.08, 0.085, 0.0825))
    assert coulomb.repeatability is None
    assert coulomb.drift is None
