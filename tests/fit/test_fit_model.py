"""Short cuts of the fit give what the long way does."""

from __future__ import annotations

from functools import cache

import numpy as np

from benchmarks.sessions import log_of, truth
from idtool.effects import registry
from idtool.fit.model import JointModel, Spec
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


def test_columns_are_filtered_alike_alone_and_together() -> None:
    motion = recording().motion
    alone = recording().filtered_columns(motion.velocity, motion.acceleration)
    together = recording().filtered(np.column_stack([motion.velocity, motion.acceleration]))
    np.testing.assert_allclose(alone, together, rtol=1e-12, atol=1e-15)


def test_jacobian_of_some_coordinates_is_that_part_of_the_whole() -> None:
    joint = model()
    x = joint.coordinates({**truth(), "inertia.inertia": truth()["inertia"]})
    bend = joint.bend(x)
    start = joint.evaluate(x, bend).start
    whole = joint.differentiate(x, bend, start).jacobian
    varied = np.array([name in ("bristle_stiffness", "inertia.inertia") for name in joint.names])
    part = joint.differentiate(x, bend, start, varied).jacobian
    assert whole is not None
    assert part is not None
    np.testing.assert_allclose(part, whole[:, varied], rtol=1e-12, atol=1e-15)


def test_starts_are_eliminated_trial_by_trial() -> None:
    joint, rng = model(), np.random.default_rng(1)
    trial = recording().filtered_trial
    columns, start = rng.normal(size=(len(trial), 3)), rng.normal(size=len(trial))
    left, share = joint.eliminate_columns(columns, start, 0.5)
    weight = joint.filtered_noise / 0.5
    for t in range(recording().trials):
        mine = trial == t
        expected = start[mine] @ columns[mine] / (start[mine] @ start[mine] + weight**2)
        np.testing.assert_allclose(share[t], expected, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(
            left[mine], columns[mine] - np.outer(start[mine], expected), rtol=1e-12, atol=1e-14
        )
