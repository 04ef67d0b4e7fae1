"""The basis of columns is that of a singular value decomposition, however the columns lean."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.fit.basis import beyond, orthonormal


def leaning(angle: float) -> np.ndarray:
    """Columns of very different lengths, two of them `angle` apart, one all zero."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(400, 5)) * [1e-8, 1.0, 1e6, 1.0, 0.0]
    columns[:, 3] = columns[:, 1] + angle * columns[:, 3]
    return columns


@pytest.mark.parametrize(
    ("angle", "rank", "off"), [(1.0, 4, 1e-13), (1e-3, 4, 2e-9), (1e-4, 4, 1e-13), (1e-8, 3, 1e-13)]
)
def test_orthonormal_as_by_singular_values(angle: float, rank: int, off: float) -> None:
    columns = leaning(angle)
    basis = orthonormal(columns)
    assert basis.shape == (400, rank)
    np.testing.assert_allclose(basis.T @ basis, np.eye(rank), atol=off)
    u = np.linalg.svd(columns[:, :4] / np.linalg.norm(columns[:, :4], axis=0), full_matrices=False)[0]
    u = u[:, :rank]
    np.testing.assert_allclose(basis @ basis.T, u @ u.T, atol=1e-10)


def test_nothing_spans_nothing() -> None:
    assert orthonormal(np.zeros((7, 2))).shape == (7, 0)
    assert orthonormal(np.zeros((7, 0))).shape == (7, 0)


def test_beyond_is_what_is_new() -> None:
    rng = np.random.default_rng(4)
    known = orthonormal(rng.normal(size=(300, 3)))
    seen, fresh = known @ rng.normal(size=(3, 2)), rng.normal(size=(300, 2))
    basis = beyond(known, np.hstack([seen, fresh]))
    assert basis.shape == (300, 2)
    np.testing.assert_allclose(known.T @ basis, 0.0, atol=1e-13)
    both = np.hstack([known, basis])
    np.testing.assert_allclose(fresh - both @ (both.T @ fresh), 0.0, atol=1e-12)


def test_rounding_does_not_turn_the_basis() -> None:
    """Orthogonal columns of one length have any axes as eigenvectors."""
    columns = np.linalg.qr(np.random.default_rng(5).normal(size=(500, 6)))[0]
    nearly = columns * (1.0 + 1e-15 * np.random.default_rng(6).normal(size=columns.shape))
    np.testing.assert_allclose(orthonormal(nearly), orthonormal(columns), atol=1e-12)
    np.testing.assert_allclose(orthonormal(columns), columns, atol=1e-12)
