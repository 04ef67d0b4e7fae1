"""How long a Fourier transform may best be: its time depends on the prime factors of its length.

`scipy.fft` knows that too, and its import takes a twentieth of a fit; the transforms themselves are numpy's.
"""

from __future__ import annotations


def fast_length(rows: int) -> int:
    """The smallest product of 2, 3 and 5 that holds so many rows; `rows` is 1 at least."""
    lengths = []
    fives = 1
    while fives < 2 * rows:
        odd = fives
        while odd < 2 * rows:
            # the least power of two that fills it up
            lengths.append(odd << (-(-rows // odd) - 1).bit_length())
            odd *= 3
        fives *= 5
    return min(lengths)
