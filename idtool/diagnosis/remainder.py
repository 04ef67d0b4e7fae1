"""What a fit leaves: whether it has structure, what that follows, what it can have done to the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from idtool.diagnosis.plausible import WORTH
from idtool.diagnosis.repeatability import repeatability
from idtool.diagnosis.residual import (
    DEPENDS,
    ResidualTest,
    autocorrelation,
    columns_followed,
    test_residual,
)
from idtool.fit.covariance import correlation_rows
from idtool.fit.joint import JointFit, kept
from idtool.model.running import deviation

#: A residual this much above the sensor noise holds something if it is correlated over this many rows, or
#: is more than a disturbance may be (`_DISTURBED`).
_ABOVE_NOISE = 1.5
_CORRELATED = 2.0
#: What does not come again and is more than this share of the friction is a disturbance, not noise: a hand,
#: another joint, an encoder that slips. Such a residual has to be told, though it repeats nothing.
_DISTURBED = 0.05
#: What is correlated over less, s, and as large throughout (its median size over its rms, 1 of a normal
#: distribution), is noise of readings that are filtered: what touches an axis lasts longer, comes and goes.
_LASTS_S, _THROUGHOUT = 0.1, 0.9


@dataclass(frozen=True)
class Remainder:
    """Structure in a residual.

    Attributes:
        share: of the residual's variance that what it depends on explains; of what is above the floor where
            no part that matters follows anything that was logged.
        depends_on: names of variables, strongest first.
        looked_for: whether effects were looked for that could account for it.
    """

    share: float
    depends_on: tuple[str, ...]
    looked_for: bool = True

    @property
    def note(self) -> str:
        """What is to be said of it; small parts of a residual may follow something all the same."""
        if self.depends_on:
            on = ", ".join(self.depends_on)
            nothing = (
                "no effect of the library accounts for it" if self.looked_for else "no effect was looked for"
            )
            return f"the residual still depends on {on}; {nothing}."
        return (
            "the residual is above the sensor noise, but no part of it that matters follows anything that "
            "was logged."
        )


def limit(fit: JointFit) -> float:
    """The most that may be left of a model that lacks nothing, filtered rows: not much more than the sensor
    noise, or than what does not come again where the same place, speed and direction are passed again."""
    most = _DISTURBED * fit.model.friction_sizes[0]
    return max(_ABOVE_NOISE * fit.model.filtered_noise, min(_ABOVE_NOISE * (repeatability(fit) or 0.0), most))


def remainder(
    fit: JointFit, tests: Sequence[ResidualTest] | None = None, unnamed: Sequence[str] = ()
) -> Remainder | None:
    """What is left and still structured; None if that is noise, or too little to matter.

    Args:
        fit: any fit.
        tests: of its residual, if they are known.
        unnamed: variables that a shape without a name, large enough to matter, was found to follow.
    """
    matters = WORTH * fit.model.friction_sizes[0]
    found = test_residual(fit, DEPENDS) if tests is None else tests
    large = [test for test in found if np.sqrt(test.share) * fit.rmse > matters]
    depends = [test for test in large if test.depends or test.variable in unnamed]
    if depends:
        return Remainder(max(test.share for test in depends), tuple(test.variable for test in depends))
    disturbed = fit.rmse > _DISTURBED * fit.model.friction_sizes[0]
    if fit.rmse <= max(matters, _ABOVE_NOISE * fit.model.filtered_noise) or not (
        disturbed or autocorrelation(fit) > _CORRELATED
    ):
        return None
    most = limit(fit)  # the last question: its neighbours in place and speed take as long as a fit
    if fit.rmse <= most:
        return None
    # that there is something is certain then; what it follows may be told with less confidence
    likely = [test for test in large if test.may_depend] or [t for t in found if t.variable in unnamed]
    if not likely and memory_of_noise(fit) is not None:
        return None
    above = 1.0 - (most / (_ABOVE_NOISE * fit.rmse)) ** 2
    share = max((test.share for test in likely), default=above)
    return Remainder(share, tuple(test.variable for test in likely))


@kept
def memory_of_noise(fit: JointFit) -> float | None:
    """Over how long a residual is correlated, s, that is more than the noise which readings show from row to
    row and is noise all the same, of readings that were filtered; None if it is not that.

    Such noise is as large throughout, and its steps are those of an autoregressive process of that memory.
    """
    if fit.rmse <= _ABOVE_NOISE * fit.model.filtered_noise:
        return None
    recording = fit.model.recording
    white = recording.operator @ np.random.default_rng(0).normal(size=len(recording.torque))
    rows = autocorrelation(fit) - correlation_rows(white, recording.filtered_trial)  # less the filter's own
    memory = rows * float(np.median(np.diff(recording.motion.time[recording.row])))
    spread = deviation(fit.residual - np.median(fit.residual))
    if not 0.0 < memory < _LASTS_S or spread < _THROUGHOUT * fit.rmse:
        return None
    time = 1.0 + memory / float(np.median(np.diff(recording.motion.time)))  # integrated, in rows
    keeps = (time - 1.0) / (time + 1.0)
    steps = np.sqrt((20.0 - 30.0 * keeps + 12.0 * keeps**2 - 2.0 * keeps**3) / 20.0)  # third differences
    hidden = np.sqrt(time) / steps  # by so much the noise of white readings tells too little
    return memory if fit.rmse < _ABOVE_NOISE * hidden * fit.model.filtered_noise else None


def doubted(fit: JointFit, left: Remainder | None) -> JointFit:
    """The fit with intervals that cover what the structure in its residual can have done to each number.

    A smooth function of what the residual follows (and the strongest wave over the position) is fitted beside
    the parameters; by as much as that moves one, the missing effect can have moved it.
    """
    columns = columns_followed(fit, left.depends_on) if left else []
    if not columns:
        return fit
    rows = len(fit.residual)
    own = fit.jacobian[:rows, fit.free]
    both = np.hstack([own, *columns])
    size = np.linalg.norm(both, axis=0)
    size[size == 0.0] = 1.0
    moved = np.linalg.lstsq(both / size, fit.residual, rcond=1e-6)[0] / size
    pull = np.zeros(len(fit.x))
    pull[fit.free] = moved[: own.shape[1]]
    return replace(fit, pull=pull)
