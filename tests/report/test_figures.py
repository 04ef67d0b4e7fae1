"""The figures that single fits draw, and the numbers behind the others."""

from __future__ import annotations

import doctest
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from idtool.errors import InputError
from idtool.presentation import text
from idtool.report import (
    arm_figure,
    dynamic_figure,
    gravity_figure,
    save_figure,
    spectra,
    stribeck_figure,
)
from idtool.report.gravity_figures import average_error
from idtool.report.loop_figures import main_frequency
from idtool.report.residual_figures import binned_mean

MASSES = np.arange(0.0, 1.6, 0.1)


def test_text_examples() -> None:
    assert doctest.testmod(text).failed == 0


def test_gravity_figure_shows_the_line_and_saves_as_both_kinds(tmp_path: Path) -> None:
    figure = gravity_figure(
        MASSES, 0.23 + 0.447 * MASSES, base=0.23, per_payload=0.447, stderr=0.001 + 0 * MASSES
    )
    for form in ("png", "svg"):
        save_figure(figure, tmp_path / f"gravity.{form}")
    with Image.open(tmp_path / "gravity.png") as image:
        assert image.width > 800
    svg = (tmp_path / "gravity.svg").read_text(encoding="utf-8")
    for word in ("line: 0.23 + 0.447 · payload", "Payload, kg", "Gravity torque, N m"):
        assert word in svg
    with pytest.raises(InputError):
        save_figure(figure, tmp_path / "nowhere" / "gravity.png")


def test_arm_figure_is_over_position() -> None:
    angle = np.linspace(-1.5, 1.5, 9)
    figure = arm_figure(angle, 2.0 * np.sin(angle), sin=2.0, cos=0.0)
    assert figure.axes[-1].get_xlabel() == "Position, rad"
    difference = figure.axes[1].containers[0].lines[0].get_ydata()
    np.testing.assert_allclose(np.asarray(difference, dtype=float), 0.0, atol=1e-12)


def test_stribeck_figure_folds_both_directions_and_never_joins_them() -> None:
    speed = np.array([-0.4, -0.2, 0.2, 0.4])
    curve = np.linspace(-0.5, 0.5, 41)
    figure = stribeck_figure(
        speed,
        np.sign(speed) * 0.1,
        kind="linear",
        steady=[True, False, True, True],
        curve_velocity=curve,
        curve_torque=np.sign(curve) * 0.1,
        low=np.sign(curve) * 0.1 - 0.01,
        high=np.sign(curve) * 0.1 + 0.01,
    )
    signed, folded = figure.axes
    assert signed.get_xlabel() == "Velocity, m/s"
    assert signed.get_ylabel() == "Friction force, N"
    for line in signed.get_lines():
        x = np.asarray(line.get_xdata(), dtype=float)
        if len(x) > 10:
            assert np.all(x < 0) or np.all(x > 0)
    assert all(
        np.all(np.asarray(line.get_ydata(), dtype=float) > 0)
        for line in folded.get_lines()
        if len(line.get_xdata()) > 2
    )  # type: ignore[arg-type]


def test_stribeck_figure_of_points_alone_and_of_a_curve_alone() -> None:
    stribeck_figure([0.1, -0.1], [0.1, -0.1])
    stribeck_figure([], [], curve_velocity=[0.1, 0.2], curve_torque=[0.1, 0.1])


def test_dynamic_figure_names_its_panels_by_frequency() -> None:
    time = np.arange(0, 10, 0.025)
    trial = np.repeat([4, 7, 9], len(time))
    velocity = np.concatenate([np.sin(2 * np.pi * f * time) for f in (0.2, 0.5, 1.0)])
    figure = dynamic_figure(trial, velocity, velocity, velocity, time=np.tile(time, 3))
    assert [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()] == [
        "0.2 Hz",
        "0.5 Hz",
        "1 Hz",
    ]
    figure = dynamic_figure(trial, velocity, velocity, velocity)
    assert figure.axes[0].get_title(loc="left") == "trial 4"


