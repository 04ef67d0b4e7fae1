"""The exported C on a simulated Arduino Uno: the same commands as here, in time, and small enough."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool.effects import registry
from testbench.board.files import EFFECTS, LIGHT, with_effects
from testbench.board.measure import CLOCK_HZ, host_commands, measure, missing

#: What the bootloader of a Uno leaves, and what the maker's servo library of the sketch takes of it.
UNO_FLASH, SERVO_LIBRARY = 32_256, 12_400

pytestmark = pytest.mark.skipif(missing() is not None, reason=f"no {missing()} here")


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


def test_the_light_mode_fits_and_commands_what_it_commands_here(tmp_path: Path) -> None:
    """In a quarter of its period; docs/board.md says which steps take how long."""
    figures = measure(with_effects("inertia", light=True), tmp_path)
    assert max(figures.cycles) < 0.25 * LIGHT.period * CLOCK_HZ
    assert figures.ram < 1024
    # it fits the chip, not beside the servo library: docs/board.md
    assert figures.flash < UNO_FLASH
    assert set(figures.states) == {0, 1, 2, 3, 4}
    assert figures.commands == pytest.approx(host_commands(tmp_path), rel=1e-4, abs=1e-5)


def test_every_effect_at_once_fits_and_commands_what_it_commands_here(tmp_path: Path) -> None:
    assert set(EFFECTS) == set(registry.names()) - {"external_periodic"}
    figures = measure(with_effects(*EFFECTS), tmp_path)
    assert figures.ram < 1024
    assert figures.flash < UNO_FLASH - SERVO_LIBRARY
    assert figures.commands == pytest.approx(host_commands(tmp_path), rel=1e-4, abs=1e-5)
