"""Every legal change of `Status.state`: those of the law, and those that come from outside it.

The admittance law's own are in `idtool.control.admittance.states`. docs/teach.md prints the tables, a test
walks them.
"""

from __future__ import annotations

from idtool.control.admittance.states import TRANSITIONS as ADMITTANCE
from idtool.control.guard import State

#: state of the published law -> (next state, when).
PAPER: dict[State, tuple[tuple[State, str], ...]] = {
    State.STARTING: ((State.RESTING, "it has listened for `settle_s`"),),
    State.RESTING: ((State.GUIDING, "the torque is above the starting torque for two samples"),),
    State.GUIDING: (
        (State.STOPPING, "the torque falls as that of a hand that leaves"),
        (State.RESTING, "the same, and the axis stands already"),
    ),
    State.STOPPING: (
        (State.RESTING, "the axis stands"),
        (State.GUIDING, "the hand pushes on as one that starts: it had eased off only"),
    ),
}
#: Around both laws: (state, or None for any but those two; next state; when).
AROUND: tuple[tuple[State | None, State, str], ...] = (
    (None, State.HELD, "the button goes up, or the axis moves while the law should listen: it is braked"),
    (State.HELD, State.STARTING, "the axis stands, the button is down: the law listens"),
    (State.HELD, State.RESTING, "the button goes down, and the law has its zero"),
    (None, State.FAULT, "a measurement, a limit of the session, or a load at rest that nothing explains"),
    (State.HELD, State.FAULT, "the same"),
    (State.FAULT, State.STARTING, "`recover()`"),
    (State.FAULT, State.HELD, "`recover()` while the button is up"),
)
LAWS = {"paper": PAPER, "light": ADMITTANCE}


def legal(mode: str) -> set[tuple[State, State]]:
    """Every change of `Status.state` from one step to the next that a mode may make."""
    law = LAWS[mode]
    inside = {(state, to) for state, ways in law.items() for to, _ in ways}
    outside = {(one, to) for state, to, _ in AROUND for one in ([state] if state else law)}
    return inside | outside
