"""The exported C on a simulated Arduino Uno: the same commands as here, in time, and small enough."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from idtool.effects import registry
from idtool.guiding.path import smoothed
from testbench.board.files import EFFECTS, with_effects
from testbench.board.measure import (
    CLOCK_HZ,
    UNO_FLASH,
    host_commands,
    measure,
    missing,
    sketch_flash,
)

simulated = pytest.mark.skipif(missing() is not None, reason=f"no {missing()} here")
#: To spare on a Uno, bytes; and what of the light sketch is not the controller: the core with its clock and
#: serial port, the servo's packets, setup and loop, 4.9 kB, and as much again for what a user adds.
SPARE, SKETCH = 1024, 6_400
CONTROLLER_FLASH = UNO_FLASH - SPARE - SKETCH


@pytest.mark.skipif(shutil.which("avr-g++") is None, reason="no avr-g++ here")
@pytest.mark.parametrize("plays", [False, True], ids=["1 kB to spare", "with a path"])
def test_the_light_sketch_fits_the_uno_with_three_effects(shared: Path, tmp_path: Path, plays: bool) -> None:
    """Against the real core, where that is kept beside the project."""
    builder = shared / "arduino" / "build_uno.sh"
    if not builder.is_file():
        pytest.skip("no core of the Uno here")
    file = with_effects("inertia", "torque_offset", "position_ripple", light=True)
    time = np.arange(0.0, 20.0, 0.01)
    path = smoothed(time, np.sin(time) * np.sin(0.3 * time), "rotary")
    flash = sketch_flash(file, tmp_path, builder, path if plays else None)
    assert flash <= UNO_FLASH - (0 if plays else SPARE)


@simulated
@pytest.mark.parametrize(
    "effects", [(), ("stribeck_shape",), ("backlash",), ("inertia", "position_ripple")], ids=str
)
def test_the_published_mode_steps_in_a_millisecond_and_under_a_kilobyte(
    effects: tuple[str, ...], tmp_path: Path
) -> None:
    figures = measure(with_effects(*effects), tmp_path)
    half = len(figures.cycles) // 2
    assert max(figures.cycles[:half]) < 1e-3 * CLOCK_HZ
    assert figures.ram < 1024
    assert set(figures.states) == {0, 1, 3, 4}  # it never tares


@simulated
def test_the_light_mode_fits_and_commands_what_it_commands_here(tmp_path: Path) -> None:
    figures = measure(with_effects("inertia", light=True), tmp_path)
    half = len(figures.cycles) // 2
    assert max(figures.cycles[:half]) < 1e-3 * CLOCK_HZ
    assert figures.ram < 1024
    assert figures.flash < CONTROLLER_FLASH
    assert set(figures.states) == {0, 1, 2, 3, 4}
    assert figures.commands == pytest.approx(host_commands(tmp_path), rel=1e-4, abs=1e-5)


@simulated
def test_every_effect_at_once_fits_and_commands_what_it_commands_here(tmp_path: Path) -> None:
    assert set(EFFECTS) == set(registry.names()) - {"external_periodic"}
    figures = measure(with_effects(*EFFECTS), tmp_path)
    assert figures.ram < 1024
    assert figures.flash < CONTROLLER_FLASH
    assert figures.commands == pytest.approx(host_commands(tmp_path), rel=1e-4, abs=1e-5)
