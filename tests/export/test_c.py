"""The exported C does what the Python controller does, sample by sample, faults included."""

from __future__ import annotations

import itertools
import math
import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.control import Limits, Reason
from idtool.effects import registry
from idtool.parameters import Parameter, Parameters
from idtool.parameters.axis import Axis
from testbench.effect_numbers import RICHER
from tests.control.double import BENCH, PAPER, parameters
from tests.control.test_online import EFFECTS as ONLINE

from .twin import NUMBERS, RECOVER, RESET, Answers, Samples, compile_c, motion, run_c, run_python

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")

STEPS = 10_000
#: What single precision may cost, of a number or of its root mean square over the run.
TOLERANCE = 1e-4
EFFECTS = ONLINE | {
    "transport_delay": {"delay": 0.012},
    "torque_constant_saturation": {"kappa": 0.03},
}
OTHER_FORMS = {
    "warm_up": {"thermal_drift": {"warm_up": 0.3, "time_constant": 30.0}},
    "late_current": {"transport_delay": {"delay": -0.02}},
    "gap_without_load": {"backlash": {"gap": 0.05, "share_behind_gap": 0.5, "share_at_once": 0.3}},
    "beside_the_clock": {"external_periodic": {"frequency": 1.0, "amplitude": 0.1, "phase": 0.0}},
    "saturation_of_a_logged_torque": {"torque_constant_saturation": {"loss": 0.0112}},
    **RICHER,
}
CASES = {"none": {}} | {name: {name: values} for name, values in EFFECTS.items()} | OTHER_FORMS
CASES["all"] = EFFECTS


def assert_alike(c: Answers, python: Answers) -> None:
    """State, fault, limits exactly; numbers to TOLERANCE."""
    for name in ("state", "fault", "limited", "valid", "ready", "taring", "disturbed"):
        pairs = zip(getattr(c, name), getattr(python, name), strict=True)
        apart = [k for k, (a, b) in enumerate(pairs) if a != b]
        assert not apart, f"{name} differs at {len(apart)} steps, first at {apart[0]}"
    assert np.all(np.isfinite(c.x))
    scale = np.maximum(np.abs(python.x), np.sqrt(np.mean(python.x**2, axis=0)))
    # what was learned of the load is beside gravity: a difference has no more digits than what it is of
    scale[:, NUMBERS.index("load")] = np.maximum(
        scale[:, NUMBERS.index("load")], scale[:, NUMBERS.index("gravity")]
    )
    worst = np.max(np.abs(c.x - python.x) - TOLERANCE * scale, axis=0)
    assert np.all(worst <= 0), worst


