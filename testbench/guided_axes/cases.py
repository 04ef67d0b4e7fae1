"""Random axes to guide: what the file says, and what the axis really is.

The file is that of `sim:paper` or `sim:bench`. The axis differs from it by up to 30 % in friction and by up
to 0.02 kg in its payload, has effects that the file may know or not, a hand that is soft or stiff, and
readings that come late.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from idtool.model.units import STANDARD_GRAVITY, file_key
from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC, Controller, EffectEntry, Parameter, Parameters
from idtool.parameters.reading import effect_dimensions
from idtool.rig.opening import read_plant
from idtool.rig.plant_file import PlantFile

AXES = ("paper", "bench")
PAYLOAD_KG = 0.4

#: effect -> its numbers in a plant file, drawn at random; about 0.02 N m each at hand-guiding speed, a
#: quarter of the friction: what a diagnosis would be missed for
_DRAWS = {
    "torque_offset": lambda r: {"offset_nm": r.uniform(-0.03, 0.03)},
    "direction_asymmetry": lambda r: {"asymmetry_nm_s_per_rad": r.uniform(-0.05, 0.05)},
    "nonlinear_viscous": lambda r: {"quadratic_nm_s2_per_rad2": r.uniform(0.0, 0.1)},
    "torque_constant_saturation": lambda r: {"kappa_per_a": r.uniform(0.0, 0.1)},
    "stribeck_shape": lambda r: {"exponent": r.uniform(1.0, 3.0)},
    "load_dependent_friction": lambda r: {"mu": r.uniform(0.0, 0.05)},
    "drive_backdrive": lambda r: {"mu_drive": r.uniform(0.0, 0.05), "mu_backdrive": r.uniform(0.0, 0.05)},
    "tilt_misalignment": lambda r: {"alpha_rad": r.uniform(-0.1, 0.1), "beta_rad": 0.0},
    "position_stiffness": lambda r: {"stiffness_nm_per_rad": r.uniform(0.0, 0.03), "neutral_rad": 0.0},
    "position_dependent_friction": lambda r: {
        "slope_1": r.uniform(-0.2, 0.2),
        "slope_2": 0.0,
        "center_rad": 0.0,
        "half_stroke_rad": 2.3,
    },
    "thermal_drift": lambda r: {"rate_per_k": r.uniform(0.0, 0.02), "reference_degc": 35.0},
    "position_ripple": lambda r: {
        "cycles_per_turn": r.uniform(6.0, 40.0),
        "amplitude_1_nm": r.uniform(0.0, 0.015),
        "phase_1_rad": r.uniform(-3.1, 3.1),
        "amplitude_2_nm": 0.0,
        "phase_2_rad": 0.0,
    },
    "external_periodic": lambda r: {
        "frequency_hz": r.uniform(0.2, 3.0),
        "amplitude_nm": r.uniform(0.0, 0.006),
        "phase_rad": 0.0,
    },
    "backlash": lambda r: {"gap_rad": r.uniform(0.01, 0.05), "share_behind_gap": r.uniform(0.1, 0.4)},
    "compliance": lambda r: {
        "stiffness_nm_per_rad": r.uniform(20.0, 60.0),
        "damping_nm_s_per_rad": 0.02,
        "load_inertia_kg_m2": 0.002,
    },
    "hysteresis": lambda r: {"stiffness_nm_per_rad": r.uniform(0.2, 1.0), "yield_nm": r.uniform(0.0, 0.015)},
    "breakaway_dwell": lambda r: {"gain": r.uniform(0.0, 0.3), "time_constant_s": 1.0},
}
#: What no file is told of, so that the law has to live with it.
UNTOLD = ("hysteresis", "breakaway_dwell")
EFFECTS = tuple(_DRAWS)


@dataclass(frozen=True)
class Case:
    """One axis, its file and its hand.

    Attributes:
        truth: the plant.
        file: what the controller is given.
        payload: kg that it really carries; the controller is told `PAYLOAD_KG`.
        bristle: its deflection at the start, as a share of the most that it can bend at rest.
        stiffness, damping: of the hand at the slide, N/m and N s/m.
        motion_delay, current_delay: s.
        seed: of the noise of its readings.
    """

    truth: PlantFile
    file: Parameters
    payload: float
    bristle: float
    stiffness: float
    damping: float
    motion_delay: float
    current_delay: float
    seed: int = 0

    @property
    def ratio(self) -> float:
        """Travel of the slide, m per rad."""
        return self.file.gravity["per_payload"].value / STANDARD_GRAVITY


def file_of(plant: PlantFile, controller: Controller | None = None, *, effects: bool = True) -> Parameters:
    """A parameter file that holds the plant exactly."""
    told = {name: numbers for name, numbers in plant.effects.items() if effects and name not in UNTOLD}
    if "backlash" in told:
        told["backlash"] = told["backlash"] | {"share_at_once": 0.0}
    entries = [EffectEntry(name, _named(effect_dimensions(name), numbers)) for name, numbers in told.items()]
    return Parameters(
        axis=plant.axis,
        gravity_model="slide",
        gravity=_named(GRAVITY_MODELS["slide"], plant.gravity),
        static=_named(STATIC, plant.friction),
        dynamic=_named(DYNAMIC, plant.friction),
        effects=(EffectEntry("inertia", {"inertia": Parameter(plant.inertia)}), *entries),
        controller=controller,
    )


def _named(dimensions: Mapping[str, str], numbers: Mapping[str, float]) -> dict[str, Parameter]:
    """Numbers of a plant file by the names of the parameter file."""
    keys = {name: file_key(name, dimension, "rotary") for name, dimension in dimensions.items()}
    return {name: Parameter(numbers[key]) for name, key in keys.items() if key in numbers}


def random_case(rng: np.random.Generator, controller: Controller, *, effects: str) -> Case:
    """An axis drawn at random.

    Args:
        rng: of the study.
        controller: gains of the file.
        effects: "none", "known" (the file holds them, each number 10 % off) or "unknown".
    """
    name = AXES[int(rng.integers(len(AXES)))]
    plant = read_plant(name)
    names: tuple[str, ...] = ()
    if effects != "none":
        pool = [e for e in EFFECTS if effects == "unknown" or e not in UNTOLD]
        names = tuple(str(e) for e in rng.choice(pool, size=int(rng.integers(1, 4)), replace=False))
        if {"load_dependent_friction", "drive_backdrive"} <= set(names):
            names = tuple(e for e in names if e != "load_dependent_friction")
    drawn = {e: {k: float(v) for k, v in _DRAWS[e](rng).items()} for e in names}
    told = {e: {k: v * _off(k, rng) for k, v in n.items()} for e, n in drawn.items()}
    file = file_of(replace(plant, effects=told), controller, effects=effects == "known")
    level, viscous, soft = rng.uniform(0.7, 1.3, 3).tolist()
    drive = replace(plant.drive, position_gain_per_s=float(rng.uniform(15.0, 25.0)))
    warm = {"ambient_degc": 35.0, "rise_k": float(rng.uniform(-10.0, 10.0)), "time_constant_s": 20.0}
    truth = replace(
        plant,
        friction=_scaled(plant.friction, level, viscous, soft),
        inertia=plant.inertia * float(rng.uniform(0.8, 1.2)),
        drive=drive,
        effects=drawn,
        temperature=warm if "thermal_drift" in names else plant.temperature,
    )
    stiffness = float(math.exp(rng.uniform(math.log(200.0), math.log(2000.0))))
    delay = float(rng.uniform(0.0, 0.02))
    return Case(
        truth=truth,
        file=file,
        payload=PAYLOAD_KG + float(rng.uniform(-0.02, 0.02)),
        bristle=float(rng.uniform(-0.9, 0.9)),
        stiffness=stiffness,
        damping=10.0 * (stiffness / 200.0) ** 0.6,
        motion_delay=delay,
        current_delay=delay if rng.random() < 0.5 else 0.0,
        seed=int(rng.integers(1 << 31)),
    )


def _scaled(
    friction: Mapping[str, float], level: float, viscous: float, stiffness: float
) -> dict[str, float]:
    """Friction of a plant file, its parts times these."""
    factors = {"stribeck_velocity_rad_s": 1.0, "bristle_stiffness_nm_per_rad": stiffness}
    factors |= dict.fromkeys(("coulomb_nm", "static_nm"), level)
    factors |= dict.fromkeys(("viscous_nm_s_per_rad", "bristle_damping_nm_s_per_rad"), viscous)
    return {key: value * factors[key] for key, value in friction.items()}


def _off(key: str, rng: np.random.Generator) -> float:
    """What a file's number is off by: strengths by up to 10 %, places and frequencies not at all."""
    strength = key in ("mu", "mu_drive", "mu_backdrive", "slope_1") or "_nm" in key
    return float(rng.uniform(0.9, 1.1)) if strength else 1.0


def corner(
    axis: str, controller: Controller, signs: tuple[int, ...], *, stiff: bool, delay: float, late: bool
) -> Case:
    """An axis in a corner of what is to be withstood: signs of friction level, viscous friction, payload."""
    plant = read_plant(axis)
    level, viscous, load = 1.0 + 0.3 * signs[0], 1.0 + 0.3 * signs[1], signs[2]
    friction = _scaled(plant.friction, level, viscous, level)
    return Case(
        truth=replace(plant, friction=friction),
        file=file_of(plant, controller),
        payload=PAYLOAD_KG + 0.02 * load,
        bristle=0.9,
        stiffness=2000.0 if stiff else 200.0,
        damping=40.0 if stiff else 10.0,
        motion_delay=delay,
        current_delay=delay if late else 0.0,
    )
