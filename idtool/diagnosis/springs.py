"""What a spring whose shape nobody knows can have done to the gravity of an arm.

Both are torques of the position, told apart by their shapes alone: what a cable that is no straight line
pulls more than one is taken for gravity, and the two cancel each other. While the residual still follows the
position the shape of the spring is not known, so that gravity may be anything up to what it is without a
spring.
"""

from __future__ import annotations

import numpy as np

from idtool.diagnosis.candidates import without
from idtool.diagnosis.remainder import Remainder
from idtool.fit.joint import JointFit, pulled

_SPRING = "position_stiffness"
#: Evaluations for the fit without it: gravity has far to go.
_SPENT = 60


def allowing_for_springs(fit: JointFit, left: Remainder | None) -> tuple[JointFit, str | None]:
    """The fit with intervals of gravity and of the spring that cover it, and a sentence; the same fit where
    it has no spring beside the gravity of an arm, or where nothing that is left follows the position.

    Args:
        fit: of the final model.
        left: structure in what it leaves.
    """
    spring = next((effect for effect in fit.model.spec.effects if effect.name == _SPRING), None)
    unknown = left is not None and {"position", "load"} & set(left.depends_on)
    if spring is None or fit.model.spec.gravity != "arm" or not unknown:
        return fit, None
    alone = without(fit, spring, most=_SPENT).values
    by = np.zeros(len(fit.x))
    for i, name in enumerate(fit.model.names):
        if name.startswith(("gravity.", f"{_SPRING}.")):
            by[i] = alone.get(name, 0.0) - fit.x[i]
    return pulled(fit, by), (
        "a spring whose shape is not known, since what is left follows the position, and the gravity of an "
        "arm are known by their sum alone; the intervals allow for that, a known load tells."
    )
