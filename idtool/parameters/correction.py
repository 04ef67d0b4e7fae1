"""A smooth correction: torque over one variable, for what is measured and not explained.

It says nothing of a cause. It is zero outside the range in which it was measured and goes to zero at its
ends, so that nothing is extrapolated and nothing jumps. It stands in a file of its own; `ffc-id predict` and
the controller use it only where they are asked to.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from idtool.errors import InputError, nearest
from idtool.io.atomic import atomic_write
from idtool.io.toml import is_finite, load_toml
from idtool.model.motion import Array, Motion

SCHEMA = "ffc-id/correction/1"
#: What comes again on another day; time and the order of trials do not.
VARIABLES = ("position", "velocity", "acceleration", "load", "temperature")


@dataclass(frozen=True)
class Correction:
    """Piecewise linear in one variable.

    Attributes:
        variable: one of `VARIABLES`, SI.
        with_direction: whether it changes sign with the velocity, as friction does.
        knots: values of the variable, rising, shape (n,).
        torque: torque (force) there, shape (n,); zero at both ends.
    """

    variable: str
    with_direction: bool
    knots: Array
    torque: Array

    def __call__(self, motion: Motion) -> Array:
        """Torque to add to a prediction, shape (rows,).

        Raises:
            InputError: the variable was not logged.
        """
        values = getattr(motion, self.variable)
        if values is None:
            raise InputError(f"the correction needs {self.variable}, which these logs do not have")
        found = np.interp(values, self.knots, self.torque, left=0.0, right=0.0)
        return np.asarray(found * np.sign(motion.velocity) if self.with_direction else found)

    def at(self, value: float) -> float:
        """Torque at one value of the variable, moving forwards, N m (N); 0 outside the measured range."""
        knots, torque = self._points
        right = bisect_right(knots, value)
        if not 0 < right < len(knots):
            return 0.0
        share = (value - knots[right - 1]) / (knots[right] - knots[right - 1])
        return torque[right - 1] + share * (torque[right] - torque[right - 1])

    @cached_property
    def _points(self) -> tuple[list[float], list[float]]:
        return self.knots.tolist(), self.torque.tolist()

    def to_document(self) -> dict[str, Any]:
        """The TOML document."""
        return {
            "schema": SCHEMA,
            "variable": self.variable,
            "with_direction": self.with_direction,
            "knots": [float(knot) for knot in self.knots],
            "torque": [float(value) for value in self.torque],
        }

    def write(self, path: Path) -> None:
        """Write the file whole or not at all."""
        import tomli_w

        with atomic_write(path) as stream:
            stream.write(tomli_w.dumps(self.to_document()))

    @classmethod
    def read(cls, path: Path) -> Correction:
        """Read and check a file.

        Raises:
            InputError: naming the file, the key and what was expected.
        """
        document = load_toml(path)

        def wrong(key: str, expected: str) -> InputError:
            return InputError("is missing or wrong", file=path, place=key, remedy=f"expected {expected}")

        if document.get("schema") != SCHEMA:
            raise wrong("schema", f'"{SCHEMA}"')
        variable, directed = document.get("variable"), document.get("with_direction")
        if variable not in VARIABLES:
            raise InputError(
                "is unknown", file=path, place="variable", remedy=nearest(str(variable)[:40], VARIABLES)
            )
        if not isinstance(directed, bool):
            raise wrong("with_direction", "true or false")
        lists = {key: document.get(key) for key in ("knots", "torque")}
        for key, values in lists.items():
            if not isinstance(values, list) or len(values) < 2 or not all(map(is_finite, values)):
                raise wrong(key, "two finite numbers or more")
        knots, torque = (np.array(values, dtype=float) for values in lists.values())
        if len(knots) != len(torque) or not np.all(np.diff(knots) > 0):
            raise wrong("knots", "rising numbers, as many as torque")
        return cls(variable, directed, knots, torque)
