"""Sessions on simulated rigs, each with one effect that nothing declares: which one is named."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool import Log, identify
from idtool.experiment.recipe import Changes, read_recipe
from idtool.experiment.runner import run
from idtool.rig import open_rig

PLANT = """
description = "bench"
period_s = 0.005
sensors = "{sensors}"
[axis]
kind = "rotary"
torque_constant_nm_per_a = 2.67
[plant]
inertia_kg_m2 = 0.008
[gravity]
kind = "slide"
base_nm = 0.20
per_payload_nm_per_kg = 0.42
[friction]
coulomb_nm = 0.080
static_nm = 0.115
stribeck_velocity_rad_s = 0.08
viscous_nm_s_per_rad = 0.12
bristle_stiffness_nm_per_rad = 8.0
bristle_damping_nm_s_per_rad = 0.2
[limits]
lowest_rad = -2.5
highest_rad = 2.5
speed_rad_s = 2.0
current_a = 1.5
[temperature]
ambient_degc = 25.0
rise_k = 12.0
time_constant_s = 200.0
sensor = true
"""

#: effect, its parameters in the plant, the parameter to compare and its tolerance (relative)
CASES = [
    ("inertia", {"inertia_kg_m2": 0.004}, None, 0.0),
    ("torque_offset", {"offset_nm": 0.02}, "offset_nm", 0.03),
    ("direction_asymmetry", {"asymmetry_nm_s_per_rad": 0.05}, "asymmetry_nm_s_per_rad", 0.03),
    ("load_dependent_friction", {"mu": 0.08}, "mu", 0.03),
    (
        "position_ripple",
        {
            "cycles_per_turn": 31.0,
            "amplitude_1_nm": 0.015,
            "phase_1_rad": 0.3,
            "amplitude_2_nm": 0.0,
            "phase_2_rad": 0.0,
        },
        "amplitude_1_nm",
        0.03,
    ),
    ("position_stiffness", {"stiffness_nm_per_rad": 0.03, "neutral_rad": 0.4}, "stiffness_nm_per_rad", 0.03),
    ("thermal_drift", {"rate_per_k": 0.03, "reference_degc": 25.0}, "rate_per_k", 0.05),
    ("nonlinear_viscous", {"quadratic_nm_s2_per_rad2": 0.1}, "quadratic_nm_s2_per_rad2", 0.1),
    ("transport_delay", {"delay_s": 0.01}, "delay_s", 0.1),
    ("backlash", {"gap_rad": 0.05, "share_behind_gap": 0.5}, "gap_rad", 0.02),
    (
        "compliance",
        {"stiffness_nm_per_rad": 3.0, "damping_nm_s_per_rad": 0.02, "load_inertia_kg_m2": 0.006},
        "stiffness_nm_per_rad",
        0.03,
    ),
    ("hysteresis", {"stiffness_nm_per_rad": 0.3, "yield_nm": 0.02}, "yield_nm", 0.03),
    # the time constant hangs on what counts as rest, which plant and fit set differently; so does the gain in
    # part since each rest has a start of its own: 0.70 and 0.78 at two seeds, with standard errors of 0.03
    ("breakaway_dwell", {"gain": 0.8, "time_constant_s": 1.0}, "gain", 0.15),
]

#: What tests/verbs/test_identification.py has no session of.
QUICK = ("hysteresis",)

#: The bench's bristle is stiff: a short travel is enough to be steady. Four payloads of sixteen tell gravity
#: and what goes with it.
SHORTER = {"sweep": Changes(travel=2.6), "gravity": Changes(payloads=(0.0, 0.5, 1.0, 1.5))}


def session(folder: Path, plant: str, seed: int, *more: str, payloads: bool = False) -> list[Log]:
    """Gravity, sweep, sine and more of a plant, run and read back; `payloads`: all of the recipe."""
    file = folder / "plant.toml"
    file.write_text(plant)
    logs = []
    with open_rig(f"sim:{file}", seed=seed) as rig:
        for name in ("gravity", "sweep", "sine", *more):
            log = folder / f"{name}.csv"
            shorter = None if payloads and name == "gravity" else SHORTER.get(name)
            run(read_recipe(name, shorter), rig, log)
            logs.append(Log.read(log))
    return logs


@pytest.mark.parametrize(
    ("name", "truth", "compared", "tolerance"),
    [pytest.param(*case, id=case[0], marks=[pytest.mark.long] * (case[0] not in QUICK)) for case in CASES],
)
def test_names_the_one_effect_that_nobody_declared(
    tmp_path: Path, name: str, truth: dict[str, float], compared: str | None, tolerance: float
) -> None:
    lines = "\n".join(f"{key} = {value}" for key, value in truth.items())
    plant = PLANT.format(sensors="lab") + f'[[effects]]\nname = "{name}"\n{lines}\n'
    more = ["pauses"] if name == "breakaway_dwell" else []  # nothing else shows it
    # what bends shows at reversals, and those of all payloads are needed
    diagnosis = identify(session(tmp_path, plant, 5, *more, payloads=name == "compliance")).diagnosis
    named = {effect["name"]: effect for effect in diagnosis["effects"]}
    assert set(named) - {"inertia"} == {name} - {"inertia"}
    held_out = diagnosis["error"]["held_out"]
    assert held_out["after"] < held_out["before"] or name == "inertia"  # which is in the base model
    assert held_out["after"] < 1.1 * diagnosis["error"]["noise_floor"]
    if compared is None:
        assert diagnosis["verdict"] == "adequate"
        assert named["inertia"]["parameters"]["inertia_kg_m2"]["value"] == pytest.approx(0.012, rel=0.03)
        return
    assert diagnosis["verdict"] in ("effect_found", "ambiguous")
    found = named[name]
    parameter = found["parameters"][compared]
    assert parameter["value"] == pytest.approx(truth[compared], rel=tolerance)
    # lying on its side without payload, an offset and a tilt error are the same thing: say so
    expected = ["tilt_misalignment"] if name == "torque_offset" else []
    assert found["alternatives"] == expected


@pytest.mark.long  # tests/verbs/test_identification.py has such sessions
@pytest.mark.parametrize("sensors", ["lab", "dynamixel"])
def test_keeps_quiet_on_an_axis_without_an_effect(tmp_path: Path, sensors: str) -> None:
    diagnosis = identify(session(tmp_path, PLANT.format(sensors=sensors), seed=7)).diagnosis
    assert diagnosis["verdict"] == "adequate"
    assert [effect["name"] for effect in diagnosis["effects"]] == ["inertia"]
    assert diagnosis["unexplained"] is None
