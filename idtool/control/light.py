"""The light law: an admittance driven by what is certain of the hand.

    tau_hand = tau_gravity + tau_friction + tau_effects + (what was learned) - K i      estimate
    f        = tau_hand, less what the model may be wrong by, towards zero               certain part
    T_v dw/dt = K_c f - w                                                               virtual mass, damping
    q_d      = x + T w,   dx/dt = w                                                     command

The command follows the law's own motion (x, w), which is smooth, and not the measured one, which comes in
counts and late. What friction is compensated can be wrong; where the compensation may be too much, the
hand would be pushed. So a multiple of the standard deviation that `Certainty` states for this very motion
is left for the hand to carry: the compensation is at its lower confidence bound, and the axis takes energy
from the hand and never gives any. An energy account (Hannaford & Ryu 2002) watches that.

At rest the hand is felt exactly, whatever the model: what the motor carries when nobody touches is the
zero of the scale. It is taken when the controller starts and after each stop of a hand that let go, and
each time it teaches `Certainty` a little; `tare` moves the axis to and fro to learn all of it at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from idtool.control import feel
from idtool.control.certainty import DAMPING, Certainty
from idtool.control.doubt import FADE, LEARN_EVERY, SPARE, TURNS, Doubt
from idtool.control.guard import Limits, Measurement, State
from idtool.control.law import Law
from idtool.control.online import OnlineModel
from idtool.control.sensing import DelayLine
from idtool.control.tare import Tare

_TOUCHED = "the tare was disturbed and is not used: keep hands off and call tare() again"
_NOT_EXPLAINED = (
    "the tare met more than load and friction can explain, both times alike, and is not used: the axis stays "
    "heavier; a diagnosis of its logs may find the effect that the parameter file lacks"
)


@dataclass(frozen=True)
class LightSettings:
    """How the law is set; N m and rad (N and m on a linear axis).

    Attributes:
        yielding: speed per torque of the hand beyond the doubt, rad/s per N m: one over the damping.
        start_torque: a hand below this does not start a motion.
        level_doubt, damping_doubt, load_doubt: standard deviation of the friction level and of the damping,
            relative, and of the load, N m, before anything is learned.
        noise: standard deviation of one sample's torque, N m.
        servo_time: first guess of the position loop's time constant, s.
        settle: how long it listens before it follows a hand, s.
        tare_travel, tare_speed: how far a tare moves, and how fast at most.
    """

    yielding: float
    start_torque: float
    level_doubt: float
    damping_doubt: float
    load_doubt: float
    noise: float
    servo_time: float
    settle: float
    tare_travel: float
    tare_speed: float


@final
class LightLaw(Law):
    """The admittance, its zero, its tare and its brake."""

    def __init__(
        self, model: OnlineModel, limits: Limits, period: float, resolution: float, settings: LightSettings
    ) -> None:
        """Everything as in `ForceFreeController`."""
        super().__init__(model, limits, period, resolution)
        self.settings = settings
        #: Standard deviations before anything is learned: load, level, damping, bristle.
        self.prior = (
            settings.load_doubt,
            settings.level_doubt,
            settings.damping_doubt,
            feel.BRISTLE_PRIOR * model.friction_bound,
        )
        self._doubt = Doubt(Certainty(*self.prior))
        self._fast = 1.0 - math.exp(-period / feel.FAST_S)
        self._slow = 1.0 - math.exp(-period / feel.SLOW_S)
        self._follows = 1.0 - math.exp(-period / feel.FOLLOWS_S)
        self._virtual = 1.0 - math.exp(-period / feel.VIRTUAL_S)
        self._tare = Tare(settings.tare_travel, settings.tare_speed, period, settings.noise)
        self._lately = 1.0 - math.exp(-period / feel.LATE_S)
        self._line = DelayLine()
        self.reset()

    def reset(self) -> None:
        """What was learned and trimmed is forgotten too."""
        self._doubt.reset()
        self._lead_time = self.settings.servo_time
        self.state = State.STARTING
        self.begin(0.0)

    def begin(self, position: float) -> None:
        """The bristle is unknown, what was learned of load and friction still holds."""
        if self.state is State.TARING:
            self._doubt.restore(self._kept)  # half a tare tells nothing
        self.model.reset()
        self._line.clear()
        self._doubt.begin()
        self.anchor = self._x = self.limits.clip(position)
        self._w = self._nominal = self._seen = 0.0
        self._last: Measurement | None = None
        self.torque = self._quiet = self.raw = 0.0
        self._before = self._older = self._old = 0.0
        self.wanted = self.extra = 0.0
        self._account = 0.0
        self._let_go = True
        self._trusting = feel.START_S
        self._sure = True
        self._pushed_way = self._idle = self._relief = 0.0
        self._stalled = False
        self._tracked = 0.0
        self._stand(State.STARTING)
        self.limited = ()

    @property
    def doubt(self) -> float:
        """How far the model may be wrong at this motion, N m (N)."""
        return self._doubt.value

    @property
    def learned(self) -> tuple[float, float, float]:
        """Load that nobody told of (N m or N); friction level and viscous friction over the file's."""
        load, level, viscous, _ = self._doubt.certainty.mean
        return load, 1.0 + level, 1.0 + viscous

    @property
    def ready(self) -> bool:
        """Whether it rests, its zero is taken, and a hand may push."""
        return self.state is State.RESTING and self._armed

    def tare(self) -> bool:
        """Learn load and friction by moving to and fro; False while it does not rest."""
        if not self.ready:
            return False
        middle = 0.5 * (self.limits.position_min + self.limits.position_max)
        self._tare.begin(1.0 if not middle < self.anchor else -1.0)  # NaN: no limits on either side
        self._doubt.finish()
        self._kept = self._doubt.certainty.copy()
        self._w = self._nominal = 0.0
        self._x = self.anchor
        self.state = State.TARING
        self.note = ""
        return True

    def rest(self) -> None:
        """The zero stays as it is."""
        self.state = State.RESTING
        self._pushed = 0

    def wish(self, sample: Measurement) -> float:
        """Hold the anchor, or lead the law's own motion."""
        self.limited = ()
        self.wanted = 0.0
        self._observe(sample)
        if self.state is State.GUIDING:
            return self._guide(sample)
        if self.state is State.STOPPING:
            return self._brake(sample)
        if self.state is State.TARING:
            return self._sweep(sample)
        return self._rest()

    def _observe(self, sample: Measurement) -> None:
        """Update the estimate of the hand."""
        last = self._last or sample
        self._last = sample
        step = sample.time - last.time
        step = step if step > 0.0 else self.period
        before = self._seen
        nominal = self._nominal
        self._nominal += self._follows * (self._w - nominal)
        predicted = before + self._nominal - nominal
        self._seen = predicted + feel.VELOCITY_GAIN * (sample.velocity - predicted)
        travel = sample.position - last.position
        model = self.model
        load = model.update(
            sample.time,
            step,
            sample.position,
            self._seen,
            (self._seen - before) / step,
            sample.payload,
            sample.tilt_alpha,
            sample.tilt_beta,
            sample.temperature,
            travel,
        )
        motor = model.torque_constant * sample.current
        motor *= 1.0 - load.saturation * abs(motor)
        slow = max(1.0 - abs(self._w) / (feel.SLOW_SPEEDS * self.rest_speed), 0.0)
        self._doubt.follow(load.kept, load.elastic, load.damping, slow)
        self.extra = self._doubt.certainty.correction(load.elastic, load.damping)
        carried = load.total + self.extra
        if load.delay > 0.0:
            motor = self._line.delayed(sample.time, motor, load.delay)
        elif load.delay < 0.0:
            carried = self._line.delayed(sample.time, carried, -load.delay)
        self.raw = carried - motor
        if not math.isfinite(self.raw):
            self.raw = 0.0  # only a file edited into absurdity gets here
        self._before = self._older
        self._older = self._old
        self._old = self.torque
        taring = self.state is State.TARING  # by no hand
        self.torque += (1.0 if taring else self._fast) * (self.raw - self.torque)
        self._quiet += self._slow * (self.raw - self._quiet)
        if taring or self.state is State.GUIDING:
            self._quiet = self.torque  # only a rest asks for it

    def _stand(self, state: State) -> None:
        """Rest from now on, and take the zero once the drive stands too."""
        self.state = state
        self._armed = False
        self._since = self._rested = self._mean = 0.0
        self._count = self._pushed = 0

    def _rest(self) -> float:
        """Hold the anchor, take the zero, wait for a hand."""
        left = self.extra - self.raw  # of the model before anything was learned
        starting = self.state is State.STARTING
        self._rested += self.period
        if not self._armed:
            self._since += self.period
            stand, length = (0.0, self.settings.settle) if starting else (feel.STAND_S, feel.ZERO_S)
            if not starting and self._since <= feel.FOLLOW_S and self._let_go and self._last:
                # the drive lets go of the torque that it held against the hand: give way to it a little
                share = 1.0 if self._sure else feel.FOLLOW_SHARE
                creep = self._last.position - self.anchor
                self.anchor = self.limits.clip(self.anchor + share * creep)
            if self._since >= stand + length and self._count > 0:
                self._zero()
            elif self._since > stand:
                changes = self._count > 2 and abs(left - self._mean) > feel.STEADY * self.settings.noise
                if changes and self._rested < feel.LISTEN_S:
                    # it changes: listen anew, unless that can only be a hand that pushes again, as it is
                    # more than a stop leaves
                    if not self._sure and abs(self.raw) > self._gate() + self._bent():
                        self.state, self._armed = State.RESTING, True
                        return self.anchor
                    self._count, self._since, self._mean = 0, stand, 0.0
                self._count += 1
                self._mean += (left - self._mean) / self._count
            return self.anchor
        if not self._let_go:
            # a hand that leant on the axis while it stopped leaves faster than one comes
            jump = self.raw - self._before
            if self._rested > feel.STAND_S and abs(jump) > feel.JUMP * self.settings.noise:
                self._let_go = True
                self._stand(State.RESTING)
                return self.anchor
            self._mean += self._lately * (left - self._mean)
            if self._rested > feel.CALM_S and not self._pushed:
                self._calm()
        start = self.settings.start_torque
        # a hand that leant on the axis while it stopped leaves a torque against its push when it goes: for
        # a while that way needs more, and the zero follows it; both ways, as long as it may be there
        leant = not self._let_go and not self._stalled
        back = self._quiet * self._pushed_way < 0.0
        against = self._rested < feel.LEAVE_S and (leant or back)
        if against:
            start = feel.GATE * self.settings.noise + (self._bent() if leant and back else 0.0)
        rate = start / feel.LEAVE_S if against else feel.TRACK_RATE * start
        slip = min(max(-self._quiet, -rate * self.period), rate * self.period)
        small = (
            abs(self._quiet) < feel.TRACK_SHARE * start
            and abs(self._tracked + slip) < feel.TRACK_SHARE * start
        )
        if against or small:
            self._tracked += 0.0 if against else slip
            self._doubt.certainty.shift(slip)
        # a hard push is taken at once, a light one after a longer look, either not before the stop has calmed
        pushed = abs(self.torque) > 2.0 * start + self.doubt or abs(self._quiet) > start + self.doubt
        self._pushed = self._pushed + 1 if pushed and self._rested > feel.STAND_S else 0
        if self._pushed >= feel.START_SAMPLES:
            self.state = State.GUIDING
            self._x, self._w = self.anchor, 0.0
            self._pushed_way = math.copysign(1.0, self.torque)
            # a hand that is back so soon never left: be slower to believe it the next time
            soon = self._let_go and self._rested < feel.SOON_S
            self._trusting = feel.SLOW_START_S if soon else feel.START_S
            self._account = self._since = self._idle = 0.0
        return self.anchor

    def _gate(self) -> float:
        """More than this at rest is a hand, N m (N)."""
        return self.doubt + feel.GATE * self.settings.noise

    def _bent(self) -> float:
        """What a stop may leave in the bristle beyond the doubt, N m (N)."""
        return feel.STOP_BOUND * self.model.friction_bound

    def _felt(self) -> float:
        """Mean torque at rest that the model does not explain, N m (N)."""
        load = self.model.load
        return self._doubt.certainty.correction(load.elastic, load.damping) - self._mean

    def _zero(self) -> None:
        """What the motor carries now is no hand: learn from it, and put what is left on the bristle."""
        settings, felt = self.settings, self._felt()
        self.state = State.RESTING
        self._armed = True
        if not self._sure and abs(felt) > self._gate():
            # more than the model can be wrong by: the hand is still there, or again, unless the stop left the
            # bristle bent by more than thought; nothing may start on that, so all of it is in doubt
            if abs(felt) <= self._gate() + self._bent():
                self._take(math.hypot(settings.noise, felt))
                # against the push it may be a hand that turned round: look out for its leaving
                if felt * self._pushed_way < 0.0:
                    self._let_go = False
                    self._mean = 0.0
            return
        self._doubt.drift(feel.DRIFT_LOAD * settings.noise, feel.DRIFT_FRICTION)
        self._take(settings.noise)

    def _calm(self) -> None:
        """Nothing changed since the hand eased off: what is felt may be all its, or none."""
        self._let_go = True
        felt = self._felt()
        if abs(felt) <= self._gate():
            self._take(math.hypot(self.settings.noise, felt))

    def _take(self, noise: float) -> None:
        """Make the mean torque at rest the zero; `noise` says how much of it may be a hand, N m (N)."""
        load = self.model.load
        # where a hand may still lean on the axis, nothing must start when it leaves
        self._doubt.settle(-self._felt(), load.elastic, load.damping, noise, sure=self._sure)
        self._tracked = 0.0
        self.torque = self._quiet = 0.0

    def _guide(self, sample: Measurement) -> float:
        """The admittance."""
        torque, before = self.torque, self._before
        certain = math.copysign(max(abs(torque) - self.doubt, 0.0), torque)
        target = self.settings.yielding * certain
        if abs(target) > self.limits.speed:
            target = math.copysign(self.limits.speed, target)
            self.limited = ("speed",)
        speed = self._w + self._virtual * (target - self._w)
        # energy that the hand surely gave, less what it surely got; none is ever lent
        self._account += certain * speed * self.period
        if self._account < 0.0:
            self._account = speed = 0.0
        self._w = speed
        self._since += self.period
        level = abs(before)
        fall = level - math.copysign(self.raw, self.raw * before)
        fell = fall > max(feel.GONE * level, feel.FALL * self.settings.noise) and self._since > self._trusting
        gone = fell and level > self.settings.start_torque + self.doubt  # below that it may still lean on it
        early = self._since < feel.EARLY_S
        self._idle = self._idle + self.period if certain == 0.0 else 0.0
        faded = self._idle > (feel.FADE_S if early else 0.0)
        # friction turns round with the motion, and the model knows it least there: the way back is from rest
        turned = speed * self._pushed_way < 0.0
        if fell or turned or (faded and abs(speed) < self.rest_speed):
            self.state = State.STOPPING
            self._since = 0.0
            self._let_go, self._stalled = gone, early and not gone
            self._sure = False
            self._relief = math.copysign(self._relieve(level), self._w)
            return self._brake(sample)
        self.wanted = speed
        return self._follow(sample)

    def _relieve(self, hand: float) -> float:
        """How far to turn the drive's reference round, rad (m): it holds friction that goes with speed, less
        what the hand held, and creeps on until its integrator has let go of that."""
        model = self.model
        if not model.inertia > 0.0:
            return 0.0
        viscous = abs(model.load.damping * (1.0 + self._doubt.certainty.mean[DAMPING]))
        turned = (2.0 * feel.DRIVE_S) ** 2 * max(viscous - hand, 0.0) / model.inertia
        return min(turned, 2.0 * abs(self._w) * self.period)

    def _follow(self, sample: Measurement) -> float:
        """Advance the law's own place and lead it by the servo's lag, which is trimmed on the way."""
        speed = self._w
        self._x += speed * self.period
        if self._doubt.turn == SPARE:
            behind = self._x - sample.position
            leash = feel.LEASH_S * abs(speed) + 4.0 * self.resolution
            if abs(behind) > leash:
                self._x = sample.position + math.copysign(leash, behind)
            if abs(speed) > 2.0 * self.rest_speed:
                late = min(max(behind / (speed * self._lead_time), -1.0), 1.0)
                rate = feel.TRIM_RATE * (LEARN_EVERY if self.state is State.TARING else TURNS)
                lead = self._lead_time * (1.0 + rate * self.period * late)
                servo = self.settings.servo_time
                self._lead_time = min(max(lead, servo / feel.TRIM_RANGE), servo * feel.TRIM_RANGE)
        return self._x + self._lead_time * speed

    def _brake(self, sample: Measurement) -> float:
        """Ask for the opposite speed for a moment, then for the place where the axis comes to rest."""
        self._since += self.period
        self._w = 0.0
        if abs(sample.velocity) <= self.rest_speed and self._since >= feel.BRAKE_S:
            self._stand(State.RESTING)
            self._armed = not self._let_go  # a hand that eased off may still lean on the axis: no zero then
            counts = feel.STALL_COUNTS if self._stalled else feel.STOP_COUNTS
            self._doubt.unsettle(min(counts * self.resolution * self.model.bristle_stiffness, self._bent()))
            self.anchor = self.limits.clip(sample.position)
            return self.anchor
        if self._since > feel.EASED_S and abs(self.torque) > self._gate():
            self.state = State.GUIDING  # it was a hand that eased off, not one that left
            self._since, self._trusting, self._x = 0.0, feel.SLOW_START_S, sample.position
            self._pushed_way = math.copysign(1.0, self.torque)
        if self._since < feel.KICK_S:
            return sample.position - feel.KICK_SHARE * self._lead_time * sample.velocity
        place = sample.position + feel.COAST_S * sample.velocity
        if self._since < feel.KICK_S + 2.0 * self.period:
            share = 1.0 if self._since < feel.KICK_S + self.period else feel.RELIEF_AGAIN
            place -= share * self._lead_time / self.period * self._relief
        return place

    def _sweep(self, sample: Measurement) -> float:
        """The tare: learn from one sample in LEARN_EVERY; forget all if something touched the axis."""
        settings, load, tare = self.settings, self.model.load, self._tare
        # readings that come late turn damping into what looks elastic, the same way all through
        late = feel.TARE_LATE * load.damping
        if self._doubt.turn == FADE:
            noise = math.hypot(feel.TARE_NOISE * settings.noise, late) / math.sqrt(LEARN_EVERY)
            self._doubt.learn(-self.raw, load.elastic, load.damping, noise)
        if not tare.next(self.model.torque_constant * sample.current, self.raw):
            place = self._follow(sample)
            self._w = tare.speed
            return place
        if tare.touched or tare.remains > (feel.TARE_LEFT * settings.noise) ** 2:
            self._doubt.restore(self._kept)
            self.note = _TOUCHED if tare.touched else _NOT_EXPLAINED
        else:
            unexplained = tare.remains - (feel.TARE_NORMAL * settings.noise) ** 2
            self._doubt.unexplained = math.sqrt(max(unexplained, 0.0))
        self._w = 0.0
        self._sure = self._let_go = True
        self._stand(State.RESTING)
        return self.anchor
