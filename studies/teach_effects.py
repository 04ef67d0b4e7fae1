"""What an effect in the file is worth in newtons: the same axis and hand with the base and the extended file.

One effect at a time on `sim:paper`, strong enough to be felt. The measure is what the hand has to do beyond
the file without any effect on an axis without any: mean force, and how unevenly it must push.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from idtool.parameters import Controller
from studies.guided_plants import PAYLOAD_KG, Case, file_of, plant_of
from studies.teach import GAINS, PERIOD, Guided, guide

#: effect -> its numbers in the plant, half of the friction or so
STRONG: dict[str, dict[str, float]] = {
    "torque_offset": {"offset_nm": 0.06},
    "direction_asymmetry": {"asymmetry_nm_s_per_rad": 0.12},
    "nonlinear_viscous": {"quadratic_nm_s2_per_rad2": 0.3},
    "torque_constant_saturation": {"kappa_per_a": 0.4},
    "stribeck_shape": {"exponent": 0.6},
    "load_dependent_friction": {"mu": 0.12},
    "drive_backdrive": {"mu_drive": 0.15, "mu_backdrive": 0.04},
    "tilt_misalignment": {"alpha_rad": 0.5, "beta_rad": 0.0},
    "position_stiffness": {"stiffness_nm_per_rad": 0.1, "neutral_rad": 0.0},
    "position_dependent_friction": {
        "slope_1": 0.6,
        "slope_2": 0.0,
        "center_rad": 0.0,
        "half_stroke_rad": 2.3,
    },
    "thermal_drift": {"rate_per_k": 0.04, "reference_degc": 10.0},
    "position_ripple": {
        "cycles_per_turn": 9.0,
        "amplitude_1_nm": 0.03,
        "phase_1_rad": 0.5,
        "amplitude_2_nm": 0.0,
        "phase_2_rad": 0.0,
    },
    "backlash": {"gap_rad": 0.1, "share_behind_gap": 0.6},
}


def felt(run: Guided) -> tuple[float, float]:
    """Mean force of the pushes, and how far it is from that over their last seconds, N rms."""
    spread = [p.uneven**2 + (p.force - run.force) ** 2 for p in run.pushes]
    return run.force, float(np.sqrt(np.mean(spread)))


def compare(effect: str, *, mode: str, seeds: int = 3) -> tuple[tuple[float, float], tuple[float, float]]:
    """(force, unevenness) in N with the base file and with the extended file."""
    gains = GAINS if mode == "light" else Controller(2.05, 1.68, PERIOD)
    plant = replace(plant_of("paper"), effects={effect: STRONG[effect]})
    results = []
    for known in (False, True):
        values = []
        for seed in range(seeds):
            case = Case(
                "paper",
                plant,
                file_of(plant, gains, effects=known),
                PAYLOAD_KG,
                0.0,
                1000.0,
                20.0,
                0.0,
                0.0,
                (1.0, 1.0),
                (effect,),
                known,
                seed,
            )
            values.append(felt(guide(case, tared=mode == "light", ramps=False)))
        force, uneven = np.mean(values, axis=0)
        results.append((float(force), float(uneven)))
    return results[0], results[1]


def effects_section() -> list[str]:
    """The part of docs/teach.md."""
    lines = [
        "## What an effect in the file is worth",
        "",
        "`sim:paper` with one strong effect, a hand of 1000 N/m, readings in time: force of the hand at",
        "19.2 mm/s and how far it strays from that over and between four pushes (rms), with the base file",
        "and with the file that holds the effect. The light mode was tared with either file, and a tare",
        "takes in what is constant over 9 mm.",
        "",
        "| effect | published law: base file, N | extended, N | light: base file, N | extended, N |",
        "|---|---:|---:|---:|---:|",
    ]
    for effect in STRONG:
        cells = [
            f"{force:.2f} ± {uneven:.2f}"
            for mode in ("paper", "light")
            for force, uneven in compare(effect, mode=mode)
        ]
        lines.append(f"| `{effect}` | {' | '.join(cells)} |")
    return [*lines, ""]
