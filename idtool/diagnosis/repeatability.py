"""What does not come again: the floor of a residual where the sensor noise is none.

A recording that was filtered or resampled before it came shows next to no noise, and every structure stands
out of it. Where the same place, speed and acceleration were passed again at another time, the difference of
the two residuals is what no function of the motion can explain (the pure error of a lack-of-fit test;
Draper & Smith, Applied Regression Analysis, 3rd ed. 1998, section 2.1).
"""

from __future__ import annotations

import numpy as np

from idtool.fit.joint import JointFit

#: Rows are neighbours within this share of each range, and at least so far apart in time, s.
_NEAR = 0.02
_APART_S = 1.0
#: Fewer pairs tell nothing.
_LEAST_PAIRS = 50
_NEIGHBOURS = 12
#: So many of the pairs tell, and the quantile of the normal distribution within which so many lie.
_MOST_PAIRS, _NORMAL_QUANTILE = 0.8, 1.2816


def repeatability(fit: JointFit) -> float | None:
    """Standard deviation of what does not come again, filtered rows; None if too little came again.

    By what most pairs differ by, so that what came once, as a hand or a cable that snagged, is no noise.
    """
    from scipy import spatial  # the fits alone need not pay its import

    recording = fit.model.recording
    motion, row = recording.motion, recording.row
    variables = [motion.position, motion.velocity, motion.acceleration, motion.load, motion.payload]
    columns = [values[row] for values in variables if values is not None]
    scaled = np.column_stack([values / (float(np.ptp(values)) or 1.0) for values in columns])
    distances, others = spatial.KDTree(scaled).query(scaled, k=min(_NEIGHBOURS, len(row)), p=np.inf)
    first = np.repeat(np.arange(len(row)), np.shape(others)[1])
    second, near = np.ravel(others), np.ravel(distances) < _NEAR
    apart = np.abs(motion.time[row[first]] - motion.time[row[second]]) > _APART_S
    apart |= recording.filtered_trial[first] != recording.filtered_trial[second]
    pairs = near & apart & (first < second)
    if np.count_nonzero(pairs) < _LEAST_PAIRS:
        return None
    difference = fit.residual[first[pairs]] - fit.residual[second[pairs]]
    return float(np.quantile(np.abs(difference), _MOST_PAIRS) / (_NORMAL_QUANTILE * np.sqrt(2.0)))
