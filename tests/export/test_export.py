"""Exports: what the files hold, what they say they lack, and that MuJoCo computes the very model."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid

from idtool.effects import registry
from idtool.errors import InputError, UsageError
from idtool.export import simple
from idtool.export.base import number
from idtool.export.targets import TARGETS, export
from idtool.export.xml_text import document
from idtool.log import Log
from idtool.model.contribution import Contribution, combine
from idtool.model.motion import Array, Motion
from idtool.model.torque import Friction, predict
from idtool.model.units import Kind
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.parameters.drive import Drive
from idtool.verbs.predict import predict as predict_log
from idtool.verbs.simulate import simulate as simulate_log

STATIC = {"coulomb": 0.08, "static": 0.115, "stribeck_velocity": 0.08, "viscous": 0.12}
DYNAMIC = {"bristle_stiffness": 8.0, "bristle_damping": 0.2}
INERTIA = {"inertia": {"inertia": 0.008}}
RIPPLE = {"cycles": 7.5, "amplitude_1": 0.03, "phase_1": 0.4, "amplitude_2": 0.0, "phase_2": 0.0}
BENT = {"shape_2": 0.01, "center": 0.0, "half_stroke": 1.0}
EFFECTS = INERTIA | {
    "direction_asymmetry": {"asymmetry": -0.05},
    "nonlinear_viscous": {"quadratic": 0.05},
    "position_stiffness": {"stiffness": 0.1, "neutral": 0.2},
    "position_ripple": RIPPLE | {"amplitude_2": 0.01, "phase_2": 1.0},
    "torque_offset": {"offset": 0.02},
}
UPHILL = INERTIA | {"direction_asymmetry": {"asymmetry": 0.08}}


def axis(
    effects: dict[str, dict[str, float]] | None = None,
    *,
    kind: Kind = "rotary",
    dynamic: bool = True,
    static: dict[str, float] | None = None,
) -> Parameters:
    entries = tuple(
        EffectEntry(name, {key: Parameter(value) for key, value in values.items()})
        for name, values in (INERTIA if effects is None else effects).items()
    )
    return Parameters(
        axis=Axis(kind, 2.67),
        gravity_model="slide",
        gravity={"base": Parameter(0.2), "per_payload": Parameter(0.4)},
        static={name: Parameter(value) for name, value in (static or STATIC).items()},
        dynamic={name: Parameter(value) for name, value in DYNAMIC.items()} if dynamic else {},
        effects=entries,
    )


def friction(parameters: Parameters) -> Friction:
    values = {name: p.value for name, p in (parameters.static | parameters.dynamic).items()}
    return Friction(**({"bristle_stiffness": 1e4, "bristle_damping": 0.0} | values))


def torque(parameters: Parameters, motion: Motion) -> Array:
    """The model of the package, without gravity."""
    parts = [
        registry.get(e.name).contribute(
            motion, registry.get(e.name).from_file(e.values(), parameters.axis.kind)
        )
        for e in parameters.effects
    ]
    effect = combine([Contribution(), *parts])
    return predict(motion, friction(parameters), effect, np.zeros(motion.stretches)).torque


def motion_of(time: Array, position: Array, velocity: Array, acceleration: Array) -> Motion:
    trial = np.zeros(len(time), dtype=np.intp)
    return Motion(time, trial, position, velocity, acceleration, torque_constant=2.67)


# --- MuJoCo ---------------------------------------------------------------------------------------------


def simulate(text: str, step: float, drive: Callable[[float], float]) -> tuple[Motion, Array]:
    """Three seconds in MuJoCo under a torque: the motion and the torque of every step."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = step
    data = mujoco.MjData(model)
    rows = np.empty((round(3.0 / step), 4))
    for k in range(len(rows)):
        data.ctrl[:] = 0.0
        data.ctrl[0] = drive(k * step)
        rows[k] = k * step, data.qpos[0], data.qvel[0], data.ctrl[0]
        mujoco.mj_step(model, data)
    time, position, velocity, applied = rows.T
    return motion_of(time, position, velocity, np.gradient(velocity, step)), applied


def drive(t: float) -> float:
    return 0.25 * np.sin(2 * np.pi * 0.7 * t) + 0.1 * np.sin(2 * np.pi * 2.3 * t)


