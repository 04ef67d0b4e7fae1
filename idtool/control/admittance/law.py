"""The admittance law as the controller sees it: settings in, the compiled law (`kernel`) inside."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from idtool.control.admittance import kernel, record, tare
from idtool.control.admittance.constants import CONSTANTS, constants_of, share
from idtool.control.admittance.states import GUIDING, ORDER, RESTING
from idtool.control.guard import Limits, Measurement
from idtool.control.law import Law
from idtool.control.online import OnlineModel
from idtool.control.sensing import Remainder

#: Share of the friction level that a bristle at rest may hold without our knowing, as a standard deviation:
#: what is anywhere between -1 and 1 has 0.58.
BRISTLE_PRIOR = 0.6
#: Two parts of a tare further apart than this, in torque noises, did not both come from the axis: where
#: nothing touched they were below 1.7 on 150 axes (20 samples a part) of the study of hand guiding; and what
#: the noise of few samples adds, over the root of their number.
_APART, _NOISE_APART = 2.0, 2.2
_WORDS = {
    record.TOUCHED: "the tare was disturbed and is not used: keep hands off and call tare() again",
    record.NOT_EXPLAINED: (
        "the tare met more than load and friction can explain, both times alike, and is not used: the axis"
        " stays heavier; a diagnosis of its logs may find the effect that the parameter file lacks"
    ),
}


@dataclass(frozen=True)
class AdmittanceSettings:
    """How the law is set; N m and rad (N and m on a linear axis).

    Attributes:
        gain: admittance gain K_c, speed per certain torque of the hand, rad/s per N m.
        start_torque: a hand that is not this much beyond what a rest may be wrong by starts no motion.
        level, damping, load: standard deviation of the friction level and of the damping, relative, and of
            the load, N m, before a tare.
        stribeck: standard deviation of the friction at rest against that in motion, N m.
        refuse: a tare that finds more load than this beside the file and the payload is not used, N m.
        noise: standard deviation of one sample's torque, N m.
        servo_time: first guess of the position loop's time constant, s.
        settle: how long it listens before it follows a hand, s.
        tare_travel, tare_speed: how far a tare moves, and how fast at most.
        per_kilogram: gravity torque of a kilogram, N m/kg; 0 where the file does not know.
    """

    gain: float
    start_torque: float
    level: float
    damping: float
    load: float
    stribeck: float
    refuse: float
    noise: float
    servo_time: float
    settle: float
    tare_travel: float
    tare_speed: float
    per_kilogram: float


@final
class AdmittanceLaw(Law):
    """An admittance driven by what is certain of the hand."""

    def __init__(
        self,
        model: OnlineModel,
        limits: Limits,
        period: float,
        resolution: float,
        settings: AdmittanceSettings,
    ) -> None:
        """Everything as in `ForceFreeController`."""
        super().__init__(model, limits, period, resolution)
        self.settings = settings
        self.constants = constants_of(_axis(model, limits, period, resolution, self.rest_speed, settings))
        self._constants, self._states = np.array([self.constants]), np.zeros(1, record.STATE)
        self._s: Any = self._states[0]
        self._remainder = Remainder(model, period, in_time=True)
        self._load()
        self.reset()

    def _load(self) -> None:
        """Call once what is compiled: a first call compiles or loads it, and no servo waits for that."""
        states = np.zeros(1, record.STATE)
        state: Any = states[0]
        kernel.reset(self.constants, state)
        kernel.begin(self.constants, state, 0.0)
        kernel.watch_in(self._constants, states, 0.0)
        kernel.act_in(self._constants, states, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0)
        tare.tare(self.constants, state)
        kernel.hold_in(states)
        kernel.stand_in(self._constants, states, 0.0)

    def reset(self) -> None:
        """What was learned and trimmed is forgotten too."""
        kernel.reset(self.constants, self._s)
        self.begin(0.0)

    def begin(self, position: float) -> None:
        """The bristle is unknown, what was learned of load and friction still holds."""
        self.model.reset()
        self._remainder.clear()
        kernel.begin(self.constants, self._s, position)
        self._tell()

    def _tell(self) -> None:
        """What others read."""
        state, limited, outcome, self.anchor, self.torque, self.raw, self.extra, wanted, self.uncertainty = (
            kernel.told(self._states)
        )
        self.state = ORDER[state]
        self.wanted = wanted if state == GUIDING else 0.0
        self.limited = ("speed",) if limited else ()
        self.note = self._tare_note(outcome) if outcome != record.USED else ""

    def _tare_note(self, outcome: int) -> str:
        """What the last tare came to, which is not used."""
        if outcome != record.OTHER_LOAD:
            return _WORDS[outcome]
        load, per = float(self._s["load"]), self.settings.per_kilogram
        much = f"{load / per:+.2f} kg" if per else f"{load:+.3g} at the shaft"
        return (
            f"the tare found {much} beside what the file and the payload say, and is not used: a hand leant"
            " on the axis, or its payload is another; hands off, tell the payload, and call tare() again"
        )

    @property
    def learned(self) -> tuple[float, float, float]:
        """Load that nobody told of (N m or N); friction level and viscous friction over the file's."""
        load, level, damping, _ = self._s["learned"].tolist()
        return load, 1.0 + level, 1.0 + damping

    @property
    def ready(self) -> bool:
        """Whether it rests, its zero is taken, and a hand may push."""
        return int(self._s["state"]) == RESTING and float(self._s["zero_variance"]) == 0.0

    def tare(self) -> bool:
        """Learn load and friction by moving to and fro; False while it is not ready."""
        began = bool(tare.tare(self.constants, self._s))
        self._tell()
        return began

    def stand(self, position: float) -> None:
        """The zero may be off by what a stop can leave."""
        self._remainder.clear()
        kernel.stand_in(self._constants, self._states, position)
        self._tell()

    def rest(self) -> None:
        """The zero stays as it is."""
        kernel.hold_in(self._states)
        self._tell()

    def raw_command(self, sample: Measurement) -> float:
        """One sample: the command before its limits."""
        self._remainder.take(sample)
        change, seen = kernel.watch_in(self._constants, self._states, sample.velocity)
        plain = self._remainder.torque(sample, seen, change / self._remainder.step)
        load = self.model.load
        command = kernel.act_in(
            self._constants, self._states, sample.position, sample.velocity, sample.current,
            plain, load.elastic, load.damping, load.kept, load.felt,
        )  # fmt: skip
        self._tell()
        return float(command)


