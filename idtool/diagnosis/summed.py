"""All places and widths of a local shape at once: rows summed over bins of its variable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from idtool.model.motion import Array

#: So many bins, of which the narrowest shape has several.
_BINS = 2000
#: What less than this share is left of beside a fit's own columns is hidden by them.
HIDDEN = 1e-3


@dataclass(frozen=True)
class Summed:
    """Rows summed where their variable is nearly the same: a shape is as good as constant over a bin.

    Attributes:
        variable: mean of each bin, shape (bins,).
        size: squares of what a shape is multiplied by, summed, shape (bins,).
        residual: the product of that with the residual, summed, shape (bins,).
        basis: ... with what a fit has used already, shape (bins, m).
    """

    variable: Array
    size: Array
    residual: Array
    basis: Array

    @classmethod
    def of(cls, variable: Array, turned: Array, residual: Array, basis: Array) -> Summed:
        """Of rows, shapes (rows,) and (rows, m); a shape is multiplied by `turned`."""
        low, width = float(variable.min()), float(np.ptp(variable)) / _BINS
        bins = np.minimum((variable - low) / width, _BINS - 1).astype(np.int32)
        from scipy import sparse  # the fits alone need not pay its import

        rows = len(variable)
        into = sparse.csr_matrix((turned, bins, np.arange(rows + 1)), shape=(rows, _BINS)).T
        count = np.bincount(bins, minlength=_BINS)
        mean = np.bincount(bins, variable, minlength=_BINS) / np.maximum(count, 1)
        sums = mean, *(np.asarray(into @ values) for values in (turned, residual, basis))
        return cls(*(values[count > 0] for values in sums))

    def gains(self, shapes: Array) -> Array:
        """What each of several shapes, (bins, shapes), takes away of the residual's squares."""
        original = self.size @ shapes**2
        norm = original - np.sum((self.basis.T @ shapes) ** 2, axis=0)  # of what the basis leaves of each
        # the residual is free of the basis
        taken = (self.residual @ shapes) ** 2 / np.maximum(norm, 1e-300)
        return np.asarray(np.where(norm > HIDDEN * original, taken, 0.0))