@pytest.mark.parametrize("kind", ["rotary", "linear"])
@pytest.mark.parametrize("effects", [INERTIA, EFFECTS, UPHILL], ids=["LuGre", "and effects", "and uphill"])
def test_mujoco_computes_the_same_model(kind: Kind, effects: dict[str, dict[str, float]]) -> None:
    """The difference is that of the time step: it shrinks with it."""
    parameters = axis(effects, kind=kind)
    text = export("mujoco", parameters).text
    error = {}
    for step in (1e-3, 2e-4):
        motion, applied = simulate(text, step, drive)
        assert np.abs(motion.velocity).max() > 1.0
        left = applied - torque(parameters, motion)
        error[step] = float(np.sqrt(np.mean(left**2)) / np.sqrt(np.mean(applied**2)))
    assert error[1e-3] < 0.015
    assert error[2e-4] < 0.25 * error[1e-3]


def test_mujoco_rising_stribeck_curve() -> None:
    parameters = axis(static=STATIC | {"coulomb": 0.115, "static": 0.08})
    motion, applied = simulate(export("mujoco", parameters).text, 2e-4, drive)
    left = applied - torque(parameters, motion)
    assert np.sqrt(np.mean(left**2)) < 0.005 * np.sqrt(np.mean(applied**2))


def test_mujoco_sticks_until_break_away() -> None:
    """Under a torque that rises to less than the stiction the bristle only bends; then it slides."""
    text = export("mujoco", axis()).text
    held, _ = simulate(text, 5e-4, lambda t: 0.1 * t / 3)
    slides, _ = simulate(text, 5e-4, lambda t: 0.13 * t / 3)
    assert np.abs(held.position).max() < 2 * STATIC["static"] / DYNAMIC["bristle_stiffness"]
    assert slides.position[-1] > 4 * STATIC["static"] / DYNAMIC["bristle_stiffness"]


@pytest.mark.parametrize("kind", ["rotary", "linear"])
def test_mujoco_friction_is_as_strong_on_either_kind_of_axis(kind: Kind) -> None:
    """On a slide MuJoCo scales frictionloss by the mass of the body."""
    text = export("mujoco", axis(kind=kind), friction="coulomb").text
    held, _ = simulate(text, 5e-4, lambda t: 0.9 * STATIC["coulomb"])
    assert abs(held.position[-1]) < 5e-3


def test_mujoco_coulomb_and_viscous() -> None:
    parameters = axis()
    exported = export("mujoco", parameters, friction="coulomb")
    motion, applied = simulate(exported.text, 2e-4, drive)
    moving = np.abs(motion.velocity) > 0.05
    model = (
        STATIC["coulomb"] * np.sign(motion.velocity)
        + STATIC["viscous"] * motion.velocity
        + 0.008 * motion.acceleration
    )
    left = (applied - model)[moving]
    assert np.sqrt(np.mean(left**2)) < 0.02 * np.sqrt(np.mean(applied**2))
    lost = "\n".join(exported.plan.lost)
    assert "the Stribeck curve: a stiction of 0.115 N m beside the Coulomb level of 0.08 N m" in lost
    assert "the bristle of the LuGre model" in lost
    assert "with logs they are fitted" in "\n".join(exported.plan.notes)
    joint = ET.fromstring(exported.text).find(".//joint")
    assert joint is not None
    assert (joint.get("frictionloss"), joint.get("damping")) == ("0.08", "0.12")


def test_what_mujoco_cannot_carry_is_said_in_the_file() -> None:
    extra = {
        "transport_delay": {"delay": 0.002},
        "position_ripple": RIPPLE | {"turned_amplitude_1": 0.004, "turned_phase_1": 0.1},
        "position_stiffness": {"stiffness": 0.1, "neutral": 0.2} | BENT,
    }
    exported = export("mujoco", axis(INERTIA | extra))
    for text in (
        "gravity: the masses of your model carry it",
        "position stiffness: its bends",
        "position ripple: what of it changes sides",
        "transport delay:",
        "standard errors",
    ):
        assert any(text in sentence for sentence in exported.plan.lost)
        assert f"Not carried: {text}" in exported.text
    kept = {entry.name: entry.values() for entry in exported.plan.model.effects}
    assert set(kept) == {"inertia", "position_ripple", "position_stiffness"}
    assert kept["position_ripple"] == RIPPLE
    assert "shape_2" not in kept["position_stiffness"]
    push = {"position_stiffness": {"stiffness": -0.1, "neutral": 0.2}}
    assert any("below zero" in sentence for sentence in export("mujoco", axis(INERTIA | push)).plan.lost)


