"""The model sample by sample is the model of the fits, row for row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.control.load import Instant, compiled
from idtool.control.online import Load, OnlineModel, _Row
from idtool.effects import registry
from idtool.errors import InputError
from idtool.model import gravity
from idtool.model.contribution import Contribution, combine
from idtool.model.motion import Motion
from idtool.model.torque import Friction, predict
from idtool.parameters import Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.parameters.correction import Correction
from testbench.effect_numbers import NUMBERS, RICHER

from .double import BENCH, PAPER, parameters

#: What acts on the finished torque is in the tests of the sensing.
ON_THE_TORQUE = ("transport_delay", "torque_constant_saturation")
EFFECTS = {name: numbers for name, numbers in NUMBERS.items() if name not in ON_THE_TORQUE}


def test_every_effect_has_numbers_unless_it_is_not_compensated() -> None:
    assert set(NUMBERS) >= set(registry.names()) - {"external_periodic"}


def _motion(rows: int = 400) -> Motion:
    time = 0.01 * np.arange(rows)
    ones = np.ones(rows)
    velocity = 0.4 * np.sin(2 * np.pi * 0.7 * time) + 0.05 * np.sin(40 * time)
    position = np.concatenate([[0.1], 0.1 + np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * 0.01)])
    load = PAPER["base"] + PAPER["per_payload"] * 0.4
    factor = np.cos(0.3) * np.cos(-0.1)
    return Motion(
        time=time,
        trial=np.zeros(rows, dtype=np.intp),
        position=position,
        velocity=velocity,
        acceleration=np.gradient(velocity, 0.01),
        payload=0.4 * ones,
        gravity_factor=factor * ones,
        tilt_alpha=0.3 * ones,
        tilt_beta=-0.1 * ones,
        temperature=25.0 + 3.0 * time,
        load=load * factor * ones,
        load_upright=load * ones,
        torque_constant=2.67,
    )


def _totals(model: OnlineModel, motion: Motion) -> np.ndarray:
    """What the model carries at every sample, N m."""
    assert motion.temperature is not None
    return np.array(
        [
            model.update(
                Instant(
                    motion.time[k],
                    motion.step[k],
                    motion.position[k],
                    motion.velocity[k],
                    motion.acceleration[k],
                    0.4,
                    0.3,
                    -0.1,
                    motion.temperature[k],
                )
            ).total
            for k in range(len(motion))
        ]
    )


CASES = (
    {"none": {}} | {name: {name: numbers} for name, numbers in EFFECTS.items()} | {"all": EFFECTS} | RICHER
)


@pytest.mark.parametrize("values", [PAPER, BENCH], ids=["paper", "bench"])
@pytest.mark.parametrize("case", CASES)
def test_agrees_with_the_batch_model(values: dict[str, float], case: str) -> None:
    file = parameters(values, **CASES[case])
    motion = _motion()
    parts = [
        registry.get(entry.name).contribute(motion, registry.get(entry.name).to_values(entry.values()))
        for entry in file.effects
    ]
    weight = gravity.columns("slide", motion) @ np.array([values["base"], values["per_payload"]])
    friction = Friction(
        **{k: v for k, v in values.items() if k not in ("base", "per_payload")},
    )
    effect = combine([*parts, Contribution(torque=weight)])
    wanted = predict(motion, friction, effect, np.zeros(1), settled=False)

    model = OnlineModel(file)
    got = _totals(model, motion)
    np.testing.assert_allclose(got, wanted.torque, rtol=1e-9, atol=1e-12)
    assert model.bristle == pytest.approx(wanted.bristle[-1], rel=1e-9)


@pytest.mark.parametrize("first", [True, False])
def test_what_holds_a_part_of_the_friction_is_friction(first: bool) -> None:
    """Elements of 0.03 and 0.01 N m that yield over 0.01 and 0.02 rad, and a load of 0.05 N m beside them."""
    elements = {"stiffness": 3.0, "yield": 0.03, "stiffness_2": 0.5, "yield_2": 0.01, "of_friction": 1.0}
    both = {"hysteresis": elements, "torque_offset": {"offset": 0.05}}
    names = sorted(both, reverse=not first)
    model = OnlineModel(parameters(BENCH, **{name: both[name] for name in names}))
    plain = OnlineModel(parameters(BENCH))
    level = 0.04 / BENCH["coulomb"]
    assert model.held == pytest.approx((level, 0.04 / 3.5))
    assert plain.held[0] == 0.0
    assert model.presliding_stiffness == pytest.approx(BENCH["bristle_stiffness"] + 3.5)
    assert plain.presliding_stiffness == BENCH["bristle_stiffness"]
    for k in range(2):
        load = model.update(Instant(0.01 * k, 0.01, 0.001 * k, 0.1 * k, travel=0.001 * k))
    assert load.effects == pytest.approx(0.05)
    bristle = BENCH["bristle_stiffness"] * model.bristle
    assert load.elastic == pytest.approx(bristle + 3.5 * 0.001)
    # what a rest was wrong by fades with both, each as it slips
    own = np.exp(-BENCH["bristle_stiffness"] * 0.001 / model_level(model, 0.1))
    assert load.kept == pytest.approx(own + level * (np.exp(-0.001 * 3.5 / 0.04) - own))


def model_level(model: OnlineModel, speed: float) -> float:
    """The level that is left to the bristle, N m."""
    share = (speed / model.stribeck_velocity) ** 2
    return float(
        model.coulomb + (model.static - model.coulomb) * np.exp(-share) - model.held[0] * model.coulomb
    )


@pytest.mark.parametrize("speed", [1e-7, -3e-6, 2e-5])
def test_a_creeping_bristle_bends_by_what_the_axis_travels(speed: float) -> None:
    """So slowly that an exponential would lose the digits."""
    model = OnlineModel(parameters(BENCH))
    for k in range(3):
        model.update(Instant(0.01 * k, 0.01, 0.1 + 0.01 * k * speed, speed))
    share = BENCH["bristle_stiffness"] * 0.02 * abs(speed) / BENCH["static"]  # of how far it can bend
    assert model.bristle == pytest.approx(0.02 * speed * (1.0 - 0.5 * share), rel=1e-9)


def test_every_effect_of_the_library_is_compiled() -> None:
    assert all(compiled(effect.name) for effect in registry.library() if not effect.page)
    assert not compiled("an_effect_from_outside")


def test_a_file_without_a_bristle_acts_as_plain_friction() -> None:
    file = parameters(BENCH)
    model = OnlineModel(Parameters(file.axis, file.gravity_model, file.gravity, file.static))
    for k in range(50):
        load = model.update(Instant(0.01 * k, 0.01, 0.003 * k, 0.3, tilt_alpha=1.5707963267948966))
    steady = (
        BENCH["coulomb"] + (BENCH["static"] - BENCH["coulomb"]) * np.exp(-((0.3 / 0.09) ** 2)) + 0.3 * 0.08
    )
    assert load.friction == pytest.approx(steady, rel=1e-6)


def test_an_arm_carries_its_weight_whatever_the_tilt_columns_say() -> None:
    """As in the batch model, whose regressors of an arm are sin q and cos q alone."""
    weight = {"sin": Parameter(0.3), "cos": Parameter(-0.1)}
    model = OnlineModel(replace(parameters(BENCH), gravity_model="arm", gravity=weight))
    load = model.update(Instant(0.0, 0.01, 0.5, 0.0, tilt_alpha=0.7, tilt_beta=0.2))
    assert load.gravity == pytest.approx(0.3 * np.sin(0.5) - 0.1 * np.cos(0.5))


def test_an_axis_that_gravity_does_not_act_on_carries_no_load() -> None:
    """A horizontal one: its file says so. One that says nothing of gravity is refused below."""
    file = replace(parameters(BENCH), gravity_model=None, gravity={}, weightless=True)
    load = OnlineModel(file).update(Instant(0.0, 0.01, 0.5, 0.0, payload=0.4))
    assert load.gravity == 0.0


@pytest.mark.parametrize("missing", ["axis", "gravity", "static"])
def test_what_a_controller_cannot_do_without_is_said(missing: str) -> None:
    file = parameters()
    file = replace(file, **({"axis": Axis()} if missing == "axis" else {missing: {}}))
    with pytest.raises(InputError, match=r"torque constant|gravity model|friction model"):
        OnlineModel(file)


@pytest.mark.parametrize("names", [[name] for name in EFFECTS] + [list(EFFECTS)], ids=str)
def test_an_effect_that_is_not_compiled_is_asked_by_its_own_class(
    names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the library holds works in the controller; being written out in `load` only makes it fast."""
    file = parameters(BENCH, **{name: EFFECTS[name] for name in names})
    motion = _motion()
    fast = _totals(OnlineModel(file), motion)
    monkeypatch.setattr("idtool.control.load.compiled", lambda _: False)
    slow = OnlineModel(file)
    np.testing.assert_allclose(_totals(slow, motion), fast, rtol=1e-9, atol=1e-12)
    slow.reset()
    np.testing.assert_allclose(_totals(slow, motion), fast, rtol=1e-9, atol=1e-12)
    slow.drop(names[-1], "for a test")
    assert not slow.uses(names[-1])


