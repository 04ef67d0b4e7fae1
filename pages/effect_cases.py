"""The axis, the run and the view of the residual with which docs/effects/ shows each effect."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array, Motion, since_reversal

#: How the rows of a residual are drawn: as they are, turned so that too little friction in the model is
#: above zero in both directions, or as a line over time.
Way = Literal["plain", "friction", "line"]
_SIDE = math.pi / 2


@dataclass(frozen=True)
class View:
    """What the residual is drawn over.

    Attributes:
        label: of the abscissa, with its unit.
        of: the abscissa, from the motion, shape (rows,).
        way: how rows are drawn.
        experiment: the run to show; all of them if empty.
        trial: the one trial of that run to show, counted from 0; all of them if None.
        between: the part of the abscissa to show; all of it if None.
        least_speed: rows slower than this (rad/s) are left out.
        parts: rows of two kinds, drawn apart: true for the first kind.
        part_names: what the two kinds are.
    """

    label: str
    of: Callable[[Motion], Array]
    way: Way = "plain"
    experiment: str = ""
    trial: int | None = None
    between: tuple[float, float] | None = None
    least_speed: float = 0.0
    parts: Callable[[Motion], NDArray[np.bool_]] | None = None
    part_names: tuple[str, str] = ("forwards", "backwards")


@dataclass(frozen=True)
class Case:
    """One session with one effect.

    Attributes:
        numbers: of the effect, in the keys of a plant file.
        view: what the residual is drawn over.
        recipe: trials of a further run, as TOML; none if empty.
        pauses: whether the bundled run with pauses is in the session too.
    """

    numbers: dict[str, float]
    view: View
    recipe: str = ""
    pauses: bool = False


def since_turn(motion: Motion) -> Array:
    """Travel since the axis last turned round (or the trial began), rad."""
    return since_reversal(motion.position, motion.velocity, motion.trial)


def since_rest(motion: Motion) -> Array:
    """Travel since the axis last stood for 0.1 s, rad."""
    still = np.abs(motion.velocity) < 0.004
    rested = _since(np.where(still, motion.step, 0.0), ~still | motion.first) > 0.1
    travelled = np.abs(np.diff(motion.position, prepend=motion.position[0]))
    return _since(travelled, rested | motion.first)


def _since(amounts: Array, anew: NDArray[np.bool_]) -> Array:
    """Running sum that starts again wherever `anew` holds."""
    total = np.cumsum(amounts)
    marks = np.maximum.accumulate(np.where(anew, np.arange(len(total)), 0))
    return np.asarray(total - total[marks])


def forwards(motion: Motion) -> NDArray[np.bool_]:
    """Rows on which the axis moves towards +q."""
    return np.asarray(motion.velocity > 0.0)


def _after_long_rest(motion: Motion) -> NDArray[np.bool_]:
    """Rows of a motion that began after a rest of 2 s or more."""
    still = np.abs(motion.velocity) < 0.004
    rested = _since(np.where(still, motion.step, 0.0), ~still | motion.first)
    last = np.maximum.accumulate(np.where(rested > 0.1, np.arange(len(motion)), 0))
    return np.asarray(rested[last] >= 2.0)


def _time_since_turn(motion: Motion) -> Array:
    way = np.sign(motion.velocity)
    return _since(motion.step, motion.first | (np.diff(way, prepend=way[0]) != 0))


def _load(motion: Motion) -> Array:
    assert motion.load is not None
    return np.abs(motion.load)


POSITION = "position, rad"
VELOCITY = "velocity, rad/s"
ACCELERATION = "acceleration, rad/s²"
LOAD = "load, N m"


_position, _velocity, _acceleration = map(attrgetter, ("position", "velocity", "acceleration"))
_payload, _temperature = map(attrgetter, ("payload", "temperature"))


def _speed(motion: Motion) -> Array:
    return np.abs(motion.velocity)


def _time(motion: Motion) -> Array:
    return motion.time - motion.time[motion.starts][motion.trial]


def _moves(numbers: str, *, upright: bool = False) -> str:
    """Trials back and forth with these numbers, on its side or upright."""
    tilt = "" if upright else f"tilt_alpha_rad = {_SIDE}\n"
    return f'\n[[trials]]\nkind = "back_and_forth"\n{tilt}{numbers}'


_FAST_SINES = f"""
[[trials]]
kind = "sine"
tilt_alpha_rad = {_SIDE}
frequency_hz = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0]
amplitude_rad_s = 0.2
duration_s = 5.0
"""

CASES: dict[str, Case] = {
    "inertia": Case(
        {"inertia_kg_m2": 0.02},
        View(ACCELERATION, _acceleration, experiment="sine", between=(-2.5, 2.5), least_speed=0.15),
    ),
    "torque_offset": Case({"offset_nm": 0.02}, View(VELOCITY, _velocity, experiment="sweep")),
    "direction_asymmetry": Case(
        {"asymmetry_nm_s_per_rad": 0.05}, View(VELOCITY, _velocity, experiment="sweep")
    ),
    "nonlinear_viscous": Case(
        {"quadratic_nm_s2_per_rad2": 0.1},
        View(VELOCITY, _velocity, experiment="speeds"),
        recipe=_moves("""speed_rad_s = [0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4]
