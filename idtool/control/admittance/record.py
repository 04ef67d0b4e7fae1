"""What the compiled law remembers: one record of numbers with names."""

from __future__ import annotations

import numpy as np

#: Parts of a tare's cycle that are compared with those of the cycle before.
PARTS = 8
#: What a tare came to.
USED, TOUCHED, NOT_EXPLAINED, OTHER_LOAD = range(4)
#: What it learns, in the order of the tables.
LOAD, LEVEL, DAMPING, BRISTLE = range(4)

#: state; samples in it, and of them when it last moved; samples above the starting torque; what is known of
#: the hand (`MAY_HOLD`, ...); what the last tare came to; whether the speed limit cut; whose turn it is
_COUNTS = ("state", "since", "moved", "pushed", "grip", "outcome", "limited", "part", "turn")
#: torques, N m; the motion; sums of a tare, and of what was heard
_NUMBERS = (
    "raw", "hand", "least", "least_1", "least_2", "dead", "zero", "zero_before", "zero_variance",
    "bias", "unexplained", "usual",
    "elastic", "damping", "plain", "felt", "correction",
    "position", "seen", "nominal", "reported", "w", "x", "way", "lead", "anchor", "fast",
    "fade", "square", "rough", "last_plain", "last_elastic", "weight", "tare_sum", "load",
)  # fmt: skip
_TABLES = {"learned": (4,), "spread": (4, 4), "information": (4, 4), "moment": (4,), "means": (PARTS,)}
#: What the law remembers. A record, so that the numbers have names without the compiler too.
STATE = np.dtype(
    (
        np.record,
        [(name, "i8") for name in _COUNTS]
        + [(name, "f8") for name in _NUMBERS]
        + [(name, "f8", shape) for name, shape in _TABLES.items()],
    )
)
