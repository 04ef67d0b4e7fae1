"""Two parameter files side by side: what differs, what cannot be said, and which predicts better."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from idtool.compare.comparison import LEVEL, Comparison, compare
from idtool.compare.paired_errors import LEAST_TRIALS, paired_blocks, sign_flip_test
from idtool.errors import InputError
from idtool.experiment.recipe import Changes, read_recipe
from idtool.experiment.runner import run
from idtool.fit.choose import choose_gravity, first_fit
from idtool.fit.spec import Spec
from idtool.log import Log
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.rig.opening import read_plant
from idtool.rig.simulated import SimulatedRig
from idtool.signals import record
from idtool.verbs.identification import parameters_of


def measured(value: float, stderr: float, freedom: float = math.inf) -> Parameter:
    """A parameter with the interval that its standard error gives."""
    half = float(stats.t.ppf(0.975, freedom)) * stderr
    return Parameter(value, stderr, (value - half, value + half))


def in_logarithms(value: float, share: float) -> Parameter:
    """A parameter that was fitted as a logarithm."""
    reach = math.exp(1.96 * share)
    return Parameter(value, value * share, (value / reach, value * reach))


BASE = Parameters(
    axis=Axis("rotary", 2.67),
    gravity_model="slide",
    gravity={"base": measured(0.2, 1e-3), "per_payload": measured(0.42, 1e-3)},
    static={
        "coulomb": in_logarithms(0.08, 0.01),
        "static": in_logarithms(0.115, 0.01),
        "stribeck_velocity": in_logarithms(0.08, 0.02),
        "viscous": measured(0.12, 1e-3),
    },
    dynamic={"bristle_stiffness": in_logarithms(8.0, 0.02), "bristle_damping": measured(0.2, 0.01)},
    effects=(EffectEntry("inertia", {"inertia": measured(0.008, 1e-4)}),),
)


def changed(part: str, name: str, parameter: Parameter) -> Parameters:
    return replace(BASE, **{part: getattr(BASE, part) | {name: parameter}})


def line(comparison: Comparison, name: str):  # type: ignore[no-untyped-def]
    return next(one for one in comparison.parameters if one.name == name)


def test_a_file_does_not_differ_from_itself() -> None:
    result = compare(BASE, BASE)
    assert (result.verdict, result.tested, result.differing) == ("no_difference", 9, [])
    assert all(one.z == 0.0 and one.p_value == 1.0 for one in result.parameters)
    assert result.sentence == (
        "No difference: the 9 parameters that both files determine agree within their uncertainty."
    )
    assert result.to_document()["prediction"] is None


def test_what_differs_stands_in_the_sentence() -> None:
    result = compare(BASE, changed("static", "coulomb", in_logarithms(0.088, 0.01)))
    assert [one.name for one in result.differing] == ["coulomb"]
    # of the logarithms: ln 1.1 over sqrt(2) times one per cent
    assert result.differing[0].z == pytest.approx(math.log(1.1) / math.hypot(0.01, 0.01))
    assert result.differing[0].stderr == pytest.approx(math.hypot(0.0008, 0.00088))
    assert result.sentence == (
        "1 of 9 parameters differs beyond its uncertainty: coulomb is 10 % higher in B (0.08 to 0.088 N m)."
    )
    back = compare(changed("static", "coulomb", in_logarithms(0.088, 0.01)), BASE)
    assert "9.09 % lower in B" in back.sentence


def test_few_degrees_of_freedom_need_a_larger_difference() -> None:
    """Four standard errors are beyond chance with many rows, and are not with three blocks of time."""
    outcomes = {}
    for freedom in (math.inf, 3.0):
        a = changed("static", "viscous", measured(0.12, 1e-3, freedom))
        b = changed("static", "viscous", measured(0.12 + 4.0 * math.sqrt(2.0) * 1e-3, 1e-3, freedom))
        outcomes[freedom] = line(compare(a, b), "viscous")
    assert outcomes[math.inf].differs
    assert not outcomes[3.0].differs
    # two equal errors of three degrees each make six
    assert outcomes[3.0].p_value == pytest.approx(2.0 * stats.t.sf(4.0, 6.0), rel=1e-3)


@pytest.mark.parametrize(
    ("parameter", "why"),
    [
        (Parameter(9.0, None, (1.0, 90.0), at_bound=True, identified=False), "at its bound in B"),
        (Parameter(9.0, 0.001, (8.9, 9.1), identified=False), "not determined in B"),
    ],
)
def test_what_is_not_determined_is_not_compared(parameter: Parameter, why: str) -> None:
    result = compare(BASE, changed("dynamic", "bristle_stiffness", parameter))
    found = line(result, "bristle_stiffness")
    assert (found.why, found.p_value, found.differs) == (why, None, False)
    assert (result.tested, result.verdict) == (8, "no_difference")


def test_a_declared_value_is_taken_as_exact() -> None:
    result = compare(changed("static", "viscous", Parameter(0.118)), BASE)
    assert line(result, "viscous").z == pytest.approx(2.0)
    neither = compare(
        changed("static", "viscous", Parameter(0.118)), changed("static", "viscous", Parameter(9))
    )
    assert line(neither, "viscous").why == "no standard error in either"


def test_effects_of_one_file_only() -> None:
    offset = EffectEntry("torque_offset", {"torque": measured(0.01, 1e-4)})
    result = compare(BASE, replace(BASE, effects=(offset,)))
    assert (result.only_a, result.only_b) == (("inertia",), ("torque_offset",))
    assert result.verdict == "effects_differ"
    assert result.sentence == (
        "The effects differ: only A has inertia and only B has torque_offset. "
        "The 8 parameters that both files determine agree within their uncertainty."
    )
    assert [one.why for one in result.parameters if one.part == "inertia"] == ["only in A"]
    assert result.notes == (
        "inertia and torque_offset in one file only can shift the other parameters of that file.",
    )


def ripple(cycles: float, amplitude: float, phase: float) -> Parameters:
    values = {
        "cycles": measured(cycles, 0.01),
        "amplitude_1": measured(amplitude, 1e-4),
        "phase_1": measured(phase, 0.02),
        "amplitude_2": measured(1e-5, 1e-4),
        "phase_2": measured(0.5, 3.0),
    }
    return replace(BASE, effects=(EffectEntry("position_ripple", values),))


def test_phases_are_compared_the_shorter_way_round_and_only_where_there_is_one() -> None:
    result = compare(ripple(31.0, 0.01, 3.13), ripple(31.0, 0.01, -3.13))
    assert line(result, "phase_1").difference == pytest.approx(2.0 * math.pi - 6.26)
    assert not line(result, "phase_1").differs
    assert line(result, "phase_2").why == "the phase of an amplitude near zero"
    assert line(compare(ripple(31.0, 0.01, 0.0), ripple(31.0, 0.01, 0.3)), "phase_1").differs


def sloped(center: float) -> Parameters:
    values = {
        "slope_1": measured(0.1, 0.01),
        "slope_2": measured(0.0, 0.01),
        "center": Parameter(center),
        "half_stroke": Parameter(1.0),
    }
    return replace(BASE, effects=(EffectEntry("position_dependent_friction", values),))


def test_an_effect_that_refers_to_another_place_is_not_compared() -> None:
    assert line(compare(sloped(0.0), sloped(0.001)), "slope_1").why == ""
    other = compare(sloped(0.0), sloped(0.5))
    assert line(other, "slope_1").why == "the center that it refers to is not the same"


def test_axes_of_different_kinds_are_refused() -> None:
    with pytest.raises(InputError, match="A is of a rotary axis and B of a linear axis"):
        compare(BASE, Parameters(axis=Axis("linear", 35.0)))


def test_other_gravity_models_and_constants_are_told() -> None:
    arm = {"sin": measured(0.1, 1e-3), "cos": measured(0.2, 1e-3)}
    other = replace(BASE, axis=Axis("rotary", 2.5), gravity_model="arm", gravity=arm)
    result = compare(BASE, other)
    assert [(one.name, one.why) for one in result.parameters if one.part == "gravity"] == [
        ("base", "only in A"),
        ("per_payload", "only in A"),
        ("sin", "only in B"),
        ("cos", "only in B"),
    ]
    assert len(result.notes) == 2
    assert "torque constants differ" in result.notes[0]


def test_nothing_in_common_is_said() -> None:
    result = compare(Parameters(axis=BASE.axis), BASE)
    assert result.verdict == "effects_differ"
    empty = compare(Parameters(axis=BASE.axis), Parameters(axis=BASE.axis))
    assert empty.verdict == "nothing_to_compare"
    assert empty.sentence == "No parameter can be compared: none is determined in both files."


def test_false_alarms_are_as_rare_as_stated() -> None:
    """Two noisy fits of one axis, many times: at most LEVEL of the comparisons may speak, by Holm."""
    rng = np.random.default_rng(5)
    freedom, repeats = 40.0, 250

    def fitted() -> Parameters:
        def noisy(parameter: Parameter) -> Parameter:
            assert parameter.stderr is not None
            stderr = parameter.stderr * math.sqrt(rng.chisquare(freedom) / freedom)
            return measured(parameter.value + parameter.stderr * rng.standard_normal(), stderr, freedom)

        return replace(
            BASE,
            **{
                part: {name: noisy(p) for name, p in getattr(BASE, part).items()}
                for part in ("gravity", "static", "dynamic")
            },
        )

    alarms = sum(compare(fitted(), fitted()).verdict == "different" for _ in range(repeats))
    # beyond what a rate of LEVEL gives once in a thousand runs of this test
    assert alarms <= stats.binom.ppf(0.999, repeats, LEVEL)


@given(st.floats(-3.0, 3.0), st.floats(0.3, 3.0))
def test_the_order_of_the_files_only_turns_the_sign(shift: float, error: float) -> None:
    other = changed("static", "coulomb", in_logarithms(0.08 * math.exp(0.01 * shift), 0.01 * error))
    there, back = line(compare(BASE, other), "coulomb"), line(compare(other, BASE), "coulomb")
    assert there.z == pytest.approx(-back.z, abs=1e-9)
    assert there.p_value == pytest.approx(back.p_value)
    assert there.differs == back.differs


# paired errors


@given(st.lists(st.integers(1, 200), min_size=1, max_size=12))
def test_pairs_hold_every_row_once_and_never_cross_a_trial(lengths: list[int]) -> None:
    trial = np.repeat(np.arange(len(lengths)), lengths).astype(np.intp)
    pair, blocks = paired_blocks(trial)
    assert blocks == (len(lengths) < LEAST_TRIALS)
    assert np.all(np.diff(pair) >= 0)
    assert np.all(np.unique(pair) == np.arange(pair[-1] + 1))
    for index in range(pair[-1] + 1):
        assert len(np.unique(trial[pair == index])) == 1


def test_the_sign_flip_test_is_exact_on_noise_and_finds_a_shift() -> None:
    rng = np.random.default_rng(1)
    p_values = [sign_flip_test(rng.standard_t(3, size=12)) for _ in range(300)]
    assert stats.kstest(p_values, "uniform").pvalue > 1e-3
    assert sign_flip_test(rng.standard_normal(20) + 2.0) < 1e-3
    assert sign_flip_test(np.zeros(10)) == 1.0
    # of five pairs of one sign, two of 32 flips are as far
    assert sign_flip_test(np.ones(5)) == pytest.approx(2 / 32, rel=0.2)


# simulated sessions


Session = Callable[..., tuple[Parameters, list[Log]]]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    """Record a short session on the bench, whose stiff bristle needs no more, and fit it."""
    folder = tmp_path_factory.mktemp("sessions")
    shorter = {"gravity": Changes(payloads=(0.0, 0.5, 1.0, 1.5)), "sweep": Changes(travel=2.6)}

    @cache
    def one(seed: int, **friction: float) -> tuple[Parameters, list[Log]]:
        plant = read_plant("bench")
        plant = replace(plant, friction={**plant.friction, **friction})
        logs = []
        with SimulatedRig(plant, seed=seed) as rig:
            for name in ("gravity", "sweep", "sine"):
                path = folder / f"{name}-{seed}.csv"
                run(read_recipe(name, shorter.get(name)), rig, path)
                logs.append(Log.read(path))
        recording = record(logs)
        fit = first_fit(recording, Spec("lugre", *choose_gravity(recording)))
        return parameters_of(fit), logs

    return one


@pytest.mark.long
def test_sessions_of_one_axis_agree_and_a_changed_level_is_found(session: Session) -> None:
    same = [session(seed) for seed in range(3)]
    worn, _ = session(9, coulomb_nm=0.084)
    pairs = [compare(a, b) for i, (a, _) in enumerate(same) for b, _ in same[:i]]
    assert [one.verdict for one in pairs].count("no_difference") >= len(pairs) - 1

    (before, _), (_, logs) = same[0], same[1]
    result = compare(before, worn, logs)
    assert "coulomb" in [one.name for one in result.differing]
    assert line(result, "coulomb").difference == pytest.approx(0.004, rel=0.1)
    assert not line(result, "viscous").differs
    # the logs are of the axis before it wore
    total, *each = result.errors
    assert total.better == "a"
    assert {one.experiment for one in each} == {"gravity", "sweep", "sine"}
    assert total.rows == sum(one.rows for one in each) == sum(len(log.frame) for log in logs)
    assert "On these logs A predicts better" in result.sentence

    alike = compare(before, same[2][0], logs).errors[0]
    assert alike.a == pytest.approx(alike.b, rel=0.01)
    assert alike.better is None


def test_logs_that_a_file_was_fitted_to_are_told(session: Session, tmp_path: Path) -> None:
    parameters, logs = session(1)
    result = compare(parameters, BASE, logs[2:])
    assert any("A was fitted to" in note and "sine-1.csv" in note for note in result.notes)
    assert not any("B was fitted to" in note for note in result.notes)
