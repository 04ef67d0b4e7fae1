"""Logs are simulated much faster than they were recorded, since a fit does it again and again."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from idtool.signals import record
from idtool.simulation.plant import PlantFile
from idtool.simulation.stage import Stage
from testbench.pendulums import Pendulum

SWING = Pendulum()


def test_a_thousand_times_as_fast_as_the_axis() -> None:
    log = SWING.log(seconds=10.0)
    file = SWING.parameters()
    recording = record([replace(log, axis=file.axis)], every_row=True)
    stage, plant = Stage.of([log], recording), PlantFile.of(file, 1.0)
    stage.run(plant, np.inf)  # compiled
    used = []
    for _ in range(3):
        begin = time.process_time()
        stage.run(plant, np.inf)
        used.append(time.process_time() - begin)
    assert min(used) < 10.0 / 1000.0
