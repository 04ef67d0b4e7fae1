"""Which of several base models the diagnosis goes on from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from idtool.diagnosis.diagnose import diagnose
from idtool.effects import registry
from idtool.fit.choose import choose_gravity, first_fit
from idtool.fit.model import Spec
from idtool.signals import record
from idtool.signals.thin import thin
from testbench.plants import Plant, record_session

PAPER = Plant(0.070, 0.030, 0.090, 0.155, 0.051, 0.297, 0.006, 0.2295, 0.4457)


def test_a_result_is_not_taken_while_another_base_model_predicts_better() -> None:
    recording = record(record_session(PAPER, "lab", 3, ("gravity", "sine")))
    few = thin(recording)
    spec = Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),))
    stiff, soft = (first_fit(few, replace(spec, soft=how)) for how in (False, True))
    assert stiff.rmse > 1.5 * soft.rmse
    # the one effect that may stand for the soft bristle leaves nothing that follows anything
    found = diagnose(recording, [stiff, soft], [registry.get("compliance")], given=True)
    assert found.start == 1
    assert found.verdict == "adequate"
    assert np.isclose(found.final.values["coulomb"], 0.070, rtol=0.05)
