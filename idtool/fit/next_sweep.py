"""The run that would show what is missing, as a command with its rig and its numbers."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence

from idtool.fit.joint import JointFit
from idtool.fit.windows import Window
from idtool.signals import Recording

#: A bristle has settled after a travel of this many times the presliding scale tau / sigma0.
_SETTLED_AFTER = 5.0
#: Acceleration of the ramps of the bundled sweep, rad/s^2, and by how much their rounding lengthens them.
_RAMP = 0.1
_RAMP_SHAPE = 0.5 * math.pi
#: Coulomb, viscous and whether the curve bends between them.
LEAST_SPEEDS = 3


def run_command(recording: Recording, experiment: str) -> str:
    """The bundled experiment on the rig of the logs, as a command; --rig SPEC where they do not say which."""
    return f"ffc-id run-{experiment} {_rig(recording)} -o {experiment}.csv"


def _rig(recording: Recording) -> str:
    return f"--rig {shlex.quote(recording.rig or 'SPEC')}"


def slow_sweep(fit: JointFit, slowest: float) -> str:
    """The sweep that would show low speeds: down to a twentieth of the slowest so far."""
    # the bristle must settle at each speed, and the slowest way must not take hours
    travel = max(2.0 * _SETTLED_AFTER * fit.presliding_scale, 0.1 * fit.model.scales.travel)
    travel = min(travel, fit.model.scales.travel)
    speeds = [slowest * share for share in (0.05, 0.1, 0.2, 0.35, 0.5, 0.7)]
    # ramps as gentle as those of the bundled sweep must fit into the way
    fitting = [speed for speed in speeds if _RAMP_SHAPE * speed**2 < 0.8 * _RAMP * travel]
    listed = ",".join(f"{speed:.2g}" for speed in (fitting if len(fitting) > 1 else speeds[:3]))
    return _sweep_command(fit, f"--speeds {listed} --travel {travel:.2g} -o low-speeds.csv")


def long_sweep(fit: JointFit, windows: Sequence[Window]) -> tuple[float, str]:
    """The travel in which the bristle settles at three of the speeds at least, and that sweep."""
    settling = _SETTLED_AFTER * fit.presliding_scale
    speeds = sorted({float(f"{abs(window.velocity):.1g}") for window in windows})

    def needed(speed: float) -> float:
        ramp = 0.5 * _RAMP_SHAPE * speed**2 / _RAMP
        return max(settling, ramp) + 0.6 * speed + ramp

    travel = max(1.3 * settling, needed(speeds[:LEAST_SPEEDS][-1]))
    listed = ",".join(f"{speed:g}" for speed in speeds if needed(speed) <= travel)
    return travel, _sweep_command(fit, f"--speeds {listed} --travel {travel:.2g} -o long.csv")


def _sweep_command(fit: JointFit, options: str) -> str:
    # the bundled recipe is for a rotary axis
    recipe = "" if fit.model.recording.axis.kind == "rotary" else "--recipe YOURS.toml "
    return f"ffc-id run-sweep {_rig(fit.model.recording)} {recipe}{options}"
