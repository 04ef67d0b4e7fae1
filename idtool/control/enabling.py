"""Around any law: the teach button (ISO 10218 calls it an enabling device) and the load at rest.

While the button is down the law guides. While it is up the axis is braked and held (`button`). Once the
current is as quiet there as with hands off, the law listens, so that its zero is of now when the button
goes down again; until then it has the zero of before, and a hand that is on the axis when the button goes
down is a push. Each listening is judged before anything may move (`rest_load`): what does not agree with
the model is a fault as soon as the button is down, and a load that was hung on or taken off meanwhile is
taken in. A start by all of what was taken in is none: that load has left again, or was a hand.

A payload that was told and was never mounted shows too: the axis then carries its own weight alone, as if a
hand pushed up with the payload's. While the button is down it rises slowly, as the paper's does, and stands
once the payload hangs.
"""

from __future__ import annotations

from dataclasses import replace

from idtool.control.button import Hold
from idtool.control.guard import Measurement, Reason, State
from idtool.control.law import Law
from idtool.control.online import OnlineModel
from idtool.control.rest_load import RestLoad

#: So many listenings in a row may disagree with the model while the button is down before it is a fault: a
#: hand that touched the axis has then left.
PATIENCE = 5
#: An axis without its payload takes so long to let the missing weight act, s, and rises so fast, rad/s (m/s).
LIFT_S = 1.0
LIFT_SPEED = {"rotary": 0.2, "linear": 0.01}
#: A start that may be by a load that was taken in and has left is looked at for so long, s, by what is felt
#: in the end of it, s: a hand that let go is gone by then, the drive has settled, one that pushes trembles.
DOUBT_S, LOOK_S = 0.5, 0.2