@pytest.mark.parametrize(
    "values", [pytest.param(PAPER, marks=pytest.mark.long), BENCH], ids=["paper", "bench"]
)
@pytest.mark.parametrize("case", CASES)
def test_steps_as_python_does(case: str, values: dict[str, float], tmp_path: Path) -> None:
    file = parameters(values, **CASES[case])
    samples = motion(STEPS // 2, 0.01, seed=1)
    c, python = run_c(compile_c(file, tmp_path), samples), run_python(file, samples)
    assert_alike(c, python)
    seen = Counter(python.state)
    assert min(seen[state] for state in ("starting", "resting", "guiding", "stopping")) > 10


def test_every_effect_has_a_c_form() -> None:
    """An effect that cannot be put on a board is a decision, and this is where it is written down."""
    numbers = EFFECTS | {"external_periodic": OTHER_FORMS["beside_the_clock"]["external_periodic"]}
    without = set()
    for effect in registry.library():
        if effect.name in numbers and effect.in_c(effect.to_values(numbers[effect.name])) is None:
            without.add(effect.name)
    assert without == {"external_periodic"}, "the controller itself leaves it out"


def _linear(file: Parameters) -> Parameters:
    return replace(file, axis=Axis("linear", 2.67))


def _arm(file: Parameters) -> Parameters:
    gravity = {"sin": Parameter(0.3), "cos": Parameter(-0.1)}
    return replace(file, gravity_model="arm", gravity=gravity)


def _weightless(file: Parameters) -> Parameters:
    return replace(file, gravity_model=None, gravity={}, weightless=True)


def _rigid(file: Parameters) -> Parameters:
    return replace(file, dynamic={})


@pytest.mark.parametrize("change", [_linear, _arm, _weightless, _rigid])
def test_other_axes(change: Callable[[Parameters], Parameters], tmp_path: Path) -> None:
    file = change(parameters(BENCH, inertia={"inertia": 0.02}))
    samples = motion(STEPS, 0.01, seed=2, stroke=0.1 if change is _linear else 1.0)
    assert_alike(run_c(compile_c(file, tmp_path), samples), run_python(file, samples))


@pytest.mark.parametrize("period", [0.002, 0.0103, 0.05])
def test_other_periods(period: float, tmp_path: Path) -> None:
    file = parameters(BENCH, transport_delay={"delay": 0.012})
    samples = motion(STEPS, period, seed=3)
    program = compile_c(file, tmp_path, period_s=period)
    assert_alike(run_c(program, samples), run_python(file, samples, period_s=period))


def test_limits_cut_where_python_cuts(tmp_path: Path) -> None:
    limits = Limits(-1.0, 1.5, margin=30.0, speed=0.15, command_step=0.01, mismatch=math.inf)
    file = parameters(PAPER)
    samples = motion(STEPS, 0.01, seed=4)
    program = compile_c(file, tmp_path, limits=limits)
    c, python = run_c(program, samples), run_python(file, samples, limits=limits)
    assert_alike(c, python)
    assert frozenset().union(*python.limited) == {"speed", "step", "range"}


def test_counts_periods_where_no_clock_is_given(tmp_path: Path) -> None:
    """At a period that divides no time of the law, so that no rounding decides."""
    file = parameters(PAPER, thermal_drift={"warm_up": 0.3, "time_constant": 30.0})
    samples = replace(motion(STEPS, 0.0103, seed=5), clocked=False)
    program = compile_c(file, tmp_path, period_s=0.0103)
    assert_alike(run_c(program, samples), run_python(file, samples, period_s=0.0103))


def test_no_thermometer_leaves_the_drift_out(tmp_path: Path) -> None:
    file = parameters(PAPER, thermal_drift={"rate": 0.05, "reference": 25.0})
    samples = replace(motion(STEPS, 0.01, seed=6), warm=False)
    assert_alike(run_c(compile_c(file, tmp_path), samples), run_python(file, samples))


def test_a_clock_that_wraps_is_no_fault(tmp_path: Path) -> None:
    file = parameters(PAPER)
    samples = motion(2000, 0.01, seed=7)
    late = replace(samples, time_us=(samples.time_us + 2**32 - 10_000_000) % 2**32)
    program = compile_c(file, tmp_path)
    early, wrapped = run_c(program, samples), run_c(program, late)
    assert wrapped.state == early.state
    np.testing.assert_array_equal(wrapped.x, early.x)


#: Looked for by the light mode, and where a limit on the torque is given (test_c_light.py).
NOT_IN_C = {"torque", "mismatch", "speed_limit", "energy"}


def _break(samples: Samples, seed: int) -> Samples:
    """One wrong sample in fifty or so, of every kind, and a `recover` or `reset` some steps later."""
    rng = np.random.default_rng(seed)
    x, time_us, request = samples.x.copy(), samples.time_us.copy(), samples.request.copy()
    wrongs = itertools.cycle(range(14))
    at = 40
    while at < len(x) - 20:
        wrong = next(wrongs)
        if wrong < 7:  # NaN or infinite, each column in turn
            x[at, wrong] = [np.nan, np.inf, -np.inf][at % 3]
        elif wrong < 10:  # impossible position, velocity, current
            x[at, wrong - 7] = [2e6, -20.0, 12.0][wrong - 7]
        elif wrong == 10:
            x[at, 0] += 3.0  # the encoder jumps
        elif wrong == 11:
            time_us[at] = time_us[at - 1]
        elif wrong == 12:
            time_us[at:] += 100_000
        else:  # moving, and nothing changes
            x[at : at + 9] = x[at]
            x[at : at + 9, 1] = 0.9
        request[at + 12] = RESET if wrong % 4 == 3 else RECOVER
        at += int(rng.integers(45, 60))
    return replace(samples, x=x, time_us=time_us, request=request)


def test_faults_are_those_of_python_and_hold_until_recover(tmp_path: Path) -> None:
    file = parameters(BENCH, **EFFECTS)
    samples = _break(motion(STEPS, 0.01, seed=8), seed=8)
    c, python = run_c(compile_c(file, tmp_path), samples), run_python(file, samples)
    assert_alike(c, python)
    assert {fault for fault in c.fault if fault} == {reason.value for reason in Reason} - NOT_IN_C
    for k in range(1, STEPS):
        if c.fault[k] and c.fault[k - 1] and not samples.request[k]:
            assert c.x[k, 0] == c.x[k - 1, 0], "the command is held"


def test_a_time_that_runs_backwards_is_a_fault(tmp_path: Path) -> None:
    file = parameters(PAPER)
    samples = motion(60, 0.01, seed=9)
    samples.time_us[40] -= 100_000
    c, python = run_c(compile_c(file, tmp_path), samples), run_python(file, samples)
    assert c.fault[40] == python.fault[40] == Reason.TIME_JUMP.value


def test_nothing_is_to_be_sent_before_the_first_good_sample(tmp_path: Path) -> None:
    file = parameters(PAPER)
    samples = motion(10, 0.01, seed=10)
    samples.x[0, 0] = np.nan
    c = run_c(compile_c(file, tmp_path), samples)
    assert c.valid == [False] * 10
    assert np.all(c.x[:, 0] == 0.0)
