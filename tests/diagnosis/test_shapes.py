"""Shapes without a name: found where they are, told in words, and never called by the name of an effect."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log, identify
from idtool.diagnosis import passing, selection
from idtool.diagnosis.candidates import best_start, try_effect
from idtool.diagnosis.diagnose import diagnose
from idtool.diagnosis.shapes import UNNAMED, Unnamed
from idtool.effects import registry
from idtool.effects.base import derivative
from idtool.fit.joint import JointFit, added_by
from idtool.fit.left_out import left_out_error
from idtool.fit.model import JointModel
from idtool.model.contribution import FIELDS
from idtool.model.motion import Array, Motion
from idtool.signals import Recording, record
from idtool.verbs.base_model import base_of_rows

#: Where and how large the bump of `bumpy` is, and how wide.
AT, HEIGHT, WIDTH = 0.31, 0.03, 0.05
#: Of the bristle, N m/rad.
STIFFNESS = 6.0


def session(folder: Path, extra: dict[str, float]) -> Recording:
    """Six trials of sine and friction, with `bump` N m at AT and `wear` N m of friction from 20 s on."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(800)
    trials = []
    for k in range(6):
        speed, omega = 0.5 + 0.2 * k, 2.0 * np.pi / 4.0
        w, q = speed * np.sin(omega * t), -speed / omega * np.cos(omega * t)
        now = t + 8.5 * k
        level = 0.06 + extra.get("wear", 0.0) * (now > 20.0)
        bump = extra.get("bump", 0.0) * np.exp(-0.5 * ((q - AT) / extra.get("width", WIDTH)) ** 2)
        torque = friction(q, level) + 0.05 * w + bump + 0.001 * rng.normal(size=len(t))
        trials.append(pd.DataFrame({"trial": k, "time_s": now, "position_rad": q, "torque_nm": torque}))
    pd.concat(trials).to_csv(folder / "log.csv", index=False)
    return record([Log.read(folder / "log.csv")])


def friction(q: Array, level: Array) -> Array:
    """Of a bristle (Dahl), exact over each step."""
    torque = np.zeros(len(q))
    for k in range(1, len(q)):
        bound = np.sign(q[k] - q[k - 1]) * level[k]
        torque[k] = bound + (torque[k - 1] - bound) * np.exp(-STIFFNESS * abs(q[k] - q[k - 1]) / level[k])
    return torque


