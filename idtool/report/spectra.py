"""Correlation and spectra of a residual that comes in trials, pure functions on arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from idtool.model.motion import Array

#: A step this many times the usual one is a gap: rows were left out there.
_GAP = 2.5
#: A shorter piece has fewer than eight frequencies.
_SHORTEST = 16
#: As many as a figure's width has dots to show; and rows enough for those, of which more only cost time.
_MOST_FREQUENCIES = 800
_MOST_ROWS = 6000


def even_pieces(time: Array, values: Array, segments: Sequence[slice]) -> tuple[float, list[Array]]:
    """The step (s) and the evenly sampled pieces of a residual: trials, cut where rows are missing."""
    steps = np.concatenate([np.diff(time[rows]) for rows in segments] or [np.empty(0)])
    if not len(steps) or float(np.median(steps)) <= 0:
        return math.nan, []
    step = float(np.median(steps))
    pieces = []
    for rows in segments:
        clock, signal = time[rows], values[rows]
        cuts = [0, *(np.flatnonzero(np.diff(clock) > _GAP * step) + 1).tolist(), len(clock)]
        for start, stop in pairwise(cuts):
            if stop - start >= _SHORTEST:
                even = np.arange(clock[start], clock[stop - 1] + 0.5 * step, step)
                pieces.append(np.interp(even, clock[start:stop], signal[start:stop]))
    return step, pieces


def autocorrelation(pieces: Sequence[Array], most: int) -> Array:
    """Correlation of a residual with itself at lags 0, 1, ... below `most`, over all pieces.

    The mean over everything is taken away, not each piece's own: a trial that is off as a whole is a
    correlation too.
    """
    mean = float(np.mean(np.concatenate(pieces)))
    total, count = np.zeros(most), np.zeros(most)
    for piece in pieces:
        lags = min(most, len(piece))
        size = 1 << (2 * len(piece) - 1).bit_length()
        transform = np.fft.rfft(piece - mean, size)
        total[:lags] += np.fft.irfft(np.abs(transform) ** 2, size)[:lags]
        count[:lags] += len(piece) - np.arange(lags)
    covariance = total / np.maximum(count, 1.0)
    return np.asarray(covariance / covariance[0] if covariance[0] > 0 else covariance)


def periodogram(pieces: Sequence[Array], step: float) -> tuple[Array, Array]:
    """Frequencies (Hz) and one-sided power density (squared unit per Hz), averaged over the pieces.

    Pieces are padded to one length so that they share their frequencies, and weigh by their rows.
    """
    size = 1 << (max(len(piece) for piece in pieces) - 1).bit_length()
    power = np.zeros(size // 2 + 1)
    rows = 0
    for piece in pieces:
        window = np.hanning(len(piece) + 2)[1:-1]
        transform = np.fft.rfft((piece - piece.mean()) * window, size)
        power += len(piece) * 2.0 * step * np.abs(transform) ** 2 / float(window @ window)
        rows += len(piece)
    return np.asarray(np.fft.rfftfreq(size, step)[1:], dtype=float), power[1:] / rows


def angle_frequencies(position: Array, segments: Sequence[slice]) -> Array:
    """Spatial frequencies that the motion can show, radians of ripple per unit of travel.

    From two periods over the stroke (fewer look like a stiffness or an offset) up to four samples a
    period at the usual speed; empty where that leaves nothing.
    """
    stroke = float(np.ptp(position))
    moves = np.concatenate([np.abs(np.diff(position[rows])) for rows in segments] or [np.empty(0)])
    moves = moves[moves > 1e-3 * float(np.max(moves, initial=0.0))]
    if stroke <= 0 or not len(moves):
        return np.empty(0)
    lowest = 2.0 * 2.0 * math.pi / stroke
    highest = 2.0 * math.pi / (4.0 * float(np.median(moves)))
    spacing = 0.5 * math.pi / stroke
    count = min(int((highest - lowest) / spacing), _MOST_FREQUENCIES)
    return np.asarray(lowest + spacing * np.arange(max(count, 0)), dtype=float)


def angle_amplitudes(position: Array, values: Array, frequencies: Array) -> Array:
    """Amplitude of sin(n q + phi) in `values` at each spatial frequency n.

    The rows are unevenly spread over the angle, so it is summed directly, turning each row's phase
    by the spacing of the frequencies from one to the next.
    """
    if not len(frequencies):
        return np.empty(0)
    every = slice(None, None, max(1, len(position) // _MOST_ROWS))
    q, signal = position[every], values[every] - float(np.mean(values[every]))
    spacing = float(frequencies[1] - frequencies[0]) if len(frequencies) > 1 else 0.0
    phase = np.exp(-1j * frequencies[0] * q) * signal
    turn = np.exp(-1j * spacing * q)
    amplitudes = np.empty(len(frequencies))
    for index in range(len(frequencies)):
        amplitudes[index] = 2.0 * abs(phase.mean())
        phase *= turn
    return amplitudes