travel_rad = 4.2
acceleration_rad_s2 = 1.5
repeats = 2
"""),
    ),
    "transport_delay": Case(
        {"delay_s": 0.01},
        View("time since the last reversal, s", _time_since_turn, "friction", "sine", between=(0.0, 0.4)),
    ),
    "torque_constant_saturation": Case(
        {"kappa_per_a": 0.2},
        View(LOAD, _load, experiment="heavy"),
        recipe=_moves(
            """payload_kg = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
speed_rad_s = 0.2
travel_rad = 0.8
repeats = 2
""",
            upright=True,
        ),
    ),
    "stribeck_shape": Case(
        {"exponent": 0.5},
        View("speed, rad/s", _speed, "friction", experiment="slow", between=(0.004, 0.3)),
        recipe=_moves("""speed_rad_s = [0.01, 0.02, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3]
travel_rad = [0.2, 0.4, 0.6, 0.8, 0.8, 0.8, 0.8, 0.8]
acceleration_rad_s2 = 0.3
repeats = [1, 1, 1, 2, 2, 2, 3, 3]
"""),
    ),
    "load_dependent_friction": Case(
        {"mu": 0.08}, View(LOAD, _load, "friction", experiment="gravity", least_speed=0.1)
    ),
    "drive_backdrive": Case(
        {"mu_drive": 0.15, "mu_backdrive": 0.03},
        View(LOAD, _load, experiment="gravity", least_speed=0.1, parts=forwards, part_names=("up", "down")),
    ),
    "tilt_misalignment": Case(
        {"alpha_rad": 0.05},
        View("payload, kg, lying on its side", _payload, experiment="tilts"),
        recipe=_moves("""payload_kg = [0.0, 0.4, 0.8, 1.2]
speed_rad_s = 0.2
travel_rad = 0.8
repeats = 2
"""),
    ),
    "position_stiffness": Case(
        {"stiffness_nm_per_rad": 0.03, "neutral_rad": 0.4}, View(POSITION, _position, experiment="sweep")
    ),
    "position_dependent_friction": Case(
        {"slope_1": 0.4, "slope_2": 0.0, "half_stroke_rad": 2.1},
        View(POSITION, _position, experiment="sweep", least_speed=0.05, parts=forwards),
    ),
    "hysteresis": Case(
        {"stiffness_nm_per_rad": 0.3, "yield_nm": 0.02},
        View("travel since the last reversal, rad", since_turn, "friction", experiment="nested"),
        recipe=_moves("""speed_rad_s = 0.1
travel_rad = [0.05, 0.1, 0.2, 0.4, 0.8]
repeats = [8, 6, 4, 3, 2]
"""),
    ),
    "backlash": Case(
        {"gap_rad": 0.05, "share_behind_gap": 0.5},
        View("travel since the last reversal, rad", since_turn, "friction", "sine", between=(0.0, 0.2)),
    ),
    "compliance": Case(
        {"stiffness_nm_per_rad": 3.0, "damping_nm_s_per_rad": 0.02, "load_inertia_kg_m2": 0.006},
        View("time, s (a sine of 3 Hz)", _time, "line", experiment="fast", trial=4, between=(1.0, 3.0)),
        recipe=_FAST_SINES,
    ),
    "breakaway_dwell": Case(
        {"gain": 1.5, "time_constant_s": 1.0},
        View(
            "travel since the last rest, rad",
            since_rest,
            "friction",
            experiment="pauses",
            between=(0.0005, 0.06),
            parts=_after_long_rest,
            part_names=("after 2 s or more", "after less"),
        ),
        pauses=True,
    ),
    "thermal_drift": Case(
        {"rate_per_k": 0.03, "reference_degc": 25.0},
        View("temperature, °C", _temperature, "friction", least_speed=0.05),
    ),
    "position_ripple": Case(
        {"cycles_per_turn": 31.0, "amplitude_1_nm": 0.015, "phase_1_rad": 0.3},
        View(POSITION, _position, experiment="sweep", between=(-0.6, 0.6)),
    ),
    "external_periodic": Case(
        {"frequency_hz": 0.25, "amplitude_nm": 0.015},
        View("time, s", _time, "line", experiment="sweep", trial=0, between=(2.0, 40.0)),
    ),
}
