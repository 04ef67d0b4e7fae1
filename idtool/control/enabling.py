"""Around any law: the teach button (ISO 10218 calls it an enabling device) and the load at rest.

While the button is down the law guides. While it is up the axis is braked and held (`button`), and the law
listens, hands off, so that its zero is of now when the button goes down again. Each listening is judged
before anything may move (`rest_load`): what does not agree with the model is a fault as soon as the button
is down, and a load that was hung on or taken off meanwhile is taken in.

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
        self._unit = "N" if model.axis.kind == "linear" else "N m"
        self.begin(0.0)

    def begin(self, position: float) -> None:
        """Start, or go on after a fault: nothing is known of the load."""
        self._rest.reset()
        self.fault: tuple[Reason, str] | None = None
        self.enabled = True
        self._has_button = False
        self._waited = 0
        self._listen(position)

    def _listen(self, position: float) -> None:
        """Hold it here, hands off, and let the law take its zero."""
        self._hold.hold(position)
        self._rest.forget()
        self._lift = 0.0
        self.law.begin(position)

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
        if abs(rest.changed) > rest.least_change:
            return f"the load changed by {rest.changed:+.3g} {self._unit} and was taken in"
        return ""

    def raw_command(self, sample: Measurement, *, enabled: bool) -> float:
        """The command before its limits, rad (m)."""
        hold, law, rest, model = self._hold, self.law, self._rest, self._model
        if enabled is not self.enabled:
            self.enabled = enabled
            self._lift = 0.0
            rest.forget()
            if not enabled:
                self._has_button = True
                if law.state not in (State.STARTING, State.RESTING):
                    hold.begin()
        if law.state is State.STARTING and abs(sample.velocity) > 2.0 * law.rest_speed:
            hold.begin()  # it moves: what it carries now says little of what it carries at rest
        if hold.stopping:
            law.limited = ()
            command = hold.command(sample)
            if not self._hold.stopping:
                self._listen(sample.position)
            return command
        constant, load, offset = model.torque_constant, model.load, rest.offset + self._lift
        listening = law.state is State.STARTING
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
                if rest.watch(left - load.elastic):
                    self._listen(sample.position)
            return hold.anchor
        if rest.missing:
            self._raise()
        hold.hold(law.anchor)
        return command

    def _judge(self, sample: Measurement) -> None:
        """The end of a listening."""
        rest, model = self._rest, self._model
        weight = model.weight_of(sample.payload, sample.tilt_alpha, sample.tilt_beta)
        again = rest.judge(sample.payload, weight, model.load.level, button=self._has_button)
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
