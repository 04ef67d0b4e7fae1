"""Errors of the simulated position beside those of the predicted torque, for reports and comparisons."""

from __future__ import annotations

from collections.abc import Sequence

from idtool.errors import InputError
from idtool.log import Log
from idtool.parameters import Parameters
from idtool.verbs.simulate import simulate


def position_errors(logs: Sequence[Log], parameters: Parameters) -> dict[str, float | str] | None:
    """How far the identified axis, driven by the logged effort, strays from the measured position.

    Returns:
        `rms_1s_windows` (over windows of one second, each from the measured state), `rms` and `mean_abs`
        (over whole trials) in `unit`, "mrad" or "mm"; None where the position was not logged, or the
        file has no inertia or friction to simulate with.
    """
    if not logs or any(log.column("position") is None for log in logs):
        return None
    try:
        found = simulate(logs, parameters)
    except InputError:
        return None
    return {
        "unit": "mm" if found.linear else "mrad",
        "rms_1s_windows": 1e3 * found.rms_windows,
        "rms": 1e3 * found.rms,
        "mean_abs": 1e3 * found.mean_abs,
    }
