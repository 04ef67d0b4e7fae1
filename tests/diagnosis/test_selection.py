"""What hides an effect from the scores, and how it is found all the same."""

from __future__ import annotations

from idtool.diagnosis.diagnose import diagnose
from idtool.effects import registry
from idtool.signals import record
from idtool.verbs.identify import begin
from testbench.plants import SESSION, Plant, record_session


def test_an_offset_that_a_soft_bristle_would_take_in() -> None:
    """The base model makes the bristle so soft that its unknown start deflections hold the offset."""
    plant = Plant(
        coulomb=0.0467,
        static=0.0595,
        stribeck_velocity=0.0628,
        viscous=0.242,
        bristle_stiffness=0.932,
        bristle_damping=0.145,
        inertia=0.005,
        base=0.129,
        per_payload=0.507,
        effects={"torque_offset": {"offset_nm": 0.0602}},
    )
    recording = record(record_session(plant, "dynamixel", 1, (*SESSION, "pauses"), temperature=False))
    starts, *_ = begin(recording, "lugre", "auto")
    found = diagnose(recording, starts, [registry.get(n) for n in ("torque_offset", "inertia")])
    assert found.base.values["bristle_stiffness"] < 0.1
    assert [effect.name for effect in found.effects] == ["torque_offset", "inertia"]
    held_out = found.to_document()["error"]["held_out"]
    assert held_out["after"] < 0.4 * held_out["before"]
