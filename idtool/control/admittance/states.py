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
    State.STOPPING: ((State.RESTING, "the axis has stood, to one count, for `still`"),),
}
