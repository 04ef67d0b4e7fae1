"""Gains of the admittance law for a wanted feel, with the margins that they leave.

The feel is one force at one speed. What the model may still be wrong by after a tare, D at this speed, and
the most that the bias estimate takes of a steady hand, B, are left to the hand, so

    K_c = w / (tau - D - B).

The loop through the hand, with everything that is late in it (d: sampling and the delay of the readings; s
the Laplace variable), is

    L = K_c / (1 + T_v s) { Z_h G e^(-d s) - C (N - G e^(-d s)) }

Z_h = k / s + b is the hand, G the servo's velocity loop, C = J s + damping what the law compensates, N the
motion that it compensates it for (its own, drawn to the measured one). Below some gain the loop is stable;
it stays so until L crosses the negative real axis at -1, so the least 1 / |L| over those crossings is the
gain margin (Astrom & Murray, Feedback Systems, section 10.3). It is stated for soft and stiff hands, damping
off by 15 % either way (what a tare leaves of 30 % and more) and readings late by up to 20 ms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from idtool.control.admittance import hand, kernel, record, tare
from idtool.control.admittance.constants import CONSTANTS
from idtool.control.admittance.law import AdmittanceLaw
from idtool.control.admittance.states import RESTING, TARING
from idtool.control.force_free import COMMAND_GAIN, ForceFreeController
from idtool.control.load import Instant
from idtool.control.online import OnlineModel
from idtool.errors import InputError
from idtool.model import stribeck
from idtool.model.motion import Array
from idtool.parameters import Controller, Parameters

#: The hands of the margins, N/m and N s/m at the moving part.
HANDS = {"soft": (200.0, 10.0), "stiff": (2000.0, 40.0)}
#: How late the readings may come, s.
DELAYS = (0.0, 0.01, 0.02)
#: By how much the friction that is left after a tare may be off, relatively, either way.
FRICTION_OFF = 0.15
#: Gain margin that is asked for with readings late by 10 ms at most, and with the latest.
LEAST_MARGIN, LEAST_MARGIN_LATE = 1.5, 1.1
#: What a tare leaves unexplained on most axes of the study, in torque noises.
_UNEXPLAINED = 0.6
#: How fast a part is guided, m/s (the paper's hand), and how many times as heavy as bare friction is no help.
_GUIDING_M_S, _HEAVY = 0.0192, 10.0
_FREQUENCIES = np.geomspace(0.5, 400.0, 6000)


@dataclass(frozen=True)
class Margin:
    """Gain margin of one loop: by how much K_c could be raised before it oscillates.

    Attributes:
        hand: "soft" or "stiff".
        delay: of the readings, s.
        friction: true over identified.
        gain: the margin.
        frequency: of the oscillation beyond it, Hz.
    """

    hand: str
    delay: float
    friction: float
    gain: float
    frequency: float


@dataclass(frozen=True)
class Tuning:
    """Gains and what they promise.

    Attributes:
        controller: for the file.
        torque, speed: the feel at the shaft, N m and rad/s (N and m/s).
        uncertainty: torque of it that is left to the hand because the model is not certain, N m (N).
        break_away: torque at which it starts from rest, N m (N).
        margins: of every hand, delay and friction.
        ratio: travel of the moving part per position, m/rad.
        notes: sentences that qualify them.
    """

    controller: Controller
    torque: float
    speed: float
    uncertainty: float
    break_away: float
    margins: tuple[Margin, ...]
    ratio: float
    notes: tuple[str, ...] = ()

    @property
    def worst(self) -> Margin:
        """The least margin."""
        return min(self.margins, key=lambda m: m.gain)

    def to_document(self) -> dict[str, Any]:
        """A JSON document; forces in N at the moving part."""
        return {
            "schema": "ffc-id/tuning/1",
            "controller": {
                "mode": self.controller.mode,
                "command_gain_s": self.controller.command_gain,
                "loop_gain": self.controller.loop_gain,
                "start_torque": self.controller.start_torque,
                "period_s": self.controller.period,
            },
            "force_n": self.torque / self.ratio,
            "speed_mm_s": 1e3 * self.speed * self.ratio,
            "uncertainty_n": self.uncertainty / self.ratio,
            "break_away_n": self.break_away / self.ratio,
            "margins": [vars(margin) for margin in self.margins],
            "notes": list(self.notes),
        }


def tune(
    parameters: Parameters,
    *,
    force: float,
    speed: float,
    ratio: float,
    period: float = 0.01,
    servo_bandwidth: float = 20.0,
) -> Tuning:
    """Find the gains.

    Args:
        parameters: a file with torque constant, gravity and static friction.
        force: of the hand at the moving part, N.
        speed: that it shall give there, m/s.
        ratio: travel of the moving part per position, m/rad (1 on a linear axis).
        period: of the controller, s.
        servo_bandwidth: of the drive's velocity loop, Hz.

    Raises:
        InputError: the file lacks what is needed, or no gain gives this feel: the sentence says why, and
            which force is the least at this speed.
    """
    if not (force > 0.0 and speed > 0.0 and ratio > 0.0 and period > 0.0 and servo_bandwidth > 0.0):
        raise InputError("force, speed, period and bandwidth must be above zero")
    model = OnlineModel(parameters)
    torque, pace = force * ratio, speed / ratio
    law = _law(parameters, period)
    uncertainty = uncertainty_after_tare(parameters, pace, period) + float(law.constants["bias_most"])
    start = law.settings.start_torque
    rest = _break_away(law)
    floor = (
        f"at {1e3 * speed:.3g} mm/s the model is uncertain by {uncertainty / ratio:.2g} N even after a tare"
    )
    if torque <= 1.05 * max(uncertainty, rest):
        raise InputError(
            f"{force:.3g} N cannot move it: {floor}, and at rest {rest / ratio:.2g} N may be friction's",
            remedy=f"ask for {1.5 * max(uncertainty, rest) / ratio:.2g} N or more, "
            "or identify friction better",
        )
    gain = pace / (torque - uncertainty)
    margins = margins_of(model, gain, ratio, period, servo_bandwidth)
    scale = min(m.gain / (LEAST_MARGIN_LATE if m.delay > 0.015 else LEAST_MARGIN) for m in margins)
    if scale < 1.0:
        worst = min(margins, key=lambda m: m.gain)
        least = (uncertainty + pace / (gain * scale)) / ratio
        verb = "oscillates" if worst.gain < 1.0 else "is too near to oscillating"
        raise InputError(
            f"{force:.3g} N at {1e3 * speed:.3g} mm/s {verb}: against a {worst.hand} hand with readings"
            f" {1e3 * worst.delay:.0f} ms late the gain margin is {worst.gain:.2f} at"
            f" {worst.frequency:.1f} Hz",
            remedy=f"ask for {least:.2f} N or more at this speed, or shorten the period of {period:g} s",
        )
    command = parameters.controller.command_gain if parameters.controller else COMMAND_GAIN
    controller = Controller(command, gain, period, start, "light")
    doubt = (f"{parameters.unexplained}.",) if parameters.unexplained else ()
    notes = doubt + _heavier_than_bare(model, gain, ratio, uncertainty)
    return Tuning(controller, torque, pace, uncertainty, rest, margins, ratio, notes)


def _heavier_than_bare(model: OnlineModel, gain: float, ratio: float, uncertainty: float) -> tuple[str, ...]:
    """A sentence where a hand would find the axis far heavier than one whose drive is off."""
    pace = _GUIDING_M_S / ratio
    level = stribeck.level(pace, model.coulomb, model.static, model.stribeck_velocity)
    bare, guided = level + model.viscous * pace, uncertainty + pace / gain
    if guided < _HEAVY * bare:
        return ()
    return (
        f"at {1e3 * _GUIDING_M_S:g} mm/s these gains take {guided / ratio:.3g} N, and friction with the "
        f"drive off {bare / ratio:.3g} N: they brake the hand (forces in N, speeds in mm/s, levers in m).",
    )


def tuned(parameters: Parameters, tuning: Tuning) -> Parameters:
    """The file with these gains."""
    return replace(parameters, controller=tuning.controller)


def _law(parameters: Parameters, period: float) -> AdmittanceLaw:
    law = ForceFreeController(parameters, period, mode="light").law
    assert isinstance(law, AdmittanceLaw)
    return law


def _break_away(law: AdmittanceLaw) -> float:
    """Torque at which a tared axis starts, N m (N): as `rest.rest`."""
    c, s = law.constants, np.zeros(1, record.STATE)[0]
    s["unexplained"] = _UNEXPLAINED * law.settings.noise
    return float(max(c["floor"], hand.rest_bound(c, s)) + c["start_torque"])


def uncertainty_after_tare(parameters: Parameters, speed: float, period: float) -> float:
    """What the model may be wrong by at a speed once a tare was made, N m (N).

    The least squares of the tare are run over its motion with this model; their covariance depends on the
    motion only, not on what is measured.
    """
    law = _law(parameters, period)
    c, model = law.constants, OnlineModel(parameters)
    s: Any = np.zeros(1, record.STATE)[0]
    kernel.reset(c, s)
    kernel.begin(c, s, 0.0)
    s["state"] = RESTING
    tare.tare(c, s)
    place, k = 0.0, 0
    while int(s["state"]) == TARING:
        angle = float(c["tare_turn"]) * k
        now = 0.5 * law.settings.tare_travel * (1.0 - math.cos(angle))
        pace = float(c["tare_top"]) * math.sin(angle)
        load = model.update(Instant(k * period, period, now, pace, travel=now - place))
        kernel.act(c, s, now, pace, 0.0, 0.0, load.elastic, load.damping, load.kept, load.felt)
        place, k = now, k + 1
    s["unexplained"] = _UNEXPLAINED * law.settings.noise
    # and a push of a second at the speed, in which the bristle is deflected
    worst = 0.0
    for j in range(round(1.0 / period)):
        place += speed * period
        load = model.update(Instant((k + j) * period, period, place, speed, travel=speed * period))
        s["elastic"], s["damping"] = load.elastic, load.damping
        worst = max(worst, float(hand.uncertainty(c, s)))
    return worst


def margins_of(
    model: OnlineModel, gain: float, ratio: float, period: float, bandwidth: float
) -> tuple[Margin, ...]:
    """Gain margins over hands, delays and friction."""
    return tuple(
        _margin(model, gain, ratio, period, bandwidth, hand, delay, friction)
        for hand in HANDS
        for delay in DELAYS
        for friction in (1.0 - FRICTION_OFF, 1.0, 1.0 + FRICTION_OFF)
    )


def _margin(
    model: OnlineModel,
    gain: float,
    ratio: float,
    period: float,
    bandwidth: float,
    hand: str,
    delay: float,
    friction: float,
) -> Margin:
    loop = loop_gain(model, gain, ratio, period, bandwidth, HANDS[hand], delay, friction)
    left, right = loop.imag[:-1], loop.imag[1:]
    crosses = np.flatnonzero((np.sign(left) != np.sign(right)) & (loop.real[:-1] < 0.0))
    if not len(crosses):
        return Margin(hand, delay, friction, math.inf, math.nan)
    size = np.abs(loop.real[crosses])
    worst = int(np.argmax(size))
    frequency = _FREQUENCIES[crosses[worst]] / (2.0 * math.pi)
    return Margin(hand, delay, friction, float(1.0 / size[worst]), float(frequency))


def loop_gain(
    model: OnlineModel,
    gain: float,
    ratio: float,
    period: float,
    bandwidth: float,
    hand: tuple[float, float],
    delay: float,
    friction: float,
) -> Array:
    """L over `_FREQUENCIES` (rad/s), complex, shape (frequencies,)."""
    s = 1j * _FREQUENCIES
    stiffness, damping = hand[0] * ratio**2, hand[1] * ratio**2
    # half a period for holding the command, half for the mean of the current's readings
    late = np.exp(-s * (delay + period))
    servo = 1.0 / ((1.0 + s / 300.0) ** 2 * (1.0 + s / (2.0 * math.pi * bandwidth)))
    drag = model.viscous + model.bristle_damping
    known = model.inertia * s + drag
    true = model.inertia * s + friction * drag
    gains = {name: constant.value for name, constant in CONSTANTS.items()}
    pace = -math.log(1.0 - gains["velocity_gain"]) / period
    nominal = s / (s + pace) / (1.0 + gains["follows"] * s) + pace / (s + pace) * servo * late
    law = gain / (1.0 + gains["virtual"] * s)
    result: Array = law * ((stiffness / s + damping + true) * servo * late - known * nominal)
    return result
