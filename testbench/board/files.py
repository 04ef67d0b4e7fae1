"""The parameter files that are measured: an ordinary gearbox, and numbers for every effect."""

from __future__ import annotations

from dataclasses import replace

from idtool.parameters import Controller, EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from testbench.effect_numbers import NUMBERS


def stated(**values: float) -> dict[str, Parameter]:
    """Numbers that nobody identified, as a file holds them."""
    return {name: Parameter(value) for name, value in values.items()}


BASE = Parameters(
    axis=Axis("rotary", 2.67),
    gravity_model="slide",
    gravity=stated(base=0.23, per_payload=0.4455),
    static=stated(coulomb=0.05, static=0.075, stribeck_velocity=0.09, viscous=0.08),
    dynamic=stated(bristle_stiffness=8.0, bristle_damping=0.1),
)

#: As `ffc-id tune` writes it.
LIGHT = Controller(command_gain=2.05, loop_gain=8.0, period=0.01, mode="light")

#: In its simpler form friction under load is what most files hold.
EFFECTS = NUMBERS | {"load_dependent_friction": {"mu": 0.1}}


def with_effects(*names: str, light: bool = False) -> Parameters:
    """The base file and these effects, in the published or the light mode."""
    file = replace(BASE, controller=LIGHT) if light else BASE
    for name in names:
        numbers = stated(**EFFECTS[name])
        file = file.with_effect(EffectEntry(name, numbers))
    return file
