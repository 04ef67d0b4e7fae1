"""Parameter files as a hand writes them, and what is said of those that are none."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool.errors import InputError
from idtool.parameters import Parameters

GOOD = """schema = "ffc-id/params/1"

[axis]
kind = "rotary"
torque_constant_nm_per_a = 2.67

[gravity]
model = "slide"
base_nm = {value = 0.2, stderr = 0.001, ci95 = [0.198, 0.202], at_bound = false, identified = true}
per_payload_nm_per_kg = {value = 0.4}

[friction.static]
coulomb_nm = {value = 0.07}
static_nm = {value = 0.03}
stribeck_velocity_rad_s = {value = 0.09}
viscous_nm_s_per_rad = {value = 0.155}

[friction.dynamic]
bristle_stiffness_nm_per_rad = {value = 0.051}
bristle_damping_nm_s_per_rad = {value = 0.297}

[[effects]]
name = "inertia"

[effects.parameters]
inertia_kg_m2 = {value = 0.001}

[controller]
command_gain_s = 2.05
loop_gain_rad_s_per_nm = 1.68
period_s = 0.01

[provenance]
made_by = "hand"
"""


def put(folder: Path, content: str | bytes) -> Path:
    path = folder / "params.toml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        Parameters.read(path)
    text = str(caught.value)
    assert "\n" not in text
    assert text.endswith((".", "?"))
    assert text.startswith(str(path))
    return text
