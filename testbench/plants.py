"""Random axes and the sessions recorded on them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from idtool.experiment.recipe import Recipe, read_recipe
from idtool.experiment.runner import run
from idtool.experiment.trajectory import BackAndForth
from idtool.log import Log
from idtool.parameters.axis import Axis
from idtool.rig.base import Rig
from idtool.rig.plant_file import PlantFile
from idtool.rig.simulated import SimulatedRig
from testbench.draws import between

#: The packaged experiments that a session consists of.
SESSION = ("gravity", "sweep", "sine")

TORQUE_CONSTANT = 2.67


@dataclass(frozen=True)
class Plant:
    """The truth of one axis, in the names of the parameter file."""

    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float
    bristle_stiffness: float
    bristle_damping: float
    inertia: float
    base: float
    per_payload: float
    effects: dict[str, dict[str, float]] = field(default_factory=dict)

    def to_file(self, sensors: str, *, temperature: bool = True) -> PlantFile:
        """As the simulated rig takes it."""
        return PlantFile(
            description="random axis",
            axis=Axis("rotary", TORQUE_CONSTANT),
            inertia=self.inertia,
            gravity_kind="slide",
            gravity={"base_nm": self.base, "per_payload_nm_per_kg": self.per_payload},
            friction={
                "coulomb_nm": self.coulomb,
                "static_nm": self.static,
                "stribeck_velocity_rad_s": self.stribeck_velocity,
                "viscous_nm_s_per_rad": self.viscous,
                "bristle_stiffness_nm_per_rad": self.bristle_stiffness,
                "bristle_damping_nm_s_per_rad": self.bristle_damping,
            },
            limits={"lowest_rad": -2.5, "highest_rad": 2.5, "speed_rad_s": 2.0, "current_a": 1.5},
            temperature={"ambient_degc": 25.0, "rise_k": 8.0, "time_constant_s": 300.0},
            temperature_sensor=temperature,
            effects=self.effects,
            sensors=sensors,
            period_s=0.001,
        )


def random_plant(rng: np.random.Generator) -> Plant:
    """An axis drawn from a wide range of small servo axes, from bristles of the paper's softness on.

    The Stribeck curve falls or rises by 15 to 50 %; the friction model is passive, as a real axis is.
    """
    while True:
        coulomb = between(rng, 0.04, 0.15)
        ratio = between(rng, 1.15, 1.6)
        static = coulomb * (ratio if rng.random() < 0.7 else 1.0 / ratio)
        plant = Plant(
            coulomb=coulomb,
            static=static,
            stribeck_velocity=between(rng, 0.04, 0.12),
            viscous=between(rng, 0.08, 0.25),
            bristle_stiffness=max(coulomb, static) / between(rng, 0.01, 1.0),
            bristle_damping=between(rng, 0.1, 0.35),
            inertia=between(rng, 0.004, 0.015),
            base=between(rng, 0.1, 0.3),
            per_payload=between(rng, 0.3, 0.6),
        )
        if plant.viscous > 1.2 * plant.bristle_damping * (static - coulomb) / coulomb:
            return plant


def either_bristle(plant: Plant, rng: np.random.Generator) -> Plant:
    """The same axis with a bristle as soft as the paper's (1.4 rad) as often as with a stiff one."""
    bends = between(rng, 0.4, 1.5) if rng.random() < 0.5 else between(rng, 0.005, 0.05)
    return replace(plant, bristle_stiffness=max(plant.coulomb, plant.static) / bends)


def record_session(
    plant: Plant,
    sensors: str,
    seed: int,
    recipes: tuple[str | Path, ...] = SESSION,
    *,
    temperature: bool = True,
    hard: bool = False,
) -> list[Log]:
    """Record a session on the axis; `hard` takes all ramps of the moves ten times as fast."""
    rig = SimulatedRig(plant.to_file(sensors, temperature=temperature), seed=seed)
    plans = [read_recipe(str(recipe)) for recipe in recipes]
    return recorded(rig, map(_harder, plans) if hard else plans)


def recorded(rig: Rig, recipes: Iterable[Recipe]) -> list[Log]:
    """Run recipes on a rig one after another, as `ffc-id demo` does, and read the logs back."""
    logs = []
    with tempfile.TemporaryDirectory() as folder, rig:
        for recipe in recipes:
            path = Path(folder) / f"{recipe.name}.csv"
            run(recipe, rig, path)
            logs.append(Log.read(path))
    return logs


def _harder(recipe: Recipe) -> Recipe:
    trials = tuple(
        replace(trial, motion=replace(trial.motion, acceleration=10.0 * trial.motion.acceleration))
        if isinstance(trial.motion, BackAndForth)
        else trial
        for trial in recipe.trials
    )
    return replace(recipe, trials=trials)