class EnabledLaw:
    """A law, its button and its zero.

    Attributes:
        enabled: whether the button is down; an axis without one has it always down.
        fault: set when the load at rest cannot be explained.
    """

    def __init__(self, law: Law, model: OnlineModel, rest: RestLoad, hold: Hold) -> None:
        self.law = law
        self._model = model
        self._rest = rest
        self._hold = hold
        self._lift_speed = LIFT_SPEED[model.axis.kind]
        self._doubt = max(1, round(DOUBT_S / law.period))
        self._look = max(1, round(LOOK_S / law.period))
        self._unit = "N" if model.axis.kind == "linear" else "N m"
        self.begin(0.0)

    def begin(self, position: float) -> None:
        """Start, or go on after a fault: nothing is known of the load."""
        self._rest.reset()
        self.fault: tuple[Reason, str] | None = None
        self.enabled = True
        self._has_button = False
        self._stale = self._was_a_hand = False
        self._waited = self._doubted = 0
        self._listen(position)

    def _listen(self, position: float) -> None:
        """Hold it here, hands off, and let the law take its zero."""
        self._hold.hold(position)
        self._rest.forget()
        self._lift = 0.0
        self._stale = False
        self._doubted = 0
        self.law.begin(position)

    def _stand(self, position: float) -> None:
        """It was braked and stands here: with the zero of before, if the law had one."""
        if self.law.state is State.STARTING:
            self._listen(position)
        else:
            self.law.stand(position)
            self._stale = True

    @property
    def state(self) -> State:
        """What it is doing; never FAULT."""
        return State.HELD if self._hold.stopping or not self.enabled else self.law.state

    @property
    def ready(self) -> bool:
        """Whether the axis rests and the law has its zero."""
        return not self._hold.stopping and self.law.ready

    @property
    def load_offset(self) -> float:
        """Load that nobody told of and that is taken in, N m (N)."""
        return self._rest.offset

    @property
    def note(self) -> str:
        """What is known of the load beside what was told; empty if nothing is."""
        rest = self._rest
        if rest.excess:
            return f"the axis carries {rest.excess:+.3g} {self._unit} beside its model"
        if rest.missing:
            return "the payload that was told is not mounted: the axis rises slowly while the button is down"
        if self._was_a_hand:
            return "what was taken in as a load has left the axis again: it was a hand, or was taken off"
        if abs(rest.changed) > rest.least_change:
            return f"the load changed by {rest.changed:+.3g} {self._unit} and was taken in"
        return ""

    def raw_command(self, sample: Measurement, *, enabled: bool) -> float:
        """The command before its limits, rad (m)."""
        hold, law, rest, model = self._hold, self.law, self._rest, self._model
        if enabled is not self.enabled:
            self.enabled = enabled
            self._lift = 0.0
            self._doubted = 0
            rest.forget()
            if not enabled:
                self._has_button = True
                self._was_a_hand = False
                if law.state not in (State.STARTING, State.RESTING):
                    hold.begin()
        if law.state is State.STARTING and abs(sample.velocity) > 2.0 * law.rest_speed:
            hold.begin()  # it moves: what it carries now says little of what it carries at rest
        if hold.stopping:
            law.limited = ()
            command = hold.command(sample)
            if not self._hold.stopping:
                self._stand(sample.position)
            return command
        constant, load, offset = model.torque_constant, model.load, rest.offset + self._lift
        before = law.state
        listening = before is State.STARTING
        own = replace(sample, current=sample.current - offset / constant) if offset else sample
        command = law.raw_command(own)
        if listening or not enabled:
            motor = constant * own.current
            left = offset + load.arriving(motor) - load.gravity - load.effects
            if listening:
                rest.listen(left)
                if self.law.state is not State.STARTING:
                    self._judge(sample)
            else:
                law.rest()
                if rest.watch(left, load.elastic, stale=self._stale):
                    self._listen(sample.position)
            return hold.anchor
        if self._in_doubt(before):
            return hold.anchor
        if rest.missing:
            self._raise()
        hold.hold(law.anchor)
        return command

    def _in_doubt(self, before: State) -> bool:
        """Whether a start is not to be believed yet: it may be by a load that was taken in and has left."""
        law, rest = self.law, self._rest
        if self._doubted < 0:  # it was looked at just now
            self._doubted += 1
            return False
        if not self._doubted:
            if before is not State.RESTING or law.state is not State.GUIDING:
                return False
            if rest.taken * law.torque <= 0.0:
                rest.settle()
                return False
            rest.forget()
        law.rest()
        self._doubted += 1
        if self._doubted > self._doubt - self._look:
            rest.listen(law.raw)
        if self._doubted < self._doubt:
            return True
        if rest.has_left():
            rest.undo()
            self._was_a_hand = rest.away
            self._listen(self._hold.anchor)
        else:
            self._doubted = -self._doubt
        return True

    def _judge(self, sample: Measurement) -> None:
        """The end of a listening."""
        rest, model = self._rest, self._model
        weight = model.weight_of(sample.payload, sample.tilt_alpha, sample.tilt_beta)
        bent = model.bristle_stiffness * model.bristle
        again = rest.judge(sample.payload, weight, model.load.level, bent, button=self._has_button)
        if not rest.excess:
            self._waited = 0
        elif self.enabled:
            self._waited += 1
            if self._waited >= PATIENCE:
                self.fault = Reason.MISMATCH, self._mismatch(sample, weight)
        if again or rest.excess:
            self._listen(self._hold.anchor)

    def _mismatch(self, sample: Measurement, weight: float) -> str:
        """By how much the axis disagrees with its model, and what may be wrong."""
        unit, left, allowed = self._unit, self._rest.excess, self._rest.allowed
        told = f"{sample.payload:g} kg"
        per_kilogram = self._model.weight_of(1.0, sample.tilt_alpha, sample.tilt_beta)
        as_payload = f" (as {left / per_kilogram:+.2g} kg would)" if per_kilogram else ""
        return (
            f"at rest the axis carries {left:+.3g} {unit} beside its model{as_payload}; friction and the"
            f" uncertainties explain {allowed:.3g} {unit}: check the payload (told: {told}),"
            " the tilt, the gravity of the parameter file and the sign of the current, and keep hands off"
        )

    def _raise(self) -> None:
        """Let the weight of the missing payload act, as far as the axis stays slow."""
        weight = -self._rest.offset
        step = weight * self.law.period / LIFT_S
        self._lift += step if abs(self.law.wanted) < self._lift_speed else -step
        self._lift = min(max(self._lift, min(weight, 0.0)), max(weight, 0.0))
