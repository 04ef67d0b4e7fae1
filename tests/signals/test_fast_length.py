"""The lengths that transforms are filled up to."""

from __future__ import annotations

from scipy import fft

from idtool.signals.fast_length import fast_length


def test_the_lengths_are_those_of_scipy() -> None:
    for rows in (*range(1, 3000), 45_001, 131_073, 1_000_007):
        assert fast_length(rows) == fft.next_fast_len(rows, real=True)
