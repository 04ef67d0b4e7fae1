"""What one effect adds to the model: a torque, or a change of something the model already has."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property

from idtool.model.motion import Array

Term = Array | float


@dataclass(frozen=True)
class Contribution:
    """The places where an effect can act. Each is a number or an array of shape (rows,).

    Additive ones start at 0: they are summed over effects. So are the relative ones (named
    `*_change`), of which 0.1 means ten per cent more; summing them keeps several effects linear in
    their parameters and their order of no matter.

    Attributes:
        torque: added torque, N m (N).
        level_change: relative change of the friction level g.
        level_torque: torque added to g.
        static_change: relative change of the stiction only.
        viscous_change: relative change of the viscous coefficient.
        bristle_change: relative change of the torque that the bristle passes on.
        exponent_change: added to the Stribeck exponent.
        delay: by how much position and velocity lag the current, s.
        saturation: kappa / K: relative loss of torque per torque, 1/(N m).
        gain_change: relative change of the motor's torque per current (cogging that grows with the current).
    """

    torque: Term = 0.0
    level_change: Term = 0.0
    level_torque: Term = 0.0
    static_change: Term = 0.0
    viscous_change: Term = 0.0
    bristle_change: Term = 0.0
    exponent_change: Term = 0.0
    delay: Term = 0.0
    saturation: Term = 0.0
    gain_change: Term = 0.0

    @cached_property
    def places(self) -> tuple[str, ...]:
        """Where it acts."""
        return tuple(name for name in FIELDS if not is_zero(getattr(self, name)))

    @property
    def only_torque(self) -> bool:
        """Whether it adds a torque and acts nowhere else."""
        return self.places == ("torque",)

    @property
    def is_torque_at_most(self) -> bool:
        """Whether it acts nowhere but on the torque."""
        return self.places in ((), ("torque",))


def is_zero(term: Term) -> bool:
    """Whether nothing acts there: the number 0, not an array that happens to hold zeros."""
    return isinstance(term, float) and term == 0.0


FIELDS = tuple(field.name for field in fields(Contribution))
#: Places of `FIELDS`, by which a formula finds them (`Effect.at`).
(
    TORQUE,
    LEVEL_CHANGE,
    LEVEL_TORQUE,
    STATIC_CHANGE,
    VISCOUS_CHANGE,
    BRISTLE_CHANGE,
    EXPONENT_CHANGE,
    DELAY,
    SATURATION,
    GAIN_CHANGE,
) = range(len(FIELDS))


def combine(parts: Iterable[Contribution]) -> Contribution:
    """The sum of several contributions."""
    total: dict[str, Term] = dict.fromkeys(FIELDS, 0.0)
    for part in parts:
        for name in part.places:
            own = getattr(part, name)
            total[name] = own if is_zero(total[name]) else total[name] + own
    return Contribution(**total)
