"""From a plant file and a trial's set-up to the numbers of the compiled plant."""

from __future__ import annotations

import math

from idtool.rig.base import TrialSetup
from idtool.rig.plant import PlantNumbers
from idtool.rig.plant_file import EFFECT_KEYS, PlantFile

#: effect -> fields of PlantNumbers, in the order of its keys in `EFFECT_KEYS`
_FIELDS = {
    "torque_offset": ("offset",),
    "direction_asymmetry": ("asymmetry",),
    "load_dependent_friction": ("mu",),
    "drive_backdrive": ("mu_drive", "mu_backdrive"),
    "position_ripple": ("ripple_cycles", "ripple_1", "ripple_phase_1", "ripple_2", "ripple_phase_2"),
    "position_dependent_friction": ("slope_1", "slope_2", "stroke_center", "half_stroke"),
    "position_stiffness": ("spring", "spring_neutral"),
    "thermal_drift": ("thermal_rate", "thermal_reference"),
    "nonlinear_viscous": ("quadratic",),
    "stribeck_shape": ("exponent",),
    "backlash": ("gap", "gap_share"),
    "hysteresis": ("hysteresis_stiffness", "hysteresis_yield"),
    "compliance": ("compliance", "compliance_damping", "load_inertia"),
    "transport_delay": ("delay",),
    "torque_constant_saturation": ("kappa",),
    "external_periodic": ("periodic_frequency", "periodic_amplitude", "periodic_phase"),
    "breakaway_dwell": ("dwell_gain", "dwell_time"),
}


def plant_numbers(file: PlantFile, setup: TrialSetup) -> PlantNumbers:
    """The plant as it stands in one trial."""
    effects = file.effects
    more = effects.get("inertia", {})
    inertia = (
        file.inertia + more.get("inertia_kg_m2", 0.0) + more.get("per_payload_m2", 0.0) * setup.payload_kg
    )
    off = effects.get("tilt_misalignment", {"alpha_rad": 0.0, "beta_rad": 0.0})
    tilt = math.cos(setup.tilt_alpha_rad + off["alpha_rad"]) * math.cos(setup.tilt_beta_rad + off["beta_rad"])
    constant, sine, cosine = _gravity(file, setup.payload_kg)
    friction, drive, warm = file.friction, file.drive, file.temperature
    assert file.axis.torque_constant is not None  # checked where the file is read
    # the whole moving inertia is what the drive was tuned for; the integral is critically damped
    whole = inertia + effects.get("compliance", {}).get("load_inertia_kg_m2", 0.0)
    bandwidth = 2.0 * math.pi * drive.velocity_bandwidth_hz
    extra = {
        field: effects[name][key]
        for name in effects.keys() & _FIELDS.keys()
        for field, key in zip(_FIELDS[name], EFFECT_KEYS[name], strict=True)
    }
    ambient = warm["ambient_degc"] if setup.temperature_degc is None else setup.temperature_degc
    return PlantNumbers(
        torque_constant=file.axis.torque_constant,
        inertia=inertia,
        gravity=constant * tilt,
        gravity_sine=sine * tilt,
        gravity_cosine=cosine * tilt,
        coulomb=friction["coulomb_nm"],
        static=friction["static_nm"],
        stribeck_velocity=friction["stribeck_velocity_rad_s"],
        viscous=friction["viscous_nm_s_per_rad"],
        bristle_stiffness=friction["bristle_stiffness_nm_per_rad"],
        bristle_damping=friction["bristle_damping_nm_s_per_rad"],
        position_gain=drive.position_gain_per_s,
        velocity_gain=whole * bandwidth,
        integral_gain=whole * bandwidth * bandwidth / 4.0,
        feedforward=whole,
        velocity_profile_acceleration=drive.velocity_profile_rad_s2,
        position_profile_acceleration=drive.position_profile_rad_s2,
        speed_limit=file.limits["speed_rad_s"],
        current_limit=file.limits["current_a"],
        lowest=file.limits["lowest_rad"],
        highest=file.limits["highest_rad"],
        ambient=ambient,
        rise=warm["rise_k"],
        warm_up=warm["time_constant_s"],
        **extra,
    )


def _gravity(file: PlantFile, payload: float) -> tuple[float, float, float]:
    """Gravity torque without tilt: constant, coefficient of sin q and of cos q, N m."""
    g = file.gravity
    if file.gravity_kind == "slide":
        return g["base_nm"] + g["per_payload_nm_per_kg"] * payload, 0.0, 0.0
    return (
        0.0,
        g["sine_nm"] + g["sine_per_payload_nm_per_kg"] * payload,
        g["cosine_nm"] + g["cosine_per_payload_nm_per_kg"] * payload,
    )
