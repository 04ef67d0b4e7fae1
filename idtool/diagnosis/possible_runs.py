"""The family of runs that may be proposed next: within what the axis has been seen to do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import tomli_w

from idtool.errors import InputError
from idtool.experiment.recipe import SCHEMA, SINE_SHARE, Recipe, parse_recipe
from idtool.model.units import Kind, file_key
from idtool.signals import Recording

#: Rows of a candidate run are computed this far apart, s; it is thinned no further.
STEP_S = 0.01
#: A run longer than this is not proposed, s.
_LONGEST_S = 300.0
_UPRIGHT = 0.0

Trial = dict[str, Any]


def possible_runs(recording: Recording) -> Iterator[tuple[dict[str, Any], Recipe]]:
    """Runs within what the axis has been seen to do, as documents and parsed."""
    trials = _Trials(_Reach.of(recording), recording.axis.kind)
    for name, run in _runs(trials).items():
        document = {
            "schema": SCHEMA,
            "name": "next",
            "experiment": "next",
            "description": name.strip(),
            "axis": recording.axis.kind,
            "period_s": 0.005,
            "trials": run,
        }
        try:
            recipe = parse_recipe(tomli_w.dumps(document), "next experiment")
        except InputError:  # logs in odd units ask for runs that no recipe may hold
            continue
        if recipe.duration_s <= _LONGEST_S:
            yield document, recipe


@dataclass(frozen=True)
class _Reach:
    """What the logs have shown that the axis can do."""

    stroke: float
    speed: float
    slowest: float
    acceleration: float
    payloads: tuple[float, ...]
    tilts: tuple[float, ...]

    @classmethod
    def of(cls, recording: Recording) -> _Reach:
        motion = recording.motion
        speed = float(np.quantile(np.abs(motion.velocity), 0.995))
        payload = motion.payload
        # an axis that was never laid on its side may not be able to: only tilts that were logged are used
        tilts = () if motion.tilt_alpha is None else np.unique(np.round(motion.tilt_alpha, 3))
        most = 0.0 if payload is None else float(np.max(payload))
        return cls(
            # a trial starts where the axis stands, so only half the stroke is sure to be free
            stroke=0.5 * float(np.ptp(motion.position)),
            speed=speed,
            slowest=max(0.05 * speed, 4.0 * recording.position_resolution),
            acceleration=float(np.quantile(np.abs(motion.acceleration), 0.99)),
            payloads=(0.0, round(0.5 * most, 3), round(most, 3)) if most > 0 else (0.0,),
            tilts=tuple(float(tilt) for tilt in tilts) or (_UPRIGHT,),
        )


@dataclass(frozen=True)
class _Trials:
    """Trials of a recipe, as tables, for one axis."""

    reach: _Reach
    kind: Kind

    def _key(self, name: str, dimension: str) -> str:
        return file_key(name, dimension, self.kind)

    def ways(self, speeds: list[float], travel: float, **more: Any) -> Trial:
        """Back and forth at these speeds."""
        quick = max(self.reach.acceleration, 2.0 * max(speeds) ** 2 / travel)
        speed = [round(v, 4) for v in speeds] if len(speeds) > 1 else round(speeds[0], 4)
        return {
            "kind": "back_and_forth",
            self._key("speed", "velocity"): speed,
            self._key("travel", "position"): round(travel, 4),
            self._key("acceleration", "acceleration"): round(quick, 4),
            **more,
        }

    def sines(self, frequencies: list[float], **more: Any) -> Trial:
        """Sines of these frequencies, as large as the axis was seen to move."""
        reach = self.reach
        kept = [f for f in frequencies if f * STEP_S <= SINE_SHARE]
        amplitude = [
            min(reach.speed, reach.stroke * math.pi * f, 3.0 * reach.acceleration / (2.0 * math.pi * f))
            for f in kept
        ]
        return {
            "kind": "sine",
            "frequency_hz": [round(f, 4) for f in kept],
            self._key("amplitude", "velocity"): [round(a, 4) for a in amplitude],
            "duration_s": [round(max(4.0, 4.0 / f), 2) for f in kept],
            **more,
        }


def _runs(trials: _Trials) -> dict[str, list[Trial]]:
    """By description."""
    reach = trials.reach
    runs: dict[str, list[Trial]] = {}
    for tilt in reach.tilts:
        label = f"at tilt {tilt:g}" if len(reach.tilts) > 1 else ""
        runs |= {f"{name} {label}": run for name, run in _without_payload(trials, tilt).items()}
        if len(reach.payloads) > 1:
            runs |= {f"{name} {label}": run for name, run in _with_payloads(trials, tilt).items()}
    return runs


def _without_payload(trials: _Trials, tilt: float) -> dict[str, list[Trial]]:
    reach, ways, sines = trials.reach, trials.ways, trials.sines
    spread = [float(v) for v in np.geomspace(reach.slowest, reach.speed, 7)]
    low = [float(v) for v in np.geomspace(reach.slowest, 0.3 * reach.speed, 6)]
    middle, travel = [0.3 * reach.speed], reach.stroke
    where = {"tilt_alpha_rad": tilt}
    return {
        "speeds from low to high": [ways(spread, travel, **where)],
        "low speeds": [ways(low, min(travel, 30.0 * max(low)), **where)],
        "sines of rising frequency": [sines([0.1, 0.3, 0.8, 2.0, 4.0, 7.0], **where)],
        "small strokes inside large ones": [
            sines([0.15] * 2, **where),
            *[ways(middle, share * travel, repeats=3, **where) for share in (0.02, 0.06, 0.2, 0.6)],
        ],
        "the whole stroke, slowly": [ways([0.1 * reach.speed], travel, **where)],
        "starts after pauses": [
            ways(middle, 0.3 * travel, dwell_s=pause, repeats=2, **where) for pause in (0.3, 1.0, 3.0, 8.0)
        ],
    }


def _with_payloads(trials: _Trials, tilt: float) -> dict[str, list[Trial]]:
    reach, where = trials.reach, {"tilt_alpha_rad": tilt}
    speeds, travel = [0.15 * reach.speed, 0.6 * reach.speed], 0.6 * reach.stroke
    return {
        "payloads both ways": [
            trials.ways(speeds, travel, payload_kg=mass, **where) for mass in reach.payloads
        ],
        "sines under payload": [
            trials.sines([0.3, 1.0, 3.0], payload_kg=mass, **where) for mass in reach.payloads[1:]
        ],
    }
