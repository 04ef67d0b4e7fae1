"""A result folder made from arrays: what `identify` leaves behind, in small.

The axis is a formula of this file (a friction level, a slope, gravity and a ripple over the position),
so that what the report must say is known beforehand.
"""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

import numpy as np

from idtool.parameters import Controller, EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis

CYCLES = 35.0
AMPLITUDE = 0.012
NOISE = 0.002
RATE = 40.0
SINES = (0.5, 1.0, 1.5, 2.0)
OPTIONAL = ("position", "acceleration", "load", "payload_kg", "temperature_degc")


def make(folder: Path, kind: str = "rotary", *, ripple: bool = True) -> Path:
    """Write a whole folder; tests then take away or spoil what they want."""
    folder.mkdir(parents=True, exist_ok=True)
    parameters(kind, ripple=ripple).write(folder / "params.toml", force=True)
    rows = table(ripple=ripple)
    write_rows(folder, rows)
    write_json(folder, "diagnosis", diagnosis(rows, kind, ripple=ripple))
    write_json(folder, "evidence", evidence(rows, kind, ripple=ripple))
    return folder


def known(value: float, share: float = 0.01, **flags: Any) -> Parameter:
    """An identified number with a standard error of that share."""
    error = abs(value) * share
    return Parameter(value, error, (value - 1.96 * error, value + 1.96 * error), **flags)


def parameters(kind: str, *, ripple: bool) -> Parameters:
    effects = [EffectEntry("inertia", {"inertia": known(0.0099)})]
    if ripple:
        numbers = {
            "cycles": CYCLES,
            "amplitude_1": AMPLITUDE,
            "phase_1": 1.2,
            "amplitude_2": 0.002,
            "phase_2": -0.5,
        }
        effects.append(
            EffectEntry("position_ripple", {name: known(value) for name, value in numbers.items()})
        )
    constant = 2.67 if kind == "rotary" else None
    return Parameters(
        axis=Axis("linear" if kind == "linear" else "rotary", constant),
        gravity_model="slide",
        gravity={"base": known(0.23, 0.002), "per_payload": known(0.447, 0.001)},
        static={
            "coulomb": known(0.08055),
            "static": known(0.1128),
            "stribeck_velocity": known(0.1167),
            "viscous": known(0.1133),
        },
        dynamic={
            "bristle_stiffness": known(4.53, 0.3, at_bound=True),
            "bristle_damping": known(0.249, 0.4, identified=False),
        },
        effects=tuple(effects),
        controller=Controller(2.05, 1.68, 0.01),
        provenance={"fit": {"method": "joint"}},
    )


def table(*, ripple: bool) -> dict[str, np.ndarray]:
    """The rows: payload steps, two sweeps and four sines, one trial of each kind held out."""
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 6.0, 1.0 / RATE)
    there_and_back = np.sign(np.sin(2 * np.pi * time / 3))
    trials = [("gravity", payload, 0.2 * there_and_back, payload == 1.0) for payload in (0.0, 0.5, 1.0, 1.5)]
    trials += [("sweep", 0.0, speed * there_and_back, speed == 0.25) for speed in (0.1, 0.25, 0.39)]
    trials += [("sine", 0.0, 0.6 * np.sin(2 * np.pi * f * time), f == 1.0) for f in SINES]
    parts = []
    for number, (experiment, payload, velocity, held_out) in enumerate(trials):
        position = np.cumsum(velocity) / RATE
        friction = 0.08 * np.tanh(velocity / 0.02) + 0.113 * velocity
        load = np.full(len(time), 0.23 + 0.447 * payload if experiment == "gravity" else 0.0)
        before = load + friction
        wave = AMPLITUDE * np.sin(CYCLES * position) if ripple else 0.0
        parts.append(
            {
                "trial": np.full(len(time), number),
                "experiment": np.full(len(time), experiment, dtype=object),
                "time_s": time + 6.5 * number,
                "position": position,
                "velocity": velocity,
                "acceleration": np.gradient(velocity, 1.0 / RATE),
                "load": load,
                "payload_kg": np.full(len(time), payload),
                "temperature_degc": 25.0 + 0.05 * (time + 6.5 * number),
                "torque": before + wave + NOISE * rng.standard_normal(len(time)),
                "before": before,
                "after": before + wave,
                "held_out": np.full(len(time), int(held_out)),
            }
        )
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def diagnosis(rows: dict[str, np.ndarray], kind: str, *, ripple: bool) -> dict[str, Any]:
    held = rows["held_out"] == 1
    effects = [{"name": "inertia", "p_value": 1e-30, "alternatives": [], "parameters": {}}]
    if ripple:
        effects.append({"name": "position_ripple", "p_value": 3e-9, "alternatives": ["external_periodic"]})
    return {
        "schema": "ffc-id/diagnosis/1",
        "verdict": "effect_found" if ripple else "adequate",
        "effects": effects,
        "error": {
            "metric": "rmse_n" if kind == "linear" else "rmse_nm",
            "held_out": _pair(rows, held),
            "training": _pair(rows, ~held),
            "by_experiment": {
                name: _pair(rows, held & (rows["experiment"] == name))
                for name in ("gravity", "sweep", "sine")
            },
            "noise_floor": NOISE,
        },
        "unexplained": None,
        "candidates": [
            {
                "name": "position_ripple",
                "held_out": 0.002,
                "p_value": 3e-9,
                "accepted": ripple,
                "why": "lowest error",
            },
            {
                "name": "thermal_drift",
                "held_out": 0.009,
                "p_value": 0.8,
                "accepted": False,
                "why": "error rises",
            },
            {
                "name": "tilt_misalignment",
                "held_out": None,
                "p_value": None,
                "accepted": False,
                "why": "one tilt only",
            },
        ],
        "next_experiment": {
            "recipe": {"experiment": "sweep", "speeds_rad_s": [0.02, 0.4], "nothing": None},
            "separates": ["position_ripple", "external_periodic"],
        },
        "a_key_of_tomorrow": {"more": [1, 2]},
    }


