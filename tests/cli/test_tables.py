"""Tables of parameters."""

from __future__ import annotations

import io

from idtool.cli.screen import Screen
from idtool.cli.tables import print_parameters

from idtool import Axis, Parameters
from idtool.compare.comparison import ParameterLine
from idtool.fleet.page import label
from idtool.parameters import EffectEntry, Parameter


def test_a_parameter_that_is_not_determined_has_no_interval() -> None:
    told = io.StringIO()
    screen = Screen(200, told)
    dynamic = {
        "bristle_stiffness": Parameter(57.5, 0.68, (56.1, 59.0)).undetermined(at_least=40.0),
        "bristle_damping": Parameter(0.6, 0.01, (0.58, 0.62)),
    }
    static = {name: Parameter(0.1) for name in ("coulomb", "static", "stribeck_velocity", "viscous")}
    print_parameters(screen, Parameters(axis=Axis(), static=static, dynamic=dynamic), ("dynamic",))
    stiffness, damping = told.getvalue().splitlines()[1:]
    assert "57.5" in stiffness
    assert "not determined by these data" in stiffness
    assert not any(part in stiffness for part in ("0.68", "56.1", "59"))
    assert "at least 40" in stiffness
    assert "0.58 to 0.62" in damping


def test_the_level_at_standstill_is_called_stiction() -> None:
    """Not by its key in the file, which would read as the static part of a parameter file."""
    told = io.StringIO()
    screen = Screen(200, told)
    static = {name: Parameter(0.1) for name in ("coulomb", "static", "stribeck_velocity", "viscous")}
    print_parameters(screen, Parameters(axis=Axis(), static=static), ("static",))
    names = [line.split("  ")[0] for line in told.getvalue().splitlines()[1:]]
    assert names == ["coulomb", "stiction", "stribeck velocity", "viscous"]
    assert label("static_nm") == ("stiction", "N m")
    assert ParameterLine("static", "static", "N m", None, None).title == "stiction"


def test_inertia_is_no_effect_of_its_own() -> None:
    """It belongs to the base model, whichever part of a file keeps it."""
    effects = (
        EffectEntry("inertia", {"inertia": Parameter(0.0099)}),
        EffectEntry("torque_offset", {"offset": Parameter(0.01)}),
    )
    told = io.StringIO()
    screen = Screen(100, told)
    print_parameters(screen, Parameters(axis=Axis(), effects=effects), ("effects",))
    _, first, second, *_ = told.getvalue().splitlines()
    assert first.startswith("inertia  ")
    assert second.startswith("torque_offset: offset  ")
