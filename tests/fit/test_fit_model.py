"""Short cuts of the fit give what the long way does."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.sessions import log_of, truth
from idtool.effects import registry
from idtool.fit.eliminate import eliminate
from idtool.fit.model import JointModel
from idtool.fit.spec import Spec
from idtool.model.motion import Array
from idtool.model.torque import Prediction, predict
from idtool.signals import Recording, record


@cache
def recording() -> Recording:
    return record([log_of("sine", 3, (2, 3))])


def model() -> JointModel:
    spec = Spec("lugre", None, ()).adding(registry.get("inertia"))
    return JointModel.build(recording(), spec)


def test_travel_is_the_longest_of_a_trial() -> None:
    motion = recording().motion
    spans = [np.ptp(motion.position[motion.trial == t]) for t in range(motion.trials)]
    assert model().scales.travel == max(spans)


def test_no_friction_level_lies_beyond_the_largest_reading() -> None:
    """Break-away from a rest is a bound too; a reading that is compared with nothing is none."""
    still, lost, compared = 10, 11, recording().usable.copy()
    compared[[still, lost]] = False
    plain = replace(recording(), usable=compared, at_rest=np.arange(len(compared)) == still)

    def most(row: int, torque: float) -> float:
        readings = plain.torque.copy()
        readings[row] = torque
        joint = JointModel.build(replace(plain, torque=readings), model().spec)
        coulomb, static = (float(joint.bounds[1][joint.names.index(n)]) for n in ("coulomb", "static"))
        assert static == coulomb
        return float(np.exp(coulomb))

    largest = float(np.max(np.abs(plain.torque[plain.usable | plain.at_rest])))
    assert most(still, 0.0) == pytest.approx(largest)
    assert most(still, -3.0 * largest) == pytest.approx(3.0 * largest)
    assert most(lost, 3.0 * largest) == pytest.approx(largest)


def test_columns_are_filtered_alike_alone_and_together() -> None:
    motion = recording().motion
    alone = recording().filtered(np.column_stack([motion.velocity, motion.acceleration]))
    together = recording().filtered(np.column_stack([motion.velocity, motion.acceleration]))
    np.testing.assert_allclose(alone, together, rtol=1e-12, atol=1e-15)


def test_jacobian_of_some_coordinates_is_that_part_of_the_whole() -> None:
    joint = model()
    x = joint.coordinates({**truth(), "inertia.inertia": truth()["inertia"]})
    bend = joint.presliding_scale(x)
    start = joint.evaluate(x, bend).start
    whole = joint.differentiate(x, bend, start)
    varied = np.array([name in ("bristle_stiffness", "inertia.inertia") for name in joint.names])
    part = joint.differentiate(x, bend, start, varied)
    np.testing.assert_allclose(part, whole[:, varied], rtol=1e-12, atol=1e-15)


def test_starts_are_eliminated_stretch_by_stretch() -> None:
    joint, rng = model(), np.random.default_rng(1)
    stretch = recording().filtered_stretch
    column, start = rng.normal(size=len(stretch)), rng.normal(size=len(stretch))
    weight, left = joint.weight(0.5), np.empty(len(stretch))
    share = eliminate(column, start, recording().stretch_pointer, weight, left)
    for t in range(recording().motion.stretches):
        mine = stretch == t
        expected = start[mine] @ column[mine] / (start[mine] @ start[mine] + weight[t] ** 2)
        assert share[t] == pytest.approx(expected, rel=1e-12, abs=1e-14)
        np.testing.assert_allclose(left[mine], column[mine] - start[mine] * expected, rtol=1e-12, atol=1e-14)


def rested() -> JointModel:
    """The same with two rests in the middle of trials."""
    rec = recording()
    restart = np.zeros(len(rec.motion), dtype=bool)
    restart[[rec.motion.starts[1] + 150, rec.motion.starts[1] + 300]] = True
    rec = replace(rec, motion=replace(rec.motion, restart=restart), unseen=2e-3)
    return JointModel.build(rec, model().spec)


def test_derivatives_beyond_a_rest() -> None:
    """What is fitted and its Jacobian are of one model, whatever the starts of the stretches are."""
    joint = rested()
    x = joint.coordinates({**truth(), "inertia.inertia": truth()["inertia"]})
    bend = joint.presliding_scale(x)
    start = joint.evaluate(x, bend).start
    assert len(start) == joint.recording.trials + 2
    found = joint.differentiate(x, bend, 0.3 * start)
    n = len(joint.measured)
    for index, name in enumerate(joint.names):
        step = np.zeros(len(x))
        step[index] = 1e-6 * max(1.0, abs(x[index]))
        ends = [predicted(joint, x + sign * step, 0.3 * start).torque for sign in (1.0, -1.0)]
        slope = joint.recording.filtered(ends[0] - ends[1]) / (2.0 * step[index])
        # the projected column lacks what the starts can do: put it back
        through = start_columns(joint, x) @ (-found[n:, index] / joint.weight(bend))
        far = np.abs(found[:n, index] + through - slope).max()
        assert far < 1e-4 * np.abs(slope).max(), name


def predicted(joint: JointModel, x: Array, start: Array) -> Prediction:
    return predict(joint.recording.motion, joint.friction(x), joint.contribution(x), start)


def start_columns(joint: JointModel, x: Array) -> Array:
    """Filtered torque per start deflection, (filtered rows, stretches)."""
    motion = joint.recording.motion
    column = joint.recording.filtered(predicted(joint, x, np.zeros(motion.stretches)).start_column)
    return column[:, None] * (joint.recording.filtered_stretch[:, None] == np.arange(motion.stretches))


def test_an_axis_that_begins_in_motion_has_slid_before() -> None:
    """... about as far as it goes on: few of such trials begin within a bend of a turn. A trial of a log that
    was cut in two begins so; its start is not left to what little its first rows say."""
    whole, bend = model().recording, 0.01
    speed = np.abs(whole.motion.velocity)
    fast = int(np.argmax(np.where(whole.motion.trial == 0, speed, 0.0)))
    later = replace(whole, motion=whole.motion.part(np.arange(fast, len(speed))))
    later = replace(
        later, at_rest=whole.at_rest[fast:], torque=whole.torque[fast:], usable=whole.usable[fast:]
    )
    joint = JointModel.build(later, model().spec)
    turn = int(np.argmax(later.motion.velocity * later.motion.velocity[0] <= 0.0))
    far = abs(float(later.motion.position[turn - 1] - later.motion.position[0]))
    assert far > 4.0 * bend
    spread = joint.filtered_noise / joint.weight(bend)
    assert spread[0] == pytest.approx(bend * np.sqrt(bend / far), rel=0.02)
    np.testing.assert_allclose(spread[1:], bend, rtol=1e-5)


def test_what_a_rest_leaves_unknown() -> None:
    """A start before a trial is forgotten by sliding; a rest hides as much as the position cannot show."""
    joint = rested()
    motion = joint.recording.motion
    short, wide = 1e-4 * float(motion.travels.min()), 1e4 * float(motion.travels.max())
    rest = ~motion.first[motion.begins]
    noise = joint.filtered_noise
    spread = noise / joint.weight(short)
    np.testing.assert_allclose(spread[~rest], short, rtol=1e-5)
    np.testing.assert_allclose(spread[rest], 2e-3, rtol=1e-5)
    np.testing.assert_allclose(noise / joint.weight(wide), wide, rtol=1e-3)


@pytest.mark.parametrize("ratio", [0.7, 1.4])
def test_a_curve_that_may_only_fall_is_flat_where_it_would_rise(ratio: float) -> None:
    rising = model()
    falling = JointModel.build(recording(), replace(rising.spec, falling=True))
    values = {**truth(), "inertia.inertia": truth()["inertia"]}
    x = rising.coordinates({**values, "static": ratio * values["coulomb"]})
    assert rising.values(x)["static"] == pytest.approx(ratio * values["coulomb"])
    assert falling.values(x)["static"] == pytest.approx(max(1.0, ratio) * values["coulomb"])
    bend, flat = falling.presliding_scale(x), rising.coordinates(falling.values(x))

    def slopes(joint: JointModel, at: Array) -> dict[str, Array]:
        jacobian = joint.differentiate(at, bend, joint.evaluate(at, bend).start)
        return dict(zip(joint.names, jacobian.T, strict=True))

    free, held = slopes(rising, flat), slopes(falling, x)
    both = free["coulomb"] + free["static"]
    np.testing.assert_allclose(held["coulomb"], both if ratio < 1.0 else free["coulomb"], atol=1e-12)
    np.testing.assert_allclose(held["static"], (ratio > 1.0) * free["static"], atol=1e-12)