def test_so_is_one_on_an_arm_that_is_tilted(monkeypatch: pytest.MonkeyPatch) -> None:
    name = "load_dependent_friction"
    weight = {"sin": Parameter(0.3), "cos": Parameter(-0.1)}
    file = replace(parameters(BENCH, **{name: EFFECTS[name]}), gravity_model="arm", gravity=weight)
    fast = _totals(OnlineModel(file), _motion())
    monkeypatch.setattr("idtool.control.load.compiled", lambda _: False)
    np.testing.assert_allclose(_totals(OnlineModel(file), _motion()), fast, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("variable", ["position", "velocity", "acceleration", "temperature"])
def test_a_correction_adds_what_it_adds_to_a_prediction(variable: str) -> None:
    motion = _motion()
    values = getattr(motion, variable)
    low, high = np.quantile(values, [0.2, 0.9])  # some samples lie outside, where it is zero
    correction = Correction(
        variable, False, np.linspace(low, high, 6), np.array([0, 0.02, -0.03, 0.01, 0.04, 0])
    )
    file = parameters(BENCH, inertia={"inertia": 0.02})
    added = _totals(OnlineModel(file, correction), motion) - _totals(OnlineModel(file), motion)
    np.testing.assert_allclose(added, correction(motion), atol=1e-12)
    assert np.any(added == 0.0)
    assert np.any(np.abs(added) > 0.02)


def test_a_correction_with_a_direction_follows_the_bristle_at_rest() -> None:
    """A noisy speed around zero has no sign; forwards, backwards and between, what friction holds has."""
    motion = _motion()
    correction = Correction("position", True, np.array([-1.0, 0.0, 1.0]), np.array([0.0, 0.05, 0.0]))
    with_it, without = OnlineModel(parameters(BENCH), correction), OnlineModel(parameters(BENCH))
    added = _totals(with_it, motion) - _totals(without, motion)
    fast = np.abs(motion.velocity) > 0.35
    np.testing.assert_allclose(added[fast], correction(motion)[fast], rtol=0.05)
    assert np.all(np.abs(added) <= 0.05)
    for k in range(3):  # the axis comes to rest
        held = with_it.update(Instant(9.97 + 0.01 * k, 0.01, 0.1, 0.0, 0.0, 0.4, 0.3, -0.1)).effects
    for k, noise in enumerate((1e-9, -1e-9, 1e-9)):
        again = with_it.update(Instant(10.0 + 0.01 * k, 0.01, 0.1, noise, 0.0, 0.4, 0.3, -0.1)).effects
        assert again == pytest.approx(held, rel=1e-3)
    assert abs(held) > 0.01


def test_an_instant_that_tells_only_the_motion_is_of_an_empty_upright_axis() -> None:
    assert Instant(1.0, 0.01, 0.2, 0.3)[4:8] == (0.0, 0.0, 0.0, 0.0)
    model = OnlineModel(parameters(BENCH))
    assert model.update(Instant(0.0, 0.01, 0.1, 0.0)).gravity == pytest.approx(BENCH["base"])


def test_the_first_sample_leaves_the_bristle_as_it_is() -> None:
    """It has no step before it: whoever corrects the deflection at rest may build on it."""
    model = OnlineModel(parameters(BENCH))
    assert model.update(Instant(0.0, 0.01, 0.1, 0.3)).kept == 1.0
    travelled = BENCH["bristle_stiffness"] * 0.003
    level = BENCH["coulomb"] + (BENCH["static"] - BENCH["coulomb"]) * np.exp(
        -((0.3 / BENCH["stribeck_velocity"]) ** 2)
    )
    kept = model.update(Instant(0.01, 0.01, 0.103, 0.3)).kept
    assert kept == pytest.approx(np.exp(-travelled / level), rel=1e-9)
    model.reset()
    assert model.update(Instant(0.0, 0.01, 0.1, 0.3)).kept == 1.0


def test_what_a_file_does_not_hold_is_nothing() -> None:
    plain = OnlineModel(parameters(BENCH))
    assert plain.inertia == 0.0
    assert not plain.needs_temperature
    assert plain.weight_of(0.0, 0.3, 0.1) == 0.0
    heavy = OnlineModel(parameters(BENCH, inertia={"inertia": 0.02}))
    assert heavy.inertia == 0.02
    assert heavy.weight_of(0.4, 0.3, -0.1) == pytest.approx(
        0.4 * BENCH["per_payload"] * np.cos(0.3) * np.cos(0.1)
    )
    weight = {"sin": Parameter(0.3), "cos": Parameter(-0.1)}
    arm = OnlineModel(replace(parameters(BENCH), gravity_model="arm", gravity=weight))
    assert arm.weight_of(0.4, 0.3, -0.1) == 0.0


@pytest.mark.parametrize("variable", ["position", "temperature"])
def test_a_correction_over_the_temperature_needs_one(variable: str) -> None:
    correction = Correction(variable, False, np.array([20.0, 30.0]), np.array([0.01, 0.02]))
    assert OnlineModel(parameters(BENCH), correction).needs_temperature is (variable == "temperature")


def test_the_back_emf_brakes_where_the_reading_is_of_the_voltage_alone() -> None:
    """K / R = 0.5 N m/V and R = 2 ohm: K^2 / R = 0.5 N m s/rad beside the friction of the file."""
    file = parameters(BENCH)
    friction = file.static["viscous"].value
    volts = OnlineModel(replace(file, axis=Axis(torque_per_volt=0.5, resistance=2.0)))
    assert (volts.torque_constant, volts.viscous) == (0.5, pytest.approx(friction + 0.5))
    amperes = OnlineModel(replace(file, axis=Axis(torque_constant=2.67, resistance=2.0)))
    assert (amperes.torque_constant, amperes.viscous) == (2.67, friction)
    own = OnlineModel(replace(file, axis=Axis(torque_per_volt=0.5, resistance=2.0, effort="voltage")))
    assert (own.torque_constant, own.viscous) == (1.0, friction)


def test_a_correction_over_a_temperature_that_nobody_measures_is_none() -> None:
    correction = Correction("temperature", False, np.array([20.0, 30.0]), np.array([0.05, 0.05]))
    model = OnlineModel(parameters(BENCH), correction)
    assert model.update(Instant(0.0, 0.01, 0.1, 0.0)).effects == 0.0
    assert model.update(Instant(0.01, 0.01, 0.1, 0.0, temperature=25.0)).effects == pytest.approx(0.05)


def test_what_arrives_of_the_motor_s_torque() -> None:
    """A tenth less at 2 N m and 5 % more at any."""
    load = Load(saturation=0.05, gain=0.05)
    assert load.arriving(2.0) == pytest.approx(2.0 * (1.0 + 0.05 - 0.1))
    assert load.arriving(-2.0) == pytest.approx(-1.9)
    assert Load().arriving(2.0) == 2.0
    assert Load() == Load(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    parts = Load(gravity=0.1, elastic=0.02, damping=0.003, effects=-0.04)
    assert (parts.total, parts.friction) == pytest.approx((0.083, 0.023))
    with pytest.raises(AttributeError):
        load.satturation = 1.0  # type: ignore[attr-defined]


def test_an_effect_from_outside_is_asked_about_the_sample_as_it_is() -> None:
    row = _Row(2.67, with_temperature=True)
    row.fill(*range(1, 12))
    names = ("time", "position", "velocity", "acceleration", "payload", "gravity_factor", "tilt_alpha",
             "tilt_beta", "temperature", "load", "load_upright")  # fmt: skip
    assert [float(getattr(row.motion, name)[0]) for name in names] == list(range(1, 12))
    assert row.motion.torque_constant == 2.67
    assert _Row(2.67, with_temperature=False).motion.temperature is None


@pytest.mark.parametrize(
    ("elastic", "level", "share"),
    [(0.0, 0.0, 0.0), (0.3, 0.1, 1.0), (-0.3, 0.1, -1.0), (-0.05, 0.1, -0.5), (0.05, 0.1, 0.5)],
)
def test_a_correction_with_a_direction_is_never_more_than_itself(
    elastic: float, level: float, share: float
) -> None:
    """A falling friction level leaves the bristle too far bent; before any sample there is no direction."""
    correction = Correction("position", True, np.array([-1.0, 0.0, 1.0]), np.array([0.05, 0.05, 0.05]))
    model = OnlineModel(parameters(BENCH), correction)
    model.load.elastic, model.load.level = elastic, level
    assert model.update(Instant(0.0, 0.01, 0.1, 0.0)).effects == pytest.approx(0.05 * share)


def test_what_is_reset_carries_nothing() -> None:
    model = OnlineModel(parameters(BENCH, torque_offset={"offset": 0.07}))
    for k in range(5):
        load = model.update(Instant(0.01 * k, 0.01, 0.003 * k, 0.3))
    assert min(map(abs, (load.gravity, load.elastic, load.damping, load.effects))) > 0.001
    model.reset()
    assert (load.gravity, load.elastic, load.damping, load.effects) == (0.0, 0.0, 0.0, 0.0)
    assert model.bristle == 0.0


@pytest.mark.parametrize(("share", "beside"), [({}, 0.05), ({"of_friction": 1.0}, 0.0)], ids=["own", "of it"])
def test_a_hysteresis_beside_the_friction_level_holds_at_rest_too(
    share: dict[str, float], beside: float
) -> None:
    model = OnlineModel(parameters(BENCH, hysteresis={"stiffness": 5.0, "yield": 0.05} | share))
    assert model.friction_bound == max(BENCH["coulomb"], BENCH["static"])
    assert model.grip == pytest.approx(model.friction_bound + beside)
