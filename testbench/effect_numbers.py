"""Numbers of every effect that the controller compensates, in the keys of the parameter file."""

from __future__ import annotations

NUMBERS: dict[str, dict[str, float]] = {
    "inertia": {"inertia": 0.02},
    "torque_offset": {"offset": 0.03},
    "direction_asymmetry": {"asymmetry": 0.02},
    "nonlinear_viscous": {"quadratic": 0.1},
    "transport_delay": {"delay": 0.012},
    "torque_constant_saturation": {"kappa": 0.03},
    "stribeck_shape": {"exponent": 1.2},
    "load_dependent_friction": {"mu": 0.1, "doubling_load": 0.4},
    "drive_backdrive": {"mu_drive": 0.1, "mu_backdrive": 0.03},
    "tilt_misalignment": {"alpha": 0.05, "beta": -0.03},
    "position_stiffness": {"stiffness": 0.05, "neutral": 0.4},
    "position_dependent_friction": {"slope_1": 0.3, "slope_2": 0.1, "center": 0.2, "half_stroke": 1.5},
    "backlash": {
        "gap": 0.05,
        "share_behind_gap": 0.5,
        "share_under_load": 0.2,
        "share_at_once": 0.3,
        "load_scale": 0.3,
    },
    "hysteresis": {"stiffness": 0.5, "yield": 0.02},
    "breakaway_dwell": {"gain": 0.5, "time_constant": 0.5, "rest_speed": 0.02, "wear": 0.05},
    "compliance": {"stiffness": 4.0, "damping": 0.02, "load_inertia": 0.01},
    "thermal_drift": {"rate": 0.02, "reference": 25.0},
    "position_ripple": {
        "cycles": 7.0,
        "amplitude_1": 0.03,
        "phase_1": 0.4,
        "amplitude_2": 0.01,
        "phase_2": 1.0,
    },
}

#: Richer forms of some of them.
RICHER: dict[str, dict[str, dict[str, float]]] = {
    "families": {
        "position_ripple": NUMBERS["position_ripple"]
        | {f"family_2_{name}": 1.5 * value for name, value in NUMBERS["position_ripple"].items()}
    },
    "a_line_without_its_double": {
        "position_ripple": {
            name: value
            for name, value in NUMBERS["position_ripple"].items()
            if name not in ("amplitude_2", "phase_2")
        }
    },
    "another_phase_backwards": {
        "position_ripple": NUMBERS["position_ripple"] | {"turned_amplitude_1": 0.02, "turned_phase_1": 0.3}
    },
    "cable": {
        "position_stiffness": NUMBERS["position_stiffness"]
        | {"shape_2": 0.03, "shape_3": -0.02, "center": 0.2, "half_stroke": 1.5}
    },
    "uneven_friction": {
        "position_dependent_friction": NUMBERS["position_dependent_friction"]
        | {"slope_3": 0.2, "slope_4": -0.1}
    },
    "friction_of_one_place": {
        "position_dependent_friction": NUMBERS["position_dependent_friction"]
        | {f"slope_{k}": 0.2 * (-0.7) ** k for k in range(3, 9)}
    },
    "drag_beyond_what_was_moved": {"nonlinear_viscous": NUMBERS["nonlinear_viscous"] | {"fastest": 0.15}},
    "two_elements": {"hysteresis": NUMBERS["hysteresis"] | {"stiffness_2": 0.1, "yield_2": 0.01}},
    "payload_that_is_accelerated": {"inertia": NUMBERS["inertia"] | {"per_payload": 0.05}},
    "part_of_the_friction": {"hysteresis": NUMBERS["hysteresis"] | {"of_friction": 1.0}},
}
