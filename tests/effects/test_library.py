"""Every effect of the library keeps the promises that the rest of the program relies on."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.effects import registry
from idtool.effects.base import Effect, derivative
from idtool.errors import InputError
from idtool.model.contribution import FIELDS
from idtool.model.motion import Motion
from idtool.model.units import SUFFIXES
from testbench.effect_numbers import NUMBERS, RICHER

EFFECTS = pytest.mark.parametrize("effect", registry.library(), ids=registry.names())


@pytest.fixture(scope="module")
def motion() -> Motion:
    rng = np.random.default_rng(1)
    n, trials = 3000, 6
    trial = np.repeat(np.arange(trials), n // trials).astype(np.intp)
    time = 0.01 * np.arange(n)
    velocity = 0.4 * np.sin(2 * np.pi * 0.13 * time) + 0.1 * np.sin(2 * np.pi * 0.31 * time)
    for k, rest in enumerate((15, 20, 30, 60, 120, 40)):  # a pause in each trial
        velocity[k * 500 + 150 : k * 500 + 150 + rest] = 0.0
    payload = trial * 0.2
    return Motion(
        time=time,
        trial=trial,
        position=np.cumsum(velocity) * 0.01,
        velocity=velocity,
        acceleration=np.gradient(velocity, 0.01),
        payload=payload,
        gravity_factor=np.cos(0.3 + 0.1 * trial),
        tilt_alpha=0.3 + 0.1 * trial,
        tilt_beta=0.1 + 0.0 * trial,
        temperature=25 + 0.2 * time + 0.01 * rng.normal(size=n),
        load=(0.2 + 0.4 * payload) * np.cos(0.3 + 0.1 * trial),
        load_upright=0.2 + 0.4 * payload,
        torque_constant=2.67,
    )


def start_of(effect: Effect, motion: Motion) -> dict[str, float]:
    values = {**effect.constants(motion), **{c.name: c.null for c in effect.active(motion)}}
    return values | effect.starts(motion)[0]


@EFFECTS
def test_says_what_a_reader_needs(effect: Effect) -> None:
    assert effect.formula
    for text in (effect.title, effect.reveals, effect.citation):
        assert len(text) > 5
    assert set(effect.look_alikes) | set(effect.absorbs) <= set(registry.names())
    assert effect.name not in effect.look_alikes
    for parameter in effect.parameters:
        assert parameter.dimension in SUFFIXES
        assert parameter.lower < parameter.upper


@EFFECTS
def test_at_its_null_it_does_nothing(effect: Effect, motion: Motion) -> None:
    contribution = effect.contribute(motion, start_of(effect, motion))
    for name in FIELDS:
        assert np.max(np.abs(getattr(contribution, name))) < 1e-12, name


@EFFECTS
def test_away_from_its_null_it_does_something(effect: Effect, motion: Motion) -> None:
    values = start_of(effect, motion)
    shape = set(effect.starts(motion)[0])
    for coordinate in effect.active(motion):
        if coordinate.name not in shape:
            values[coordinate.name] += 0.01
    contribution = effect.contribute(motion, values)
    assert max(float(np.max(np.abs(getattr(contribution, name)))) for name in FIELDS) > 1e-6


@EFFECTS
def test_derivative_is_that_of_contribute(effect: Effect, motion: Motion) -> None:
    values = start_of(effect, motion)
    for coordinate in effect.active(motion):
        values[coordinate.name] += 0.013
    for coordinate in effect.active(motion):
        change = derivative(effect, motion, values, coordinate)
        small = 1e-5
        high = effect.contribute(motion, {**values, coordinate.name: values[coordinate.name] + small})
        low = effect.contribute(motion, {**values, coordinate.name: values[coordinate.name] - small})
        for name in FIELDS:
            expected = (np.asarray(getattr(high, name)) - np.asarray(getattr(low, name))) / (2 * small)
            error = np.max(np.abs(getattr(change, name) - expected))
            assert error <= 2e-3 * np.max(np.abs(expected)) + 1e-9, (coordinate.name, name)


@EFFECTS
def test_file_parameters_and_fit_coordinates_say_the_same(effect: Effect, motion: Motion) -> None:
    values = start_of(effect, motion)
    for k, coordinate in enumerate(effect.active(motion)):
        values[coordinate.name] += 0.01 * (k + 1)
    parameters = effect.to_parameters(values)
    assert set(parameters) <= {p.name for p in effect.parameters}
    assert {p.name for p in effect.parameters if not p.optional} <= set(parameters)
    again = effect.to_values(parameters)
    one, other = effect.contribute(motion, values), effect.contribute(motion, again)
    for name in FIELDS:
        assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-9)


@EFFECTS
def test_says_which_column_it_lacks(effect: Effect, motion: Motion) -> None:
    assert effect.missing(motion) is None
    bare = Motion(motion.time, motion.trial, motion.position, motion.velocity, motion.acceleration)
    if effect.needs:
        assert "needs" in (effect.missing(bare) or "")


def test_unknown_effect_suggests_the_nearest() -> None:
    with pytest.raises(InputError, match='did you mean "position_ripple"'):
        registry.get("position_riple")
    with pytest.raises(InputError, match='did you mean "position_ripple"'):
        registry.get("riple")  # a word of the name
    expected = 'did you mean "load_dependent_friction" or "position_dependent_friction"'
    with pytest.raises(InputError, match=expected):
        registry.get("dependent")


PLAIN = {name: {name: NUMBERS[name]} for case in RICHER.values() for name in case}


@pytest.mark.parametrize("case", [*RICHER.values(), *PLAIN.values()])
def test_the_form_of_values_has_all_of_them(case: dict[str, dict[str, float]], motion: Motion) -> None:
    ((name, numbers),) = case.items()
    values = registry.get(name).to_values(numbers)
    form = registry.get(name).form_of(values)
    assert set(values) <= {one.name for one in form.active(motion)} | set(form.constants(motion))
    assert len(form.active(motion)) <= len(values)
