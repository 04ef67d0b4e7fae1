"""BAM's parameters come in as they went out, and what has no place here is named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from idtool.errors import InputError
from idtool.export.targets import export
from idtool.importing.bam_parameters import bam_parameters
from idtool.parameters import Axis, EffectEntry, Parameter, Parameters
from tests.verbs.support import ffc_id

M2 = {
    "model": "m2",
    "friction_base": 0.05,
    "friction_stribeck": 0.02,
    "dtheta_stribeck": 0.3,
    "alpha": 1.4,
    "friction_viscous": 0.01,
    "kt": 1.2,
    "R": 3.5,
    "armature": 0.004,
}


def written(folder: Path, content: dict[str, object]) -> Path:
    file = folder / "bam.json"
    file.write_text(json.dumps(content))
    return file


def test_what_went_out_comes_in(tmp_path: Path) -> None:
    static = {"coulomb": 0.08, "static": 0.115, "stribeck_velocity": 0.08, "viscous": 0.12}
    effects = {"inertia": {"inertia": 0.008}, "stribeck_shape": {"exponent": 1.3}}
    axis = Parameters(
        axis=Axis("rotary", 2.67, resistance=4.0),
        static={name: Parameter(value) for name, value in static.items()},
        effects=tuple(
            EffectEntry(name, {key: Parameter(value) for key, value in values.items()})
            for name, values in effects.items()
        ),
    )
    file = tmp_path / "bam.json"
    file.write_text(export("bam", axis).text)
    found = bam_parameters(file)
    assert found is not None
    parameters, lost = found
    assert lost == []
    assert parameters.axis == axis.axis
    assert parameters.effects == axis.effects
    assert {name: one.value for name, one in parameters.static.items()} == pytest.approx(static)


def test_m1_has_no_curve(tmp_path: Path) -> None:
    m1 = {"model": "m1", "friction_base": 0.05, "friction_viscous": 0.01}
    found = bam_parameters(written(tmp_path, m1))
    assert found is not None
    assert found[0].static["static"] == found[0].static["coulomb"]
    assert found[0].effects == ()
    assert found[0].axis.torque_constant is None


def test_from_the_command_line_with_what_does_not_come_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, M2 | {"model": "m4", "load_friction_motor": 0.1, "load_friction_external": 0.0})
    params = tmp_path / "params.toml"
    code, out, err = ffc_id(capsys, "import", file, "-o", params)
    assert code == 0
    assert "load_friction_motor did not come over" in out + err
    assert "load_friction_external" not in out + err
    found = Parameters.read(params)
    assert found.static["static"].value == pytest.approx(0.07)
    assert found.effect("stribeck_shape") is not None


def test_a_number_that_cannot_be_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"bam.json, friction_base: expected a number >= 0, found -0.1;"):
        bam_parameters(written(tmp_path, M2 | {"friction_base": -0.1}))
    with pytest.raises(InputError, match="dtheta_stribeck: is missing"):
        bam_parameters(written(tmp_path, {k: v for k, v in M2.items() if k != "dtheta_stribeck"}))
    assert bam_parameters(written(tmp_path, {"entries": []})) is None
    assert bam_parameters(tmp_path / "none.json") is None