def _axis(
    model: OnlineModel,
    limits: Limits,
    period: float,
    resolution: float,
    rest_speed: float,
    settings: AdmittanceSettings,
) -> dict[str, Any]:
    """What an axis brings to the constants."""
    reach = 0.5 * settings.tare_travel
    part = max(math.ceil(2.0 * math.pi * reach / (settings.tare_speed * period * record.PARTS)), 1)
    cycle = record.PARTS * part
    turn = 2.0 * math.pi / cycle
    middle = 0.5 * (limits.position_min + limits.position_max)
    apart = (_APART + _NOISE_APART / math.sqrt(part)) * settings.noise / model.torque_constant
    stop = CONSTANTS["stop_counts"].value * resolution * model.presliding_stiffness
    return {
        "period": period,
        "torque_constant": model.torque_constant,
        "gain": settings.gain,
        "noise": settings.noise,
        "servo_time": settings.servo_time,
        "speed": limits.speed,
        "rest_speed": rest_speed,
        "resolution": resolution,
        # a fine sensor shows how a bristle gives under a hand, too: less than one noise would move it is none
        "grain": max(1.01 * resolution, settings.gain * settings.noise * CONSTANTS["still"].value),
        "low": limits.position_min,
        "high": limits.position_max,
        "reports": share(model.late, period),
        # friction may be above the file's: its level and what that may be off by
        "zero_most": model.friction_bound * (1.0 + CONSTANTS["coverage"].value * settings.level),
        "start_torque": settings.start_torque,
        "stop_torque": math.hypot(
            min(stop, model.friction_bound), CONSTANTS["coverage"].value * settings.stribeck
        ),
        "refuse": settings.refuse,
        "settle_periods": max(1, round(settings.settle / period)),
        "still_periods": max(1, round(CONSTANTS["still"].value / period)),
        "brake_periods": max(1, round(CONSTANTS["brake"].value / period)),
        "steady_periods": max(1, round(CONSTANTS["steady"].value / period)),
        "tare_turn": turn,
        "tare_top": reach * turn / period,
        "tare_cycle": cycle,
        "tare_part": part,
        "tare_apart": apart,
        "tare_middle": math.inf if math.isnan(middle) else middle,  # no limits: to the right
        "prior": (
            max(settings.load, 1e-9),
            settings.level,
            settings.damping,
            max(BRISTLE_PRIOR * model.friction_bound, 1e-9),
        ),
    }