@pytest.fixture(scope="module")
def bumpy(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return session(tmp_path_factory.mktemp("bump"), {"bump": HEIGHT})


def base(recording: Recording) -> JointFit:
    starts = base_of_rows(recording, "lugre", "auto").fits
    return starts[0]


@pytest.mark.parametrize("shape", UNNAMED, ids=lambda shape: shape.name)
def test_a_run_on_which_its_variable_stands_still_has_finite_derivatives(
    bumpy: Recording, shape: Unnamed
) -> None:
    """A run that is only thought of, of one load: `next_experiment` ended in a fault of linear algebra."""
    rows = len(bumpy.motion)
    shown = replace(bumpy, motion=replace(bumpy.motion, load=np.linspace(0.0, 1.0, rows)))
    still = replace(shown, motion=replace(shown.motion, load=np.full(rows, 0.3), position=np.full(rows, 0.1)))
    spec = replace(base(bumpy).model.spec, effects=(shape,))
    model = JointModel(still, spec, {shape.name: {}}, coordinates_from=shown)
    values = {"height": 0.1, "place": 0.2, "log_width": -4.0}
    own = {f"{shape.name}.{name}": value for name, value in values.items()}
    found = model.coordinates({**base(bumpy).values, **own})
    for direction in model.directions(found):
        assert all(np.isfinite(getattr(direction.effect, name)).all() for name in FIELDS)


@pytest.mark.parametrize("shape", UNNAMED, ids=lambda shape: shape.name)
def test_derivative_is_that_of_contribute(shape: Unnamed) -> None:
    t = np.linspace(0.0, 10.0, 400)
    motion = Motion(t, np.zeros(400, dtype=int), np.sin(t), np.cos(t), -np.sin(t), load=np.sin(2.0 * t))
    values = {"height": 0.2, "place": 0.4, "log_width": -1.0}

    def torque(name: str, change: float) -> list[Array]:
        contribution = shape.contribute(motion, {**values, name: values[name] + change})
        return [np.asarray(getattr(contribution, field)) for field in FIELDS]

    for coordinate in shape.active(motion):
        change = derivative(shape, motion, values, coordinate)
        above, below = torque(coordinate.name, 1e-5), torque(coordinate.name, -1e-5)
        for field, high, low in zip(FIELDS, above, below, strict=True):
            expected = (high - low) / 2e-5
            assert getattr(change, field) == pytest.approx(expected, rel=2e-3, abs=1e-6), coordinate.name


@pytest.mark.parametrize("shape", UNNAMED, ids=lambda shape: shape.name)
def test_both_flanks_are_seen(shape: Unnamed) -> None:
    """What rises towards an end is a cable; at rest a friction curve ends, which a shape may replace."""
    t = np.linspace(0.0, 10.0, 400)
    motion = Motion(t, np.zeros(400, dtype=int), np.sin(t), np.cos(t), -np.sin(t), load=np.sin(2.0 * t))
    low, high = np.min(shape.variable(motion)), np.max(shape.variable(motion))
    low -= np.ptp(shape.variable(motion)) if shape.follows == ("velocity",) else 0.0
    _, place, log_width = shape.active(motion)
    assert place.lower - low >= np.exp(log_width.upper) - 1e-12
    assert high - place.upper >= np.exp(log_width.upper) - 1e-12
    assert all(place.lower < start["place"] < place.upper for start in shape.starts(motion))


def test_a_width_between_those_that_are_tried(bumpy: Recording) -> None:
    fit = base(bumpy)
    (bump,) = (shape for shape in UNNAMED if shape.name == "unnamed_bump_in_position")
    start = best_start(fit, bump)
    assert start.values["place"] == pytest.approx(AT, abs=0.1 * WIDTH)
    assert np.exp(start.values["log_width"]) == pytest.approx(WIDTH, rel=0.15)
    found = try_effect(fit, bump, start).fit.values
    assert found["unnamed_bump_in_position.height"] == pytest.approx(HEIGHT, rel=0.05)


def shaped(recording: Recording, name: str, values: dict[str, float]) -> tuple[Unnamed, JointFit]:
    """A shape, and a fit that has it with these values."""
    (shape,) = (shape for shape in UNNAMED if shape.name == name)
    fit = base(recording)
    model = JointModel.build(recording, fit.model.spec.adding(shape))
    named = {f"{name}.{key}": value for key, value in values.items()}
    return shape, replace(fit, model=model, x=model.coordinates({**fit.values, **named}))


def size_and_place(told: str) -> list[float]:
    return [float(number) for number in re.findall(r"[+-]?[0-9][0-9.e+-]*", told)]


def test_its_size_is_what_a_row_shows(bumpy: Recording) -> None:
    """Friction at rest, where a bristle holds: its level is one that no row reaches."""
    grip = {"height": 1e3, "place": 0.0, "log_width": -9.0}
    shape, fit = shaped(bumpy, "unnamed_bump_in_speed", grip)
    told = shape.told(fit, 0.0)
    size, place = size_and_place(told)
    assert told.startswith("friction at one speed: ")
    assert 0.0 < size < 3.0 * float(np.max(np.abs(bumpy.torque)))
    added = np.abs(added_by(fit, shape)[bumpy.row])
    assert size == pytest.approx(np.max(added), rel=0.05)
    assert place == pytest.approx(np.abs(bumpy.motion.velocity[bumpy.row])[np.argmax(added)], rel=0.01)


def test_a_step_is_told_from_where_half_of_what_is_seen_of_it_is_reached(bumpy: Recording) -> None:
    """Beyond the last row it would have grown on; none shows how far."""
    time = bumpy.motion.time[bumpy.row]
    beyond = {"height": 0.5, "place": float(time[-1]), "log_width": np.log(1.0)}
    step, fit = shaped(bumpy, "unnamed_step_in_time", beyond)
    values = fit.model.effect_values(fit.x, step)
    seen = step.shape(time, values["place"], values["log_width"])
    size, place = size_and_place(step.told(fit, 0.0))
    assert size == pytest.approx(0.5 * np.max(seen), rel=0.05)
    assert place == pytest.approx(time[seen >= 0.5 * np.max(seen)][0], rel=0.01)


def test_nothing_is_told_of_what_is_too_small_on_every_row(bumpy: Recording) -> None:
    shape, fit = shaped(
        bumpy, "unnamed_bump_in_position", {"height": 0.01, "place": AT, "log_width": np.log(WIDTH)}
    )
    assert size_and_place(shape.told(fit, 0.009)) == pytest.approx([0.01, AT], rel=0.05)
    assert shape.told(fit, 0.011) == ""


@pytest.mark.parametrize(
    ("what", "words", "place"),
    [
        ({"bump": 0.02}, "bump over the position", AT),
        ({"wear": 0.02}, "friction that changes at once", 20.0),
    ],
)
def test_is_told_and_not_called_an_effect(
    tmp_path: Path, what: dict[str, float], words: str, place: float
) -> None:
    session(tmp_path, what)
    result = identify([Log.read(tmp_path / "log.csv")])
    found = result.diagnosis
    assert [effect["name"] for effect in found["effects"]] in ([], ["inertia"])
    assert found["verdict"] == "unexplained"
    # nothing was added: what the axis is modelled by has one error
    assert found["error"]["held_out"]["before"] == found["error"]["held_out"]["after"]
    told = re.search(f"looks like this: {words}: (.*) N m (?:at|from) (.*) (?:s|rad)", found["notes"][-1])
    assert told is not None
    assert [float(number) for number in told.groups()] == pytest.approx([0.02, place], rel=0.1)
    left = found["left"]["percent_of_torque"]
    assert result.parameters.provenance["left_percent_of_torque"] == pytest.approx(left, rel=0.01)
    on = " and ".join(found["unexplained"]["depends_on"])
    assert f"it left {left:.3g} % of the torque, which depends on {on};" in (
        result.parameters.unexplained or ""
    )


def test_one_bump_stands_for_many_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines and bends enough follow a bump; it does as well with three numbers."""
    monkeypatch.setattr(selection, "UNNAMED", ())  # what hides it from its score
    recording = session(tmp_path, {"bump": HEIGHT, "width": 0.12})
    library = [registry.get(name) for name in ("position_stiffness", "position_ripple", "inertia")]
    said: list[str] = []
    found = diagnose(recording, [base(recording)], library, said.append)
    assert any(line.startswith("accepted position") for line in said)
    assert [effect.name for effect in found.effects] == []
    assert found.verdict == "unexplained"
    assert "bump over the position: +0.03" in found.notes[-1]


def test_what_a_shape_takes_is_not_explained_by_it(bumpy: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    """What it does not follow of its cause is a small part of that, and no other effect's."""
    shape = next(shape for shape in UNNAMED if shape.name == "unnamed_bump_in_position")
    chosen = selection.begun(base(bumpy), registry.library())
    without = chosen.unexplained
    selection.extend(chosen, [shape], given=True)
    assert shape in chosen.fit.model.spec.effects
    left = left_out_error(chosen.fit) ** 2 - chosen.fit.model.filtered_noise**2
    assert left < 0.1 * without
    assert chosen.unexplained == pytest.approx(without, rel=0.01)
    # out of the model it is nothing's part any more
    chosen.fit = base(bumpy)
    assert chosen.unexplained == pytest.approx(without, rel=1e-6)
    asymmetry = registry.get("direction_asymmetry")
    chosen.fit = chosen.steps[-1]
    for asked, answer in (("impossible", None), ("worth_it", True), ("predicts_better", True)):
        monkeypatch.setattr(passing, asked, lambda *_, answer=answer: answer)
    trial = try_effect(chosen.fit, asymmetry, best_start(chosen.fit, asymmetry))
    old = left_out_error(chosen.fit)
    for taken, passes in ((0.0, True), (9.0 * old**2, False)):
        chosen.nameless[shape.name] = taken
        why = passing.why_not(chosen, trial, old, 0.9 * old)
        assert why is None if passes else "a small part of what is too much" in str(why)