def test_cogging_of_a_linear_axis_counts_radians_per_metre() -> None:
    linear = replace(axis(INERTIA | {"position_ripple": RIPPLE}), axis=Axis("linear", 35.0))
    actuator = ET.fromstring(export("mujoco", linear).text).find(".//dcmotor")
    assert actuator is not None
    _, n, _ = map(float, str(actuator.get("cogging")).split())
    assert n == pytest.approx(2.0 * np.pi * RIPPLE["cycles"], rel=1e-6)


def test_a_stiffness_at_its_bound_is_no_bristle() -> None:
    parameters = axis()
    stuck = {**parameters.dynamic, "bristle_stiffness": Parameter(1e5, at_bound=True)}
    exported = export("mujoco", replace(parameters, dynamic=stuck))
    assert "dcmotor" not in exported.text.split("-->")[1]
    assert "frictionloss" in exported.text.split("-->")[1]
    assert not any("bristle" in sentence for sentence in exported.plan.lost)


# --- Simplified friction ---------------------------------------------------------------------------------


def log_of(parameters: Parameters, top_speed: float = 0.4, noise: float = 0.002) -> Log:
    """Forty seconds of speeds both ways, on its side (no gravity), as the model of the package has it."""
    time = np.arange(4000) * 0.01
    speed = 2 * np.pi * 0.25
    velocity = top_speed * np.sin(speed * time) * np.sin(0.1 * time)
    position = cumulative_trapezoid(velocity, time, initial=0.0)
    motion = motion_of(time, position, velocity, np.gradient(velocity, 0.01))
    measured = torque(parameters, motion) + noise * np.random.default_rng(0).standard_normal(len(time))
    frame = pd.DataFrame(
        {
            "trial": 0,
            "time_s": time,
            "position_rad": position,
            "velocity_rad_s": velocity,
            "torque_nm": measured,
            "tilt_alpha_rad": np.pi / 2,
            "tilt_beta_rad": 0.0,
            "payload_kg": 0.0,
        }
    )
    return Log(frame, parameters.axis, "sweep", {}, "/data/sweep.csv")


def test_a_simplified_law_is_fitted_to_the_speeds_of_the_logs() -> None:
    parameters = axis({})
    logs = {top: log_of(parameters, top) for top in (0.1, 2.0)}
    found = {top: export("urdf", parameters, [log]) for top, log in logs.items()}
    for top, exported in found.items():
        errors = {model: value["sweep"]["rmse"] for model, value in exported.errors.items()}
        assert errors["full"] == pytest.approx(0.002, rel=0.1)
        assert errors["full"] < errors["exported"] < errors["copied"]
        assert f"{errors['exported']:.4g} N m" in exported.text
        assert "sweep.csv" in exported.text
        assert "/data" not in exported.text
        stated = re.search(r"for speeds up to (\S+) rad/s", " ".join(exported.plan.notes))
        assert stated
        assert float(stated[1]) == pytest.approx(logs[top].frame["velocity_rad_s"].abs().max(), rel=0.02)
        # what was fitted to these speeds is better there than what was fitted to the others
        other = found[2.0 if top == 0.1 else 0.1].plan.model
        assert errors["exported"] < predict_log([logs[top]], other).errors["sweep"]["rmse"]
    slow, fast = (found[top].plan.model.static["viscous"].value for top in (0.1, 2.0))
    # fast motion shows the viscous friction itself, slow motion with reversals what the bristle does
    assert abs(fast - STATIC["viscous"]) < 0.1 * abs(slow - STATIC["viscous"])


def test_of_two_simplified_laws_the_file_holds_the_one_that_simulates_better() -> None:
    """Where an inertia is known; least squares of the torque are not always that one."""
    parameters = axis()
    for top, fitted in ((0.1, True), (0.4, False)):
        log = log_of(parameters, top)
        held = export("urdf", parameters, [log]).plan.model
        models = [simple.copied(parameters), simple.fitted(parameters, [log])[0]]
        assert held.static == models[fitted].static
        errors = [simulate_log(log, model).rms_windows for model in models]
        assert errors[fitted] < 0.8 * errors[not fitted]
        torque = [simple.total(predict_log([log], model).errors) for model in models]
        assert torque[1] < torque[0]


