"""What the model leaves open, learned while nobody touches: a Kalman filter of four numbers.

    tau_left = o + b F_elastic + v F_damping + zeta + noise

o is a constant load that nobody told of (a payload, an offset), b and v are how far the friction level
and the damping (bristle's and viscous) are off, relatively, and zeta is torque in a bristle whose
deflection nobody saw; it fades as the axis travels, which is what tells it from a load. Before anything is
learned, each is zero give or take its prior standard deviation. The filter's covariance says how far the
model can be wrong at this very motion; that, and not the model's best guess, decides what may be given to
a hand.

Linear regression by Kalman's recursion (Kalman 1960; Astrom & Wittenmark 1995, section 2.2).
"""

from __future__ import annotations

import math

LOAD, LEVEL, DAMPING, BRISTLE = range(4)


class Certainty:
    """Mean and covariance of the four numbers.

    Attributes:
        mean: o (N m or N), b, v (relative), zeta (N m or N).
    """

    def __init__(self, load: float, level: float, viscous: float, bristle: float) -> None:
        """Prior standard deviations: N m (N), relative, relative, N m (N)."""
        self._prior = (load, level, viscous, bristle)
        self.reset()

    def reset(self) -> None:
        """Back to the prior."""
        self.mean = [0.0] * 4
        self._cov = [[0.0] * 4 for _ in range(4)]
        for k, deviation in enumerate(self._prior):
            self._cov[k][k] = deviation * deviation

    def unsettle_bristle(self) -> None:
        """The bristle's deflection is unknown again, as after a fault."""
        self.fade(0.0)
        self._cov[BRISTLE][BRISTLE] = self._prior[BRISTLE] ** 2

    def fade(self, share: float) -> None:
        """After a travel that keeps `share` of a bristle's deflection."""
        self.mean[BRISTLE] *= share
        self.fade_covariance(share)

    def fade_covariance(self, share: float) -> None:
        """The part of `fade` that can wait."""
        p = self._cov
        last = p[BRISTLE]
        for k in range(3):
            last[k] *= share
            p[k][BRISTLE] = last[k]
        last[BRISTLE] *= share * share

    def copy(self) -> Certainty:
        """Another one that knows the same."""
        other = Certainty(*self._prior)
        other.mean = list(self.mean)
        other._cov = [list(row) for row in self._cov]
        return other

    def shift(self, torque: float, deviation: float = 0.0) -> None:
        """Put a torque on the bristle, N m (N), that is there give or take `deviation`."""
        self.mean[BRISTLE] += torque
        self._cov[BRISTLE][BRISTLE] += deviation * deviation

    def drift(self, load: float, friction: float) -> None:
        """The world may have changed by these standard deviations, N m (N) and relative; the prior bounds
        what is ever unknown."""
        for k, change in ((LOAD, load), (LEVEL, friction), (DAMPING, friction)):
            variance = self._cov[k][k]
            self._cov[k][k] = min(variance + change * change, max(self._prior[k] ** 2, variance))

    def correction(self, elastic: float, damping: float) -> float:
        """What is to be added to the model's torque, N m (N), at these friction torques of the model."""
        m = self.mean
        return m[0] + m[1] * elastic + m[2] * damping + m[3]

    def deviation(self, elastic: float, damping: float) -> float:
        """Standard deviation of the corrected model, N m (N), at these friction torques."""
        return math.sqrt(self.variance(elastic, damping))

    def variance(self, elastic: float, damping: float) -> float:
        """The same, squared."""
        a, b, c, d = self._cov
        variance = (
            a[0]
            + d[3]
            + 2.0 * a[3]
            + elastic * (elastic * b[1] + 2.0 * (a[1] + b[3]))
            + damping * (damping * c[2] + 2.0 * (a[2] + c[3] + elastic * b[2]))
        )
        return max(variance, 0.0)

    def learn(self, left: float, elastic: float, damping: float, noise: float) -> None:
        """Take in what is left of the uncorrected model while no hand touches.

        Args:
            left: K i less the model's torque, N m (N).
            elastic, damping: the model's friction torques, N m (N).
            noise: standard deviation of `left`, N m (N).
        """
        self.take_in(left - self.correction(elastic, damping), elastic, damping, noise)

    def take_in(self, surprise: float, elastic: float, damping: float, noise: float) -> float:
        """`learn` from what is left of the corrected model; what of that is left then, N m (N)."""
        p, row = self._cov, (1.0, elastic, damping, 1.0)
        spread = [sum(p[j][k] * row[k] for k in range(4)) for j in range(4)]
        total = sum(row[k] * spread[k] for k in range(4)) + noise * noise
        if not total > 0.0:
            return surprise
        for j in range(4):
            gain = spread[j] / total
            self.mean[j] += gain * surprise
            for k in range(4):
                p[j][k] -= gain * spread[k]
        return surprise * noise * noise / total
