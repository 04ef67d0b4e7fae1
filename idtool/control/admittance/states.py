"""The states of the admittance law, and the only ways from one to another.

A fault is outside: it may come in any state, and `recover` starts anew.
"""

from __future__ import annotations

from idtool.control.guard import State

#: In the order of the numbers that the compiled law counts them by.
ORDER = (State.STARTING, State.RESTING, State.TARING, State.GUIDING, State.STOPPING)
STARTING, RESTING, TARING, GUIDING, STOPPING = range(5)

#: state -> (next state, when). No other change is legal; docs/teach.md prints this table, a test walks it.
TRANSITIONS: dict[State, tuple[tuple[State, str], ...]] = {
    State.STARTING: ((State.RESTING, "it has listened for `settle`: what the motor holds is friction's"),),
    State.RESTING: (
        (State.TARING, "`tare()` is called, and the zero is taken"),
        (
            State.GUIDING,
            "a torque that came of late, or half as much again, is above the starting torque for two samples",
        ),
    ),
    State.TARING: ((State.RESTING, "both cycles are done; what they taught is used or refused"),),
    State.GUIDING: ((State.STOPPING, "what is certain of the hand no longer pushes the way of the motion"),),
    State.STOPPING: (
        (
            State.RESTING,
            "the axis has stood for `still`: to one count, or to less than one noise would move it by then",
        ),
    ),
}

#: What is known of the hand, as the compiled law counts it: in the order of the table.
MAY_HOLD, SEEMS_GONE, GONE = range(3)

#: That changes so within the states: while the axis is guided, one that is (or seems) gone stops it; at rest,
#: what the motor holds beside one that is gone becomes the zero.
GRIP_TRANSITIONS: dict[str, tuple[tuple[str, str], ...]] = {
    "may hold": (
        ("seems gone", "guiding: the least torque of late falls by `seems` within two samples"),
        (
            "gone",
            "guiding or resting: the torque falls by `left` within a sample; resting: it stays as it is for"
            " `steady`; or a tare is used",
        ),
    ),
    "seems gone": (
        (
            "gone",
            "guiding: the torque falls by `left` within a sample; resting: it stays as it is for `steady`;"
            " or a tare is used",
        ),
        (
            "may hold",
            "guiding: three samples push on as one that starts; or a motion starts, a tare is refused",
        ),
    ),
    "gone": (("may hold", "the same"),),
}