def test_figures_do_not_need_the_state_machine_of_pyplot() -> None:
    import subprocess
    import sys

    code = (
        "import sys, idtool.report; assert 'matplotlib' not in sys.modules\n"
        "f = idtool.report.stribeck_figure([0.1], [0.1]); assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_main_frequency() -> None:
    time = np.arange(0, 8, 0.02)
    assert main_frequency(time, 0.3 * np.sin(2 * np.pi * 0.5 * time)) == pytest.approx(0.5, rel=0.01)
    assert main_frequency(time, np.random.default_rng(0).standard_normal(len(time))) is None
    assert main_frequency(time, np.zeros(len(time))) is None
    assert main_frequency([0.0, 1.0], [1.0, 2.0]) is None


def test_average_error_as_the_paper_states_it() -> None:
    assert average_error([1.01, 1.98], [1.0, 2.0]) == pytest.approx(1.0)
    assert np.isnan(average_error([1.0], [0.0]))


def test_autocorrelation_of_noise_and_of_a_first_order_process() -> None:
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((20, 500))
    memory = np.zeros_like(noise)
    for k in range(1, 500):
        memory[:, k] = 0.8 * memory[:, k - 1] + noise[:, k]
    np.testing.assert_allclose(spectra.autocorrelation(list(noise), 5), [1, 0, 0, 0, 0], atol=0.03)
    np.testing.assert_allclose(spectra.autocorrelation(list(memory), 4), 0.8 ** np.arange(4), atol=0.04)


def test_periodogram_keeps_the_power_and_finds_the_line() -> None:
    time = np.arange(0, 50, 0.025)
    pieces = [np.sin(2 * np.pi * 3.0 * time), np.sin(2 * np.pi * 3.0 * time[:777] + 1.0)]
    frequency, power = spectra.periodogram(pieces, 0.025)
    assert frequency[np.argmax(power)] == pytest.approx(3.0, abs=0.02)
    assert np.sum(power) * (frequency[1] - frequency[0]) == pytest.approx(0.5, rel=0.03)


def test_pieces_are_cut_where_rows_are_missing() -> None:
    time = np.delete(np.arange(0, 10, 0.1), slice(40, 60))
    step, pieces = spectra.even_pieces(time, time, [slice(0, len(time))])
    assert step == pytest.approx(0.1)
    assert [len(piece) for piece in pieces] == [40, 40]
    assert spectra.even_pieces(time, time, [])[1] == []


def test_angle_spectrum_reads_amplitude_and_frequency_of_a_ripple() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(0, 60, 0.025)
    position = 0.9 * np.sin(2 * np.pi * 0.05 * time)
    residual = 0.012 * np.sin(35.0 * position + 0.4) + 0.002 * rng.standard_normal(len(time))
    whole = [slice(0, len(time))]
    frequencies = spectra.angle_frequencies(position, whole)
    amplitudes = spectra.angle_amplitudes(position, residual, frequencies)
    best = int(np.argmax(amplitudes))
    assert frequencies[best] == pytest.approx(35.0, abs=frequencies[1] - frequencies[0])
    assert amplitudes[best] == pytest.approx(0.012, rel=0.1)
    assert len(spectra.angle_frequencies(np.zeros(9), [slice(0, 9)])) == 0


def test_binned_mean_of_few_and_of_many_values() -> None:
    x, mean = binned_mean(np.array([0.0, 0.0, 1.5]), np.array([1.0, 3.0, 5.0]))
    np.testing.assert_allclose(x, [0.0, 1.5])
    np.testing.assert_allclose(mean, [2.0, 5.0])
    line = np.linspace(0, 1, 5000)
    x, mean = binned_mean(line, 3.0 * line)
    np.testing.assert_allclose(mean, 3.0 * x, atol=1e-9)


def test_a_figure_is_the_same_bytes_each_time() -> None:
    from idtool.presentation.style import render

    first, second = (render(stribeck_figure([0.1, -0.1], [0.1, -0.1]), form) for form in ("png", "png"))
    assert first == second
    assert Image.open(io.BytesIO(first)).format == "PNG"
