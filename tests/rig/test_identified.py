"""A parameter file runs as a rig, with what it says of effects; what it cannot be is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from idtool.cli.main import main

from idtool import Axis, InputError, Log, Parameters
from idtool.parameters import EffectEntry, Parameter
from idtool.rig import open_rig
from idtool.verbs.predict import predict


def known(**more: object) -> Parameters:
    values = {"coulomb": 0.08, "static": 0.12, "stribeck_velocity": 0.1, "viscous": 0.05}
    ripple = {"cycles": 6.0, "amplitude_1": 0.05, "phase_1": 0.3, "amplitude_2": 0.0, "phase_2": 0.0}
    return Parameters(
        axis=Axis("rotary", 2.0),
        gravity_model="slide",
        gravity={"base": Parameter(0.2), "per_payload": Parameter(0.4)},
        static={name: Parameter(value) for name, value in values.items()},
        dynamic={"bristle_stiffness": Parameter(20.0), "bristle_damping": Parameter(0.3)},
        effects=(
            EffectEntry("inertia", {"inertia": Parameter(0.02)}),
            EffectEntry("position_ripple", {name: Parameter(value) for name, value in ripple.items()}),
        ),
        **more,  # type: ignore[arg-type]
    )


def written(parameters: Parameters, folder: Path) -> Path:
    file = folder / "params.toml"
    parameters.write(file)
    return file


def test_it_runs_experiments_that_the_file_predicts(tmp_path: Path) -> None:
    file = written(known(), tmp_path)
    log = tmp_path / "sine.csv"
    with pytest.raises(SystemExit) as ended:
        main(["run-sine", "--rig", f"sim:{file}", "-o", str(log), "-q"])
    assert not ended.value.code
    read = Log.read(log)
    with_ripple = predict([read], known()).errors
    effects = tuple(entry for entry in known().effects if entry.name == "inertia")
    without = predict([read], replace(known(), effects=effects)).errors
    (one,), (other,) = with_ripple.values(), without.values()
    assert one["relative_percent"] < 10.0
    assert other["relative_percent"] > 2.0 * one["relative_percent"]


def test_a_file_without_bristle_and_inertia_still_moves(tmp_path: Path) -> None:
    bare = replace(known(), dynamic={}, effects=())
    with open_rig(f"sim:{written(bare, tmp_path)}") as rig:
        assert rig.axis.torque_constant == 2.0
        assert np.isfinite(rig.limits.current)


@pytest.mark.parametrize(
    ("axis", "said"),
    [
        (Axis("rotary", effort="voltage"), "counts in voltage, and a simulated rig in N m"),
        (Axis("linear", 10.0), "is of a linear axis"),
    ],
)
def test_what_it_cannot_be_is_refused(tmp_path: Path, axis: Axis, said: str) -> None:
    plain = replace(known(), axis=axis, effects=())
    with pytest.raises(InputError, match=said):
        open_rig(f"sim:{written(plain, tmp_path)}")


def test_a_form_that_the_plant_does_not_have_is_told(tmp_path: Path) -> None:
    entry = EffectEntry("load_dependent_friction", {"mu": Parameter(0.1), "doubling_load": Parameter(0.5)})
    from idtool.rig.opening import read_plant

    found = read_plant(str(written(known().with_effect(entry), tmp_path)))
    assert "without a part of load_dependent_friction" in found.description
    assert found.effects["load_dependent_friction"] == {"mu": 0.1}


def test_a_payload_is_accelerated_as_the_file_says(tmp_path: Path) -> None:
    entry = EffectEntry("inertia", {"inertia": Parameter(0.01), "per_payload": Parameter(0.02)})
    from idtool.rig.base import TrialSetup
    from idtool.rig.numbers import plant_numbers
    from idtool.rig.opening import read_plant

    found = read_plant(str(written(known().with_effect(entry), tmp_path)))
    inertias = [plant_numbers(found, TrialSetup(payload)).inertia for payload in (0.0, 0.5)]
    assert inertias == pytest.approx([0.01, 0.02])


def test_an_element_that_carries_a_part_of_the_friction_leaves_the_rest_of_it(tmp_path: Path) -> None:
    values = {"stiffness": 2.0, "yield": 0.06, "of_friction": 1.0}
    entry = EffectEntry("hysteresis", {name: Parameter(value) for name, value in values.items()})
    from idtool.rig.opening import read_plant

    found = read_plant(str(written(known().with_effect(entry), tmp_path)))
    assert found.effects["hysteresis"] == {"stiffness_nm_per_rad": 2.0, "yield_nm": 0.06}
    assert found.friction["coulomb_nm"] == pytest.approx(0.02)
    assert found.friction["static_nm"] == pytest.approx(0.06)
