"""Whether a frequency is one at which the motion itself repeats."""

from __future__ import annotations

import numpy as np

from idtool.model.motion import Array, Motion
from idtool.signals.fast_length import fast_length

#: A motion repeats if its speed a period later is this much like its speed now, and periods are that many.
_ALIKE, _PERIODS = 0.95, 3.0
#: ... and it is another one in between. Tops so much apart are equally high.
_UNLIKE, _AS_HIGH = 0.5, 0.01
#: A frequency is a multiple of the motion's to within this share of a wave in the trial, as a line is found.
_RESOLVED = 0.2


def beats_with_motion(motion: Motion, frequency: float) -> bool:
    """Whether most rows are of a motion that repeats so that `frequency`, Hz, is a multiple of its own.

    Whatever depends on a motion that repeats has the motion's frequency and its multiples: what beats there
    cannot be told from a function of the motion that the model lacks.
    """
    ends = np.append(motion.starts[1:], len(motion))
    beating = 0
    for begin, end in zip(motion.starts, ends, strict=True):
        time = motion.time[begin:end]
        period = _period(time, motion.velocity[begin:end])
        if period is None:
            continue
        beats = frequency * period
        close = _RESOLVED * period / float(time[-1] - time[0])
        if round(beats) >= 1 and abs(beats - round(beats)) < close:
            beating += end - begin
    return beating > 0.5 * len(motion)


def _period(time: Array, velocity: Array) -> float | None:
    """After which the motion of a trial repeats, s; None if it does not often enough."""
    rows = len(time)
    longest = int(rows / _PERIODS)
    if longest < 2:
        return None
    clock = np.linspace(time[0], time[-1], rows)
    speed = np.interp(clock, time, velocity)
    speed = speed - speed.mean()
    if not speed.any():
        return None
    spectrum = np.abs(np.fft.rfft(speed, fast_length(2 * rows))) ** 2
    products = np.fft.irfft(spectrum)[: longest + 1]
    # 1 where the speed and what it is a lag later agree in all rows (de Cheveigne & Kawahara, YIN, 2002)
    squares = np.concatenate([[0.0], np.cumsum(speed**2)])
    lag = np.arange(longest + 1)
    alike = 2.0 * products / (squares[rows - lag] + squares[rows] - squares[lag])
    unlike = np.flatnonzero(alike < _UNLIKE)
    if not len(unlike):
        return None
    later = alike[unlike[0] :]
    best = float(later.max())
    if best < _ALIKE:
        return None
    # the first top that is as high as any
    first = unlike[0] + int(np.flatnonzero(later > best - _AS_HIGH)[0])
    fallen = np.flatnonzero(alike[first:] <= best - _AS_HIGH)
    last = first + int(fallen[0]) if len(fallen) else longest + 1
    top = first + int(np.argmax(alike[first:last]))
    # between rows: the vertex of the parabola through it and its neighbours
    before, at, after = alike[top - 1], alike[top], alike[min(top + 1, longest)]
    curved = before - 2.0 * at + after
    beside = 0.5 * (before - after) / curved if curved < 0.0 else 0.0
    return float((top + np.clip(beside, -1.0, 1.0)) * (clock[1] - clock[0]))