def test_what_a_missing_effect_took_up_goes_elsewhere() -> None:
    """The exponent of a Stribeck curve that MuJoCo lacks: the other numbers take up what they can."""
    spring = {"position_stiffness": {"stiffness": 0.1, "neutral": 0.2}}
    lacking = {"stribeck_shape": {"exponent": 0.7}}
    ripple = {"position_ripple": RIPPLE}
    parameters = axis(INERTIA | spring | ripple | lacking)
    logs = [log_of(parameters)]
    exported = export("mujoco", parameters, logs)
    errors = {model: value["sweep"]["rmse"] for model, value in exported.errors.items()}
    assert errors["full"] == pytest.approx(0.002, rel=0.1)
    assert errors["full"] < errors["exported"] < 0.9 * errors["copied"]
    assert any("was refitted" in note for note in exported.plan.notes)
    assert exported.plan.model.gravity == parameters.gravity
    kept = exported.plan.model.effect("position_ripple")
    assert kept
    assert {entry.name for entry in exported.plan.model.effects} == {
        "inertia",
        *spring,
        *ripple,
    }


def test_values_that_the_data_did_not_determine_are_named() -> None:
    parameters = axis()
    doubtful = {**parameters.static, "viscous": Parameter(0.1, identified=False)}
    for target in TARGETS.keys() - {"cogging"}:
        assert "the data did not determine" not in export(target, parameters).text
        text = export(target, replace(parameters, static=doubtful)).text
        assert "the data did not determine: viscous" in text


def test_a_law_that_is_simple_already_stays() -> None:
    static = STATIC | {"static": STATIC["coulomb"]}
    parameters = axis(dynamic=False, static=static)
    exported = export("urdf", parameters, [log_of(parameters)])
    dynamics = ET.fromstring(exported.text).find(".//dynamics")
    assert dynamics is not None
    assert float(dynamics.get("friction") or 0) == pytest.approx(0.08, rel=0.03)
    assert float(dynamics.get("damping") or 0) == pytest.approx(0.12, rel=0.03)
    assert not any("Stribeck" in sentence for sentence in exported.plan.lost)


def test_the_whole_model_needs_no_second_error() -> None:
    parameters = axis()
    logs = [log_of(parameters)]
    assert set(export("json", parameters, logs).errors) == {"full"}
    exported = export("mujoco", parameters, logs)
    assert exported.errors["exported"] == exported.errors["full"]
    lacking = export("mujoco", axis(INERTIA | {"stribeck_shape": {"exponent": 1.5}}), logs)
    assert lacking.errors["exported"] != lacking.errors["full"]


# --- URDF, ROS 2, JSON -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("kind", "joint_type"), [("rotary", "continuous"), ("linear", "prismatic")])
def test_urdf_is_read_by_a_program_that_reads_urdf(kind: Kind, joint_type: str) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    text = export("urdf", axis(kind=kind), joint="elbow").text
    joint = ET.fromstring(text).find("joint")
    assert joint is not None
    assert (joint.get("name"), joint.get("type")) == ("elbow", joint_type)
    model = mujoco.MjModel.from_xml_string(text)
    assert model.dof_damping[0] == pytest.approx(0.12)
    assert model.dof_frictionloss[0] == pytest.approx(0.08)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.dof_M0[0] == pytest.approx(0.008)


def test_ros2_parameters() -> None:
    yaml = pytest.importorskip("yaml")
    parameters = axis(INERTIA | {"transport_delay": {"delay": 1e-5}}, static=STATIC | {"viscous": 1.0})
    text = export("ros2", parameters, joint="elbow").text
    values = yaml.safe_load(text)["/**"]["ros__parameters"]["elbow"]
    assert values["kind"] == "rotary"
    assert values["friction"]["static"]["coulomb_nm"] == 0.08
    # ROS 2 refuses an integer or a text where a node declared a double
    assert isinstance(values["friction"]["static"]["viscous_nm_s_per_rad"], float)
    assert values["effects"]["transport_delay"] == {"delay_s": 1e-5}
    assert values["effects"]["inertia"] == {"inertia_kg_m2": 0.008}


def test_json_is_the_whole_file() -> None:
    parameters = axis()
    found = json.loads(export("json", parameters, joint="elbow").text)
    assert found["name"] == "elbow"
    assert found["parameters"] == parameters.to_document()


# --- Isaac Lab, BAM, cogging map --------------------------------------------------------------------------


def python_of(text: str) -> dict[str, dict[str, Any]]:
    """What the configurations of a snippet are called with."""
    found: dict[str, dict[str, Any]] = {}

    def config(kind: str) -> Callable[..., None]:
        return lambda **values: found.__setitem__(kind, values)

    names = {name: config(name) for name in ("ImplicitActuatorCfg", "BuiltinPositionActuatorCfg")}
    lines = [line for line in text.splitlines() if not line.startswith("from ")]
    exec("\n".join(lines), names)
    return found


