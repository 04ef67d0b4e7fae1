"""Sparse rows against the matrix written out."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.signals.sparse_rows import SparseRows


def rows_of(matrix: np.ndarray) -> SparseRows:
    row, column = np.nonzero(matrix)
    pointer = np.searchsorted(row, np.arange(len(matrix) + 1))
    return SparseRows.of(matrix[row, column], column, pointer, matrix.shape[1])


@pytest.fixture
def matrix() -> np.ndarray:
    rng = np.random.default_rng(2)
    matrix = rng.normal(size=(9, 12)) * (rng.random((9, 12)) < 0.4)
    matrix[4] = 0.0  # a row of none
    return matrix


def test_products(matrix: np.ndarray) -> None:
    sparse, rng = rows_of(matrix), np.random.default_rng(3)
    assert len(sparse) == 9
    for values in (rng.normal(size=12), rng.normal(size=(12, 3)), rng.normal(size=(3, 12)).T, np.arange(12)):
        np.testing.assert_allclose(sparse @ values, matrix @ values, rtol=1e-13, atol=1e-15)


def test_what_is_made_of_it(matrix: np.ndarray) -> None:
    sparse, unit = rows_of(matrix), np.eye(12)
    np.testing.assert_array_equal(sparse.every(2) @ unit, matrix[::2])
    weight = np.arange(9.0)
    np.testing.assert_allclose(sparse.weighted(weight) @ unit, weight[:, None] * matrix, rtol=1e-13)
    other = np.random.default_rng(4).normal(size=(12, 12)) * np.tri(12)
    both = sparse.after(rows_of(other))
    np.testing.assert_allclose(both @ unit, matrix @ other, rtol=1e-13, atol=1e-14)
    for k in range(len(both)):
        assert np.all(np.diff(both.indices[both.pointer[k] : both.pointer[k + 1]]) > 0)


@pytest.mark.parametrize("lag", [0, 1, 3, 8])
def test_overlap(matrix: np.ndarray, lag: int) -> None:
    expected = np.sum(matrix[: len(matrix) - lag] * matrix[lag:])
    assert rows_of(matrix).overlap(lag) == pytest.approx(expected, rel=1e-12, abs=1e-14)
