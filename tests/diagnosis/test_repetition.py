"""A frequency at which the motion itself repeats is told from one that has no regard for it."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.diagnosis.repetition import beats_with_motion
from idtool.model.motion import Motion

PERIOD_S = 6.5


def motion(trials: int = 1, *, repeats: bool = True) -> Motion:
    """Trials of a Fourier series, five periods each; or of one speed that slowly rises."""
    t = 0.01 * np.arange(int(5 * PERIOD_S / 0.01))
    series = sum(np.cos(2.0 * np.pi * k * t / PERIOD_S + k**2) / k for k in (1, 2, 3, 5))
    w = series if repeats else 0.1 + 0.01 * t
    q = 0.01 * np.cumsum(w)
    return Motion(
        np.tile(t, trials),
        np.repeat(np.arange(trials), len(t)),
        np.tile(q, trials),
        np.tile(w, trials),
        np.tile(np.gradient(w, 0.01), trials),
    )


@pytest.mark.parametrize("multiple", [1, 4, 13, 40])
def test_a_multiple_of_the_frequency_of_the_motion(multiple: int) -> None:
    assert beats_with_motion(motion(), multiple / PERIOD_S)


@pytest.mark.parametrize("beats", [4.5, 12.9, 13.2])
def test_what_lies_between_them(beats: float) -> None:
    assert not beats_with_motion(motion(), beats / PERIOD_S)


def test_a_motion_that_does_not_repeat_has_no_frequency() -> None:
    assert not any(beats_with_motion(motion(repeats=False), k / PERIOD_S) for k in (1, 4, 13))


def test_most_rows_decide() -> None:
    other = motion(repeats=False)
    one = motion()
    both = Motion(
        *(
            np.concatenate([getattr(one, name)] + 2 * [getattr(other, name)])
            for name in ("time", "trial", "position", "velocity", "acceleration")
        )
    )
    both.trial[:] = np.repeat(np.arange(3), len(one))
    assert not beats_with_motion(both, 13 / PERIOD_S)
