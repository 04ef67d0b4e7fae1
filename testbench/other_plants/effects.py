"""What an axis may have besides gravity and friction: effects of the library, and what no library has."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from testbench.draws import between, sign
from testbench.other_plants.axes import Machine
from testbench.other_plants.physics import NOTHING, Plant

#: Time constant of warming over the length of a session.
WARM_UP_SHARE = 0.4


#: Machine, generator of the shape (the same at every call), strength -> numbers of the plant.
Put = Callable[[Machine, np.random.Generator, float], dict[str, Any]]


@dataclass(frozen=True)
class Extra:
    """One thing that an axis may have.

    Attributes:
        put: what it makes of the plant.
        start: strength that is tried first.
        most: greatest strength.
        kinds: axes that can have it; all if empty.
        needs: runs without which nobody could see it.
        stiff: whether the presliding must be short.
        least_rate: of the log, Hz.
        current: whether the log must have the current.
        depends_on: what the torque of a disturbance is a function of.
        partly: effects of the library that are a true part of it.
    """

    put: Put
    start: float = 0.2
    most: float = 1.0
    kinds: tuple[str, ...] = ()
    needs: frozenset[str] = frozenset()
    stiff: bool = False
    least_rate: int = 50
    current: bool = False
    depends_on: tuple[str, ...] = ()
    partly: tuple[str, ...] = ()

    def without(self, machine: Machine, plant: Plant) -> Plant:
        """The plant with numbers that have no torque in place of those that this one makes."""
        made = self.put(machine, np.random.default_rng(0), 0.0)
        return plant.with_numbers(**{name: NOTHING[name] for name in made if name in NOTHING})


def _backdrive(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    lower = s * r.uniform(0.0, 0.4)
    raising = bool(r.random() < 0.7)
    return {"mu_raise": s if raising else lower, "mu_lower": lower if raising else s}


def highest_line(m: Machine) -> float:
    """Cycles per radian (metre) that pass slowly enough for the log, times 2 pi."""
    return 2.0 * math.pi * min(m.rate / 12.0 / m.speed, 20.0 / m.axis.half_stroke)


def _ripple(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    n = between(r, 2.0 * math.pi * 1.5 / m.axis.half_stroke, 0.5 * highest_line(m))
    second = float(r.choice((0.0, 0.4)))
    amplitude = s * m.axis.coulomb
    phases = r.uniform(-math.pi, math.pi, 2)
    lines = [[n, amplitude, phases[0], 0.0], [2.0 * n, second * amplitude, phases[1], 0.0]]
    return {"lines": np.array(lines)}


def _spring(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    half = m.axis.half_stroke
    stiffness = s * sign(r) * m.axis.coulomb / half
    return {"spring": stiffness, "spring_neutral": r.uniform(-0.3, 0.3) * half, "spring_cubic": 0.0}


def _exponent(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    # strength 0 is the usual 2, 1 is 0.5; the bell must be high and wide to have a shape
    high = r.uniform(1.9, 3.0) if r.random() < 0.7 else r.uniform(0.3, 0.45)
    width = r.uniform(0.15, 0.3) * m.speed
    damping = min(m.axis.damping, 0.7 * m.axis.viscous / max(high - 1.0, 0.1))
    return {
        "exponent": 2.0 - 1.5 * s,
        "static": high * m.axis.coulomb,
        "stribeck_velocity": width,
        "damping": damping,
    }


def _hysteresis(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    most = s * m.axis.coulomb
    return {"yield_torque": most, "memory_stiffness": most / (m.axis.half_stroke * between(r, 0.06, 0.3))}


def _compliance(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    load, omega = s * m.axis.inertia, 2.0 * math.pi * between(r, 4.0, min(12.0, m.rate / 12.0))
    return {
        "load_inertia": load,
        "load_stiffness": load * omega**2,
        "load_damping": load * omega * between(r, 0.05, 0.3),
    }


def _periodic(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    return {
        "periodic": s * m.axis.coulomb,
        "periodic_hz": between(r, 0.17, min(4.0, m.rate / 15.0)),
        "periodic_phase": r.uniform(-math.pi, math.pi),
    }


def _dwell(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    return {
        "dwell": s,
        "dwell_time": between(r, 0.5, 3.0),
        "dwell_travel": m.axis.half_stroke * between(r, 0.01, 0.04),
    }


_LOADED = ("slide", "arm")
_FREE = ("shaft", "stage")

EFFECTS: dict[str, Extra] = {
    "torque_offset": Extra(lambda m, r, s: {"offset": s * sign(r) * m.axis.coulomb}),
    "direction_asymmetry": Extra(lambda m, r, s: {"asymmetry": s * sign(r) * m.axis.coulomb / m.speed}),
    "nonlinear_viscous": Extra(lambda m, r, s: {"quadratic": s * sign(r) * m.axis.coulomb / m.speed**2}),
    "load_dependent_friction": Extra(lambda m, r, s: {"mu": s}, 0.1, 0.5, _LOADED),
    "drive_backdrive": Extra(_backdrive, 0.15, 0.5, _LOADED),
    "position_ripple": Extra(_ripple, 0.2, 2.0),
    "position_dependent_friction": Extra(
        lambda m, r, s: {"slope": s * sign(r), "bowl": s * r.uniform(-0.5, 0.5)}, 0.3, 0.8
    ),
    "position_stiffness": Extra(_spring, 0.3, 3.0),
    "thermal_drift": Extra(lambda m, r, s: {"thermal": s}, 0.02, 0.08, needs=frozenset({"warm"})),
    "stribeck_shape": Extra(_exponent, 0.8, 1.0),
    "backlash": Extra(
        lambda m, r, s: {"behind": s, "gap": m.axis.half_stroke * between(r, 0.02, 0.08)},
        0.4,
        0.8,
        _FREE,
        frozenset({"nested"}),
        stiff=True,
        least_rate=100,
    ),
    "hysteresis": Extra(_hysteresis, 0.3, 1.5, (), frozenset({"nested"}), stiff=True),
    "compliance": Extra(_compliance, 1.0, 3.0, (), frozenset({"fast"}), stiff=True, least_rate=100),
    "transport_delay": Extra(
        lambda m, r, s: {"delay": s}, 0.01, 0.04, (), frozenset({"fast"}), least_rate=100
    ),
    "torque_constant_saturation": Extra(
        lambda m, r, s: {"saturation": s / m.drive.limit}, 0.2, 0.7, _LOADED, current=True
    ),
    "external_periodic": Extra(_periodic, 0.2, 1.0),
    "tilt_misalignment": Extra(
        lambda m, r, s: {"tilt_alpha": s * sign(r)}, 0.06, 0.2, ("slide",), frozenset({"tilt"})
    ),
    "breakaway_dwell": Extra(_dwell, 1.0, 3.0, _FREE, frozenset({"pauses"}), stiff=True, least_rate=100),
}


def _bump(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    half = m.axis.half_stroke
    return {
        "bump": s * sign(r) * m.axis.coulomb,
        "bump_at": r.uniform(-0.4, 0.4) * half,
        "bump_width": r.uniform(0.06, 0.15) * half,
    }


def _tooth(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    half = m.axis.half_stroke
    return {
        "tooth": s * sign(r) * m.axis.coulomb,
        "bump_at": r.uniform(-0.3, 0.3) * half,
        "tooth_pitch": 10.0 * half if m.linear else 2.0 * math.pi,
        "tooth_width": r.uniform(0.025, 0.05) * half,
    }


def _walk(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    steps = np.cumsum(r.standard_normal(400))
    return {"walk": s * m.axis.coulomb * 0.3 * steps}


def _wear(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    seconds = m.axis.warm_up / WARM_UP_SHARE
    return {"wear": s * m.axis.coulomb, "wear_from": r.uniform(0.3, 0.7) * seconds}


def _resonances(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    first = 2.0 * math.pi * r.uniform(2.0, 3.5)
    return {"second_inertia": s * m.axis.inertia, "second_omega": first, "third_omega": 2.4 * first}


def _speed_bump(m: Machine, r: np.random.Generator, s: float) -> dict[str, Any]:
    return {
        "speed_bump": s * m.axis.coulomb,
        "speed_bump_at": r.uniform(0.4, 0.75) * m.speed,
        "speed_bump_width": r.uniform(0.04, 0.1) * m.speed,
    }


DISTURBANCES: dict[str, Extra] = {
    "position bump": Extra(_bump, 0.3, 1.5, depends_on=("position",)),
    "damaged tooth": Extra(_tooth, 0.5, 3.0, depends_on=("position",), least_rate=100),
    "random walk": Extra(
        _walk,
        0.3,
        1.0,
        depends_on=("time", "order", "velocity", "direction"),
    ),
    "sudden wear": Extra(_wear, 0.3, 1.5, depends_on=("time", "order", "velocity", "direction")),
    "grip under high payload": Extra(
        lambda m, r, s: {"grip": s * m.axis.coulomb, "grip_from": r.uniform(0.7, 1.1)},
        0.6,
        3.0,
        ("slide",),
        depends_on=("load",),
    ),
    "second resonance": Extra(
        _resonances,
        0.5,
        2.0,
        needs=frozenset({"fast"}),
        stiff=True,
        least_rate=200,
        depends_on=("time", "order", "acceleration", "velocity"),
        partly=("compliance",),
    ),
    "bump at one speed": Extra(_speed_bump, 0.4, 1.5, depends_on=("velocity",)),
}


def real_machine(m: Machine, p: Plant, r: np.random.Generator, s: float) -> Plant:
    """Everything that a geared joint with a cable has at once; `s` scales all of it."""
    coulomb, half = m.axis.coulomb, m.axis.half_stroke
    most = highest_line(m)
    families = [between(r, 0.05, 0.12) * most, between(r, 0.2, 0.35) * most]
    if not m.linear:
        families.append(1.0)  # once per turn
    lines = []
    for n in families:
        size = s * coulomb * r.uniform(0.4, 1.0)
        turn = r.normal(0.0, 0.5)
        lines.append([n, size, r.uniform(-math.pi, math.pi), turn])
        if n > 1.0:
            lines.append([2.0 * n, 0.4 * size, r.uniform(-math.pi, math.pi), turn])
    spring = s * sign(r) * coulomb / half
    plant = p._replace(lines=np.array(lines)).with_numbers(
        spring=0.8 * spring,
        spring_cubic=1.5 * spring / half**2,
        spring_neutral=r.uniform(-0.3, 0.3) * half,
        slope=s * sign(r),
        bowl=s * r.uniform(-0.6, 0.6),
        asymmetry=0.8 * s * sign(r) * coulomb / m.speed,
    )
    return plant.with_numbers(mu=0.4 * s) if m.kind in _LOADED else plant


REAL_MACHINE = (
    "position_ripple",
    "position_stiffness",
    "position_dependent_friction",
    "direction_asymmetry",
    "load_dependent_friction",
)
