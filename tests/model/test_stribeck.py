"""The static curve and its slopes."""

from __future__ import annotations

import numpy as np

from idtool.model.stribeck import level, steady, steady_slopes


def test_slopes_are_those_of_the_curve() -> None:
    w = np.array([-0.7, -0.05, -1e-3, 1e-3, 0.02, 0.09, 0.4])
    x, step = np.array([0.07, 0.03, 0.09, 0.155]), 1e-6
    slopes = steady_slopes(w, *x[:3])
    for k, direction in enumerate(np.eye(4)):
        by_difference = (steady(w, *(x + step * direction)) - steady(w, *(x - step * direction))) / (2 * step)
        np.testing.assert_allclose(slopes[:, k], by_difference, atol=1e-8)


def test_a_level_leaves_its_velocities_alone() -> None:
    w = np.array([-0.2, 0.0, 0.1])
    of_all = level(w, 0.07, 0.03, 0.09)
    assert w.tolist() == [-0.2, 0.0, 0.1]
    assert of_all.tolist() == [level(one, 0.07, 0.03, 0.09) for one in w.tolist()]