def test_isaac_and_mjlab_get_armature_friction_and_gains() -> None:
    bare = python_of(export("isaac", axis(), joint="elbow").text)
    isaac, mjlab = bare["ImplicitActuatorCfg"], bare["BuiltinPositionActuatorCfg"]
    assert (isaac["armature"], mjlab["armature"]) == (0.008, 0.008)
    assert isaac["friction"] == isaac["dynamic_friction"] == mjlab["frictionloss"] == 0.08
    assert isaac["viscous_friction"] == 0.12
    assert isaac["stiffness"] == 0.0
    gains = {name: Parameter(value) for name, value in (("position_gain", 5.0), ("velocity_gain", 0.2))}
    loop = Drive("duty", **gains, limit=Parameter(1.0), delay=Parameter(0.0))
    volts = Axis("rotary", torque_per_volt=0.3)
    told = python_of(export("isaac", replace(axis(), axis=volts, drive=loop)).text)
    assert told["ImplicitActuatorCfg"]["stiffness"] == pytest.approx(5.0 * 12.0 * 0.3)
    assert told["BuiltinPositionActuatorCfg"]["damping"] == pytest.approx(0.2 * 12.0 * 0.3)


def test_bam_takes_what_means_the_same() -> None:
    known = Axis("rotary", 2.67, resistance=4.0)
    extra = {"load_dependent_friction": {"mu": 0.1}}
    exported = export("bam", replace(axis(INERTIA | extra), axis=known))
    document = json.loads(exported.text)
    assert (document["model"], document["kt"], document["R"]) == ("m2", 2.67, 4.0)
    assert document["friction_base"] + document["friction_stribeck"] == pytest.approx(STATIC["static"])
    assert (document["friction_viscous"], document["armature"], document["alpha"]) == (0.12, 0.008, 2.0)
    assert any("load dependent friction" in sentence for sentence in exported.plan.lost)
    plain = json.loads(export("bam", axis(static=STATIC | {"static": STATIC["coulomb"]})).text)
    assert plain["model"] == "m1"
    assert not {"R", "dtheta_stribeck"} & set(plain)
    with pytest.raises(InputError, match="find its constant with ffc-id calibrate"):
        export("bam", replace(axis(), axis=Axis("rotary", effort="voltage")))


def test_a_cogging_map_is_what_the_motor_adds() -> None:
    exported = export("cogging", axis(INERTIA | {"position_ripple": RIPPLE}))
    rows = [line for line in exported.text.splitlines() if not line.startswith("#")]
    assert rows[0] == "angle_rad,compensation_nm,compensation_a"
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows[1:]])
    assert table.shape == (1024, 3)
    wave = RIPPLE["amplitude_1"] * np.sin(RIPPLE["cycles"] * table[:, 0] + RIPPLE["phase_1"])
    assert np.allclose(table[:, 1], wave, atol=1e-6)
    assert np.allclose(table[:, 2], wave / 2.67, atol=1e-6)
    with pytest.raises(InputError, match="holds no position ripple of a rotary axis"):
        export("cogging", axis())


# --- Refusals and texts ----------------------------------------------------------------------------------


@pytest.mark.parametrize("target", TARGETS)
def test_names_that_are_none(target: str) -> None:
    for name in ("", "a b", "1a", 'x"', "a--b"):
        with pytest.raises(UsageError, match="is no name for a joint"):
            export(target, axis(), joint=name)


def test_refusals() -> None:
    with pytest.raises(InputError, match='did you mean "mujoco"'):
        export("mujco", axis())
    for target in ("mujoco", "urdf"):
        with pytest.raises(InputError, match="holds no friction; fit it first"):
            export(target, replace(axis(), static={}))
    other = replace(log_of(axis()), axis=Axis("rotary", 1.0))
    with pytest.raises(InputError, match="is of another axis"):
        export("urdf", axis(), [other])


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_floats_to_every_reader(value: float) -> None:
    yaml = pytest.importorskip("yaml")
    text = number(value)
    assert float(text) == pytest.approx(value, rel=1e-8, abs=0)
    assert isinstance(yaml.safe_load(text), float)


@given(st.lists(st.text(st.characters(codec="utf-8", exclude_categories=["C"])), max_size=4))
def test_any_remark_fits_an_xml_comment(remarks: list[Any]) -> None:
    root = ET.fromstring(document(ET.Element("robot", name="x"), remarks))
    assert root.tag == "robot"
