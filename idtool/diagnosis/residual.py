"""What the residual depends on: tests that respect autocorrelation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from idtool.diagnosis.evidence import Background
from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit
from idtool.model.motion import Array

#: A residual depends on a variable if a smooth function of it takes away this share of the variance ...
DEPENDS = 0.10
#: ... and chance would do so less often than this.
_CHANCE = 1e-4
_SMOOTH = 8


@dataclass(frozen=True)
class ResidualTest:
    """One variable.

    Attributes:
        variable: "position", "velocity", ...
        share: share of the residual's variance that a smooth function of the variable explains.
        p_value: of no relation; autocorrelated rows count as the fewer they are worth.
    """

    variable: str
    share: float
    p_value: float

    @property
    def depends(self) -> bool:
        """Whether the relation is both real and large enough to matter."""
        return self.share > DEPENDS and self.p_value < _CHANCE


def test_residual(fit: JointFit) -> list[ResidualTest]:
    """Test the residual of a fit against everything that was measured."""
    background = Background.of(fit)
    recording = fit.model.recording
    motion, rows = recording.motion, recording.row
    tests = []
    variables: dict[str, Array | None] = {
        "position": motion.position,
        "velocity": motion.velocity,
        "acceleration": motion.acceleration,
        "load": motion.load,
        "temperature": motion.temperature,
        "time": motion.time,
    }
    for name, values in variables.items():
        if values is not None and np.ptp(values[rows]) > 1e-9 * (1.0 + np.max(np.abs(values))):
            smooth = _smooth_test(background, name, values[rows])
            # over the position a residual can also ripple, which no smooth function shows
            ripple = _ripple_test(background, values[rows]) if name == "position" else smooth
            tests.append(max(smooth, ripple, key=lambda test: test.share))
    tests.append(_dummies_test(background, "direction", np.sign(motion.velocity[rows])))
    tests.append(_dummies_test(background, "order", recording.filtered_trial.astype(float)))
    return sorted(tests, key=lambda test: -test.share)


test_residual.__test__ = False  # type: ignore[attr-defined]


def autocorrelation(fit: JointFit) -> float:
    """Integrated autocorrelation time of the residual in filtered rows; 1 is white."""
    return correlation_rows(fit.residual, fit.model.recording.filtered_trial)


def _smooth_test(background: Background, name: str, values: Array) -> ResidualTest:
    rank = stats.rankdata(values) / len(values)  # equal numbers of rows under each bend
    columns = np.column_stack([np.cos(np.pi * k * rank) for k in range(1, _SMOOTH + 1)])
    return _test(background, name, columns)


def _dummies_test(background: Background, name: str, values: Array) -> ResidualTest:
    levels = np.unique(values)
    return _test(background, name, np.column_stack([(values == level).astype(float) for level in levels]))


def _ripple_test(background: Background, position: Array) -> ResidualTest:
    """The strongest line of the spectrum over the angle, below what the rows resolve."""
    stroke = float(np.ptp(position))
    if stroke <= 0:
        return ResidualTest("position", 0.0, 1.0)
    count = int(min(400, max(len(position) // 20, 8)))
    residual = background.residual[: len(position)]
    total = float(residual @ residual)
    best = 0.0
    for k in range(2, count):
        wave = np.exp(1j * 2.0 * np.pi * k * position / stroke)
        best = max(best, 2.0 * float(np.abs(wave @ residual)) ** 2 / len(position) / max(total, 1e-300))
    share = min(best, 1.0)
    single = _chance(background, share, 2)
    return ResidualTest("position", share, float(min(1.0, single * count)))


def _test(background: Background, name: str, columns: Array) -> ResidualTest:
    n = len(columns)
    basis = background.basis[:n]
    free = columns - basis @ (basis.T @ columns)
    norm = np.linalg.norm(free, axis=0)
    free = free[:, norm > 1e-6 * np.linalg.norm(columns, axis=0)]
    residual = background.residual[:n]
    if free.shape[1] == 0:
        return ResidualTest(name, 0.0, 1.0)
    explained = free @ np.linalg.lstsq(free, residual, rcond=1e-8)[0]
    share = float(1.0 - np.sum((residual - explained) ** 2) / np.sum(residual**2))
    return ResidualTest(name, max(share, 0.0), _chance(background, share, free.shape[1]))


def _chance(background: Background, share: float, columns: int) -> float:
    spare = max(background.effective - columns - len(background.fit.x), 1.0)
    ratio = share / columns / max((1.0 - share) / spare, 1e-300)
    return float(stats.f.sf(max(ratio, 0.0), columns, spare))
