"""The files of the study of hand guiding: what `identify` makes of a session of its machines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbench.guided_machines.machines import file_of, random_machine


def test_the_file_of_a_machine_holds_its_bristle_and_its_ripple(tmp_path: Path) -> None:
    """Identification also offers a law without presliding, by which no hand would be felt below it."""
    rng = np.random.default_rng(1)
    machine = [random_machine(rng, number) for number in range(14)][13]
    file, truth = file_of(machine, 0, tmp_path), machine.plant
    assert file.provenance["friction_law"] == "lugre"
    assert file.static["coulomb"].value == pytest.approx(truth.coulomb, rel=0.1)
    stiffness = max(truth.coulomb, truth.static) / truth.presliding
    assert file.dynamic["bristle_stiffness"].value == pytest.approx(stiffness, rel=0.3)
    (ripple,) = (effect.values() for effect in file.effects if effect.name == "position_ripple")
    assert ripple["cycles"] == pytest.approx(truth.ripple_cycles, rel=0.01)
    assert ripple["amplitude_1"] == pytest.approx(truth.ripple, rel=0.1)
    assert file_of(machine, 0, tmp_path) == file  # kept
