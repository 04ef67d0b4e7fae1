"""The files of the study of hand guiding: those of the law that its machines follow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from testbench.guided_machines.machines import file_of, random_machine


def test_the_file_of_a_soft_machine_holds_its_bristle(tmp_path: Path) -> None:
    """Identification also offers a law without presliding, by which no hand would be felt below it."""
    machine = random_machine(np.random.default_rng(1), 0)
    file = file_of(machine, 0, tmp_path)
    assert file.provenance["friction_law"] == "lugre"
    truth = machine.plant.coulomb / machine.plant.presliding
    assert file.dynamic["bristle_stiffness"].value == pytest.approx(truth, rel=0.3)
    assert file.static["coulomb"].value == pytest.approx(machine.plant.coulomb, rel=0.1)
