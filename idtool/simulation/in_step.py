"""By how much the motion is read later than the effort beside it, as the motion tells it.

A bus that reads a duty and a position one after the other, or a servo that filters its position, logs the two
of different instants. Row by row a delay looks like play, or like less inertia; of the motion only the right
one brings the simulated position to the measured one all along.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from idtool.log import Log, columns_of
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.signals.bounded import bounded_minimum
from idtool.simulation.search import MOST, TRIED, MotionSearch, Tried
from idtool.simulation.stage import later

#: Delays between which to look, s, and how fine the last look is.
_LATEST, _STEP, _FINE = 0.048, 0.008, 5e-4
#: Half the stretch over which the curvature of the cost is taken, s.
_REACH = 3e-3
_EFFORTS = ("torque", "current", "bus_current", "duty", "supply_voltage")


def lateness(search: MotionSearch, start: Tried) -> Parameter | None:
    """The delay with its interval; None where the motion is matched as well without.

    Args:
        search: the logs.
        start: a first fit, without a delay.
    """

    def fitted(begin: Tried, delay: float, most: int = TRIED) -> Tried:
        return search.fit(with_lateness(begin.parameters, Parameter(delay)), begin.coordinates, most)

    tried = np.arange(0.0, _LATEST, _STEP)
    costs = [fitted(start, float(delay)).cost for delay in tried[:2]]
    if costs[0] <= min(fitted(start, 0.5 * _STEP).cost, costs[1]):
        return None
    costs += [fitted(start, float(delay)).cost for delay in tried[2:]]
    place = int(np.argmin(costs))
    near = fitted(start, float(tried[place]), MOST)

    def cost(delay: float) -> float:
        return fitted(near, delay).cost

    low, high = tried[max(place - 1, 0)], tried[min(place + 1, len(tried) - 1)]
    found = bounded_minimum(cost, float(low), float(high), within=_FINE)
    least = cost(found)
    noise = least / search.windows  # errors within a window hang together
    if costs[0] <= least + noise:
        return None
    curvature = (cost(found + _REACH) + cost(max(found - _REACH, 0.0)) - 2.0 * least) / _REACH**2
    error = math.sqrt(2.0 * noise / curvature) if curvature > 0.0 else math.inf
    if not math.isfinite(error) or error > found:
        return Parameter(found).undetermined()
    return Parameter(found, error, (found - 1.96 * error, found + 1.96 * error))


def with_lateness(parameters: Parameters, delay: Parameter) -> Parameters:
    """The file with that delay."""
    others = tuple(one for one in parameters.effects if one.name != "transport_delay")
    return replace(parameters, effects=(*others, EffectEntry("transport_delay", {"delay": delay})))


def lateness_in(parameters: Parameters) -> float:
    """The delay of a file, s."""
    entry = parameters.effect("transport_delay")
    return entry.parameters["delay"].value if entry is not None else 0.0


def less(delay: Parameter, late: float) -> Parameter:
    """What is left of a delay beside that of the readings, which is in it; not below zero."""
    if delay.ci95 is None:
        return replace(delay, value=max(delay.value - late, 0.0))
    value, low, high = (max(one - late, 0.0) for one in (delay.value, *delay.ci95))
    return replace(delay, value=value, ci95=(low, high))


def in_step(log: Log, delay: float) -> Log:
    """The log with its efforts as late as its motion, so that a row is of one instant."""
    columns = columns_of(log.axis.kind)
    there = [columns[name] for name in _EFFORTS if columns[name] in log.frame]
    trial = log.frame["trial"].to_numpy()
    first = np.append(True, trial[1:] != trial[:-1])
    time = log.frame["time_s"].to_numpy(dtype=float)
    moved = {name: later(time, log.frame[name].to_numpy(dtype=float), first, delay) for name in there}
    return replace(log, rows=log.frame.assign(**moved))