def _pair(rows: dict[str, np.ndarray], which: np.ndarray) -> dict[str, float]:
    return {
        name: float(np.sqrt(np.mean((rows["torque"] - rows[name])[which] ** 2)))
        for name in ("before", "after")
    }


def evidence(rows: dict[str, np.ndarray], kind: str, *, ripple: bool) -> dict[str, Any]:
    speeds = [sign * speed for speed in (0.1, 0.2, 0.3, 0.4) for sign in (1, -1)]
    curve = np.concatenate([np.linspace(-0.45, -0.01, 30), np.linspace(0.01, 0.45, 30)])
    torque = np.sign(curve) * (0.08 + 0.03 * np.exp(-((curve / 0.1) ** 2))) + 0.113 * curve
    names = ["coulomb", "viscous", "inertia", "position_ripple.sin_1"]
    stiffness = np.logspace(-1, 3, 20)
    return {
        "kind": kind,
        "friction": "lugre",
        "filter": {"bandwidth_hz": 20.0, "rate_hz": RATE},
        "logs": [
            {"file": f"{name}.csv", "sha256": "ab" * 32, "rows": 9000, "trials": 4, "experiment": name}
            for name in ("gravity", "sweep", "sine")
        ],
        "notes": ["231 rows were left out: the command stepped faster than the sampling shows."],
        "stribeck_points": [
            {"velocity": v, "torque": np.sign(v) * 0.08 + 0.113 * v, "stderr": 0.001, "steady": abs(v) > 0.15}
            for v in speeds
        ],
        "stribeck_curve": {
            "velocity": curve.tolist(),
            "torque": torque.tolist(),
            "low": (torque - 0.004).tolist(),
            "high": (torque + 0.004).tolist(),
        },
        "gravity_points": [
            {"payload_kg": m, "torque": 0.23 + 0.447 * m + 0.001, "stderr": 0.001}
            for m in (0.0, 0.5, 1.0, 1.5)
        ],
        "cost_over_sigma0": {
            "sigma0": stiffness.tolist(),
            "rmse": (0.002 + 0.001 * np.log10(stiffness / 4.53) ** 2).tolist(),
            "best": 4.53,
        },
        "correlation": {
            "names": names,
            "matrix": [[1, -0.93, 0, 0.1], [-0.93, 1, 0.2, 0], [0, 0.2, 1, 0], [0.1, 0, 0, 1]],
        },
        "residual_tests": {
            "before": [{"variable": "position", "p_value": 1e-20 if ripple else 0.4, "share": 0.9}],
            "after": [{"variable": "position", "p_value": 0.3, "share": 0.01}],
        },
        "cumulative_periodograms": {
            name: [
                {
                    "over": over,
                    "frequency": [0.0, 0.5, 1.0],
                    "power": [0.0, rise, 1.0],
                    "white": [0.0, 0.5, 1.0],
                    "band": 0.1,
                    "p_value": p_value,
                }
                for over in ("time", "angle")
            ]
            for name, rise, p_value in (("before", 0.9, 1e-9), ("after", 0.52, 0.6))
        },
        "command": "ffc-id identify gravity.csv sweep.csv sine.csv -o result",
        "versions": {"ffc-id": "0.1.0", "numpy": "2.4.6"},
        "seed": 0,
    }


def write_rows(folder: Path, rows: dict[str, np.ndarray]) -> None:
    lines = [",".join(rows)]
    lines += [",".join(str(value) for value in row) for row in zip(*rows.values(), strict=True)]
    (folder / "evidence.csv.gz").write_bytes(gzip.compress("\n".join(lines).encode() + b"\n", 1))


def write_json(folder: Path, name: str, document: dict[str, Any]) -> None:
    (folder / f"{name}.json").write_text(json.dumps(document, default=float), encoding="utf-8")


def read_json(folder: Path, name: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
    return document
