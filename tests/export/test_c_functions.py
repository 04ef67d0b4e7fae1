"""The C's own exponential, reciprocal, power and sine: as exact as their comments say."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable

import numpy as np
import pytest

from idtool.export.c_controller import export_c
from tests.control.double import BENCH, parameters

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")

_MAIN = """
#include "ffc.c"
#include <stdio.h>

int main(void)
{
    float x;
    while (fread(&x, sizeof x, 1, stdin) == 1) {
        float y[5] = {decay(fabsf(x)), inverse(x), raised(fabsf(x), 1.3f), 0.0f, 0.0f};
        sine_and_cosine(x, &y[3], &y[4]);
        if (fwrite(y, sizeof y, 1, stdout) != 1)
            return 1;
    }
    return 0;
}
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> tuple[np.ndarray, np.ndarray]:
    """Arguments, and the C's answers in double precision, shape (rows, 5)."""
    folder = tmp_path_factory.mktemp("functions")
    export_c(parameters(BENCH, stribeck_shape={"exponent": 1.3}), folder)
    (folder / "main.c").write_text(_MAIN)
    command = ["gcc", "-std=c99", "-O2", "-w", "-I", folder, folder / "main.c", "-lm", "-o", folder / "main"]
    subprocess.run(command, check=True)
    rng = np.random.default_rng(0)
    powers_of_two = 2.0 ** np.arange(-20, 9)  # where the tables begin and end
    x = np.concatenate(
        [np.exp(rng.uniform(-15.0, 6.0, 200_000)), powers_of_two, np.nextafter(powers_of_two, 0)]
    )
    x = (x * rng.choice([-1.0, 1.0], len(x))).astype(np.float32)
    done = subprocess.run([folder / "main"], input=x.tobytes(), capture_output=True, check=True)
    return x.astype(float), np.frombuffer(done.stdout, dtype=np.float32).reshape(-1, 5).astype(float)


def test_the_exponential(answers: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = answers
    true = np.exp(-np.abs(x))
    # the argument in single precision is itself so uncertain
    bound = 3e-7 + 1.2e-7 * np.abs(x)
    assert np.all((np.abs(y[:, 0] - true) <= bound * true) | ((true < 1e-12) & (y[:, 0] == 0.0)))


def test_the_reciprocal(answers: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = answers
    assert np.max(np.abs(y[:, 1] * x - 1.0)) < 2e-7


def test_the_power_up_to_32(answers: tuple[np.ndarray, np.ndarray]) -> None:
    x, y = answers
    true = np.minimum(np.abs(x) ** float(np.float32(1.3)), 32.0)
    assert np.max(np.abs(y[:, 2] - true) / true) < 3e-6


@pytest.mark.parametrize(("column", "function"), [(3, np.sin), (4, np.cos)], ids=["sine", "cosine"])
def test_sine_and_cosine(
    column: int, function: Callable[[np.ndarray], np.ndarray], answers: tuple[np.ndarray, np.ndarray]
) -> None:
    x, y = answers
    # the angle is cut to 2^-24 of a turn, and is in single precision
    assert np.all(np.abs(y[:, column] - function(x)) <= 8e-7 + 1e-7 * np.abs(x))
