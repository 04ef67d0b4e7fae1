"""Which sessions to make: clean ones, one effect, two or three, unknown disturbances, everything at once."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from testbench.other_plants.effects import DISTURBANCES, EFFECTS

_ANY = frozenset(("slide", "arm", "shaft", "stage"))


@dataclass(frozen=True)
class OtherCase:
    """One session to make.

    Attributes:
        name: of its folder.
        what: effects, or the disturbance.
        seed: of everything.
        composed: whether it is like a real geared joint.
    """

    name: str
    what: tuple[str, ...]
    seed: int
    composed: bool = False


def cases(
    clean: int, single: int, several: int, unknown: int, composed: int, seed: int
) -> Iterator[OtherCase]:
    """All of them, in turns of each kind; a larger number adds sessions and changes none."""

    def case(kind: str, number: int, what: tuple[str, ...]) -> OtherCase:
        own = zlib.crc32(repr((kind, number, what, seed)).encode())
        stem = "+".join(what).replace(" ", "_") or kind
        return OtherCase(f"{stem}-{number}", what, own, kind == "composition")

    yield from (case("clean", k, ()) for k in range(clean))
    yield from (case("single", k, (name,)) for k in range(single) for name in EFFECTS)
    yield from (case("unknown", k, (name,)) for k in range(unknown) for name in DISTURBANCES)
    yield from (case("several", k, _several(k, seed)) for k in range(several))
    yield from (case("composition", k, ()) for k in range(composed))


def _several(number: int, seed: int) -> tuple[str, ...]:
    """Two or (every fourth time) three effects that one axis can have."""
    rng = np.random.default_rng([seed, number])
    while True:
        names = rng.choice(list(EFFECTS), size=3 if number % 4 == 3 else 2, replace=False)
        kinds = set(_ANY)
        for name in names:
            kinds &= set(EFFECTS[name].kinds) or kinds
        # one is the other with one number more
        if kinds and not {"load_dependent_friction", "drive_backdrive"} <= set(names):
            return tuple(str(name) for name in names)
