"""What can go wrong with a servo and its bus, on order.

A fault is written as a word (the command line's `--fault`, and the tests'):

    lost=0.02               this share of packets does not arrive, either way; so do late= (60 ms),
                            corrupt= (a bit flips) and twice= (an answer comes again)
    burst@2=0.5             from 2 s on, nothing arrives for 0.5 s
    silent@2                from 2 s on the servo no longer answers
    unplugged@2             the device disappears
    power@2                 the servo loses its power for a moment
    overload@2              the servo shuts its motor off
    error@2=4               these bits of the hardware error status are set (4 is overheating)
    stuck@2                 the encoder stands still
    watchdog@2              the bus watchdog trips; nothing on a servo that has none

Seconds count from the first time the torque is switched on, on the servo's clock.
"""

from __future__ import annotations

import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from idtool.errors import InputError, misspelt, nearest
from idtool.virtual_servo.base import OVERLOAD, VirtualServo

#: How late a late packet is, s of the host: past the time-out of the SDK.
LATE_S = 0.06
_RATES = ("lost", "late", "corrupt", "twice")
_EVENTS = ("burst", "silent", "unplugged", "power", "overload", "error", "stuck", "watchdog")
_NEED_VALUE = ("burst", "error")


@dataclass(frozen=True)
class Fault:
    """One thing that goes wrong.

    Attributes:
        kind: one of those at the head of this module.
        value: rate, seconds of a burst or error bits.
        at_s: when, seconds of torque; None for a rate.
    """

    kind: str
    value: float = 0.0
    at_s: float | None = None


def parse_fault(word: str) -> Fault:
    """Read a fault.

    Raises:
        InputError: the word is not one.
    """
    head, equals, value = word.partition("=")
    kind, at, when = head.partition("@")
    known = _EVENTS if at else _RATES
    if kind not in known:
        forms = {name: f"{name}@SECONDS" for name in _EVENTS} | {name: f"{name}=RATE" for name in _RATES}
        wrong = misspelt(forms, [kind])
        remedy = f'did you mean "{forms[wrong[1]]}"' if wrong else nearest(head, forms.values())
        raise InputError(f'unknown fault "{word}"', remedy=remedy)
    if bool(equals) != (kind in _RATES + _NEED_VALUE):
        form = f"{kind}=RATE" if not at else f"{kind}@SECONDS" + ("=VALUE" if kind in _NEED_VALUE else "")
        raise InputError(f'fault "{word}" is not of its form', remedy=f"write {form}")
    numbers = [_number(text, word) for text in (value, when) if text]
    if kind in _RATES:
        if not 0.0 <= numbers[0] <= 1.0:
            raise InputError(f'the rate of fault "{word}" is no share', remedy="give 0 to 1")
        return Fault(kind, numbers[0])
    return Fault(kind, numbers[0] if equals else 0.0, _number(when, word))


def _number(text: str, word: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0.0 <= number < math.inf:
        raise InputError(f'"{text}" in fault "{word}" is no number of 0 or more', remedy="correct it")
    return number


class Mishaps:
    """Faults in force on one servo and its bus.

    Args:
        faults: which.
        seed: of what is lost, late, corrupt or doubled.

    Attributes:
        counts: how often each kind struck.
        unplugged: the device is gone.
        struck_at: when something last happened that was due, s of the servo's clock; None before.
    """

    def __init__(self, faults: list[Fault], *, seed: int = 0) -> None:
        self._rates = {fault.kind: fault.value for fault in faults if fault.at_s is None}
        self._waiting = [fault for fault in faults if fault.at_s is not None]
        self._random = random.Random(seed)
        self._silent_until = -math.inf
        self.counts: Counter[str] = Counter()
        self.unplugged = False
        self.struck_at: float | None = None

    def add(self, fault: Fault) -> None:
        """Put one more into force."""
        if fault.at_s is None:
            self._rates[fault.kind] = fault.value
        else:
            self._waiting.append(fault)

    def happen(self, servo: VirtualServo, now: float) -> None:
        """Let happen what is due."""
        if servo.torque_since is None:
            return
        due = [fault for fault in self._waiting if now - servo.torque_since >= (fault.at_s or 0.0)]
        for fault in due:
            self._waiting.remove(fault)
            self.counts[fault.kind] += 1
            self.struck_at = now
            self._strike(fault, servo, now)

    def _strike(self, fault: Fault, servo: VirtualServo, now: float) -> None:
        if fault.kind == "burst":
            self._silent_until = now + fault.value
        elif fault.kind == "silent":
            self._silent_until = math.inf
        elif fault.kind == "unplugged":
            self.unplugged = True
        elif fault.kind == "stuck":
            servo.stuck = True
        else:
            servo_does: dict[str, Callable[[], None]] = {
                "overload": lambda: servo.fail(OVERLOAD),
                "error": lambda: servo.fail(int(fault.value)),
                "watchdog": servo.trip_watchdog,
                "power": servo.lose_power,
            }
            servo_does[fault.kind]()

    def arrives(self, now: float) -> bool:
        """Whether a packet from the host gets through."""
        return now >= self._silent_until and not self._hit("lost")

    def pass_on(self, answer: bytes) -> list[tuple[float, bytes]]:
        """What becomes of an answer: delay, s of the host, and bytes, of each packet that arrives."""
        if self._hit("lost"):
            return []
        if self._hit("corrupt"):
            place = self._random.randrange(len(answer))
            bit = 1 << self._random.randrange(8)
            answer = answer[:place] + bytes([answer[place] ^ bit]) + answer[place + 1 :]
        delay = LATE_S if self._hit("late") else 0.0
        return [(delay, answer)] * (2 if self._hit("twice") else 1)

    def _hit(self, kind: str) -> bool:
        rate = self._rates.get(kind, 0.0)
        # without a rate nothing is drawn, so that one fault does not change the luck of another
        hit = rate > 0.0 and self._random.random() < rate
        self.counts[kind] += hit
        return hit
