"""The admittance law, compiled: one sample in, one command out, on two records of numbers.

    tau_hand = tau_model + learned(o, b, v) + zero + bias - K i                          estimate
    f        = tau_hand, less the uncertainty of the model, towards zero                  certain part
    T_v dw/dt = K_c f - w,   w = 0 as soon as f no longer pushes the way of w             virtual mass
    q_d      = x + T w,   dx/dt = w                                                       command

So w f >= 0 at every sample: see docs/teach.md. Some work is spread over samples (`turn`, `SOLVE_SAMPLES`,
`SAMPLES_PER_SUM`) because a small board has no time for it within one; it is so everywhere, so that what is
studied and tuned here is what runs there, sample by sample. `c` holds the constants (`constants`), `s` the
state (`record.STATE`). The estimate stands in `hand`, what each state does in `rest`, `motion` and `tare`;
the exported C has the same parts, functions and names.
"""

from __future__ import annotations

from typing import Any

from idtool.control.admittance.hand import forget_push, sense, watch
from idtool.control.admittance.motion import brake, guide, stand
from idtool.control.admittance.record import USED
from idtool.control.admittance.rest import hold, listen, rest
from idtool.control.admittance.states import GUIDING, MAY_HOLD, STARTING, STOPPING, TARING
from idtool.control.admittance.tare import sweep
from idtool.model.jit import jit


@jit()
def reset(c: Any, s: Any) -> None:
    """Nothing was learned."""
    for j in range(4):
        s.learned[j] = 0.0
        for k in range(4):
            s.spread[j, k] = 1.0 if j == k else 0.0
    s.unexplained = 0.0
    s.lead = c.servo_time
    s.outcome = USED


@jit()
def begin(c: Any, s: Any, position: float) -> None:
    """The first sample: the bristle is unknown, what was learned of load and friction still holds."""
    s.state = STARTING
    s.grip = MAY_HOLD
    s.since = s.pushed = s.limited = s.turn = 0
    s.raw = s.hand = s.dead = s.zero = s.zero_before = s.zero_variance = s.bias = s.correction = 0.0
    s.seen = s.nominal = s.reported = s.w = s.tare_sum = s.usual = 0.0
    forget_push(s)
    s.position = position
    s.x = s.anchor = min(max(position, c.low), c.high)


@jit()
def act(
    c: Any, s: Any, position: float, velocity: float, current: float,
    plain: float, elastic: float, damping: float, kept: float, felt: float,
) -> float:  # fmt: skip
    """One sample: the command before its limits."""
    s.limited = 0
    s.position = position
    sense(c, s, plain, elastic, damping, kept, felt)
    if s.state == GUIDING:
        return guide(c, s, velocity)
    if s.state == STOPPING:
        return brake(c, s, velocity)
    if s.state == TARING:
        return sweep(c, s, current)
    if s.state == STARTING:
        return listen(c, s)
    return rest(c, s)


# From Python: records in arrays of one. An array is handed over within a microsecond, a record takes twenty,
# as numpy writes a description of it every time.


@jit()
def watch_in(c: Any, s: Any, velocity: float) -> tuple[float, float]:
    """As `watch`; its change of the speed, and the speed."""
    change = watch(c[0], s[0], velocity)
    return change, float(s[0].seen)


@jit()
def act_in(
    c: Any, s: Any, position: float, velocity: float, current: float,
    plain: float, elastic: float, damping: float, kept: float, felt: float,
) -> float:  # fmt: skip
    """As `act`."""
    return act(c[0], s[0], position, velocity, current, plain, elastic, damping, kept, felt)


@jit()
def hold_in(s: Any) -> None:
    """As `hold`."""
    hold(s[0])


@jit()
def stand_in(c: Any, s: Any, position: float) -> None:
    """As `stand`."""
    stand(c[0], s[0], position)


@jit()
def told(s: Any) -> tuple[int, int, int, float, float, float, float, float, float]:
    """What others read: state, whether the speed limit cut, what the last tare came to; anchor, hand, raw,
    correction, speed asked for, uncertainty."""
    r = s[0]
    return r.state, r.limited, r.outcome, r.anchor, r.hand, r.raw, r.correction, r.w, r.dead
