"""Hand guiding on axes of the simulated rig, pushed in turn.

Every axis is pushed both ways and let go while moving, pushed both ways and held before it is let go,
pushed by a slowly rising force until it moves, and left alone; once as it is switched on, once after
`tare()`. What is measured is the truth inside the simulation at every millisecond, not the readings.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from idtool.control import ForceFreeController, Limits, State
from idtool.model.motion import Array
from idtool.parameters import Controller
from idtool.rig import plant
from idtool.rig.base import TrialSetup
from idtool.rig.numbers import plant_numbers
from testbench.guided_axes.axis import NO_HAND, GuidedAxis, speed_profile
from testbench.guided_axes.cases import PAYLOAD_KG, Case

SPEED = 0.0192
COUNT = 2.0 * math.pi / 4096
PERIOD = 0.01
GAINS = Controller(2.05, 8.0, PERIOD, mode="light")
_REST_S = 1.0


@dataclass(frozen=True)
class Pushed:
    """One push.

    Attributes:
        force, speed: means over its last second, N and mm/s at the slide.
        swing: root mean square of the speed about that mean, mm/s.
        stop: until it stayed within a count, ms.
        ripple: of the rest that followed, counts.
        energy: given to the hand, mJ; negative: the hand worked.
        moving: let go while moving.
    """

    force: float
    speed: float
    swing: float
    stop: float
    ripple: float
    energy: float
    moving: bool


@dataclass(frozen=True)
class Guided:
    """One run.

    Attributes:
        pushes: the four pushes.
        force: mean over these, N.
        stop: the longest stop of those let go while moving, ms.
        ripple, energy, swing: the worst of these.
        break_away: force at which a slowly rising one has moved the slide by 0.5 mm, N.
        drift: counts over two seconds without a hand.
        starts: how often it began to follow though nobody had touched it for the whole period before.
        note: what the controller had to say at the end.
        felt: time, command, estimated torque, uncertainty, speed wanted and state once per period, shape
            (periods, 6).
    """

    pushes: tuple[Pushed, ...]
    force: float
    stop: float
    ripple: float
    energy: float
    swing: float
    break_away: float
    drift: float
    starts: int
    note: str
    felt: Array


def guide(case: Case, *, tared: bool, ramps: bool = True) -> Guided:
    """Run the whole sequence on one axis."""
    axis, law = set_up(case)
    session = _Session(axis, law, case.ratio)
    session.alone(0.6)
    if tared:
        law.tare()
        session.alone(4.0)
    pushes = tuple(session.push(case, way, hold) for hold in (0.0, 0.6) for way in (1, -1))
    away = [session.ramp(way) for way in (1, -1)] if ramps else [math.nan]
    before = axis.place
    session.alone(2.0)
    felt = np.array(session.rows)
    touched = np.any([torque[3] != 0.0 for torque in axis.truth], axis=1)
    guided = felt[:, 5] == list(State).index(State.GUIDING)
    return Guided(
        pushes,
        force=sum(p.force for p in pushes) / len(pushes),
        stop=max(p.stop for p in pushes if p.moving),
        ripple=max(p.ripple for p in pushes),
        energy=max(p.energy for p in pushes),
        swing=max(p.swing for p in pushes),
        break_away=max(away),
        drift=abs(axis.place - before) / COUNT,
        starts=int(np.sum(guided[1:] & ~guided[:-1] & ~touched[1:] & ~touched[:-1])),
        note=" ".join((*law.status.notes, law.status.message if law.status.fault else "")),
        felt=felt,
    )


def set_up(case: Case) -> tuple[GuidedAxis, ForceFreeController]:
    """The axis, at rest, and its controller."""
    numbers = plant_numbers(case.truth, TrialSetup(payload_kg=case.payload))
    axis = GuidedAxis(
        numbers, at_rest(case, numbers), PERIOD, case.motion_delay, case.current_delay, case.seed
    )
    limits = case.truth.limits
    reach = Limits(limits["lowest_rad"], limits["highest_rad"], speed=limits["speed_rad_s"])
    return axis, ForceFreeController(case.file, PERIOD, limits=reach)


def at_rest(case: Case, p: plant.PlantNumbers) -> Array:
    """Balance, with the bristle bent."""
    state, _ = plant.blank_state()
    friction = case.truth.friction
    state[plant.BRISTLE] = case.bristle * friction["static_nm"] / friction["bristle_stiffness_nm_per_rad"]
    load = plant.gravity_torque(p, 0.0)
    if p.compliance > 0.0:
        state[plant.LOAD_POSITION] = -load / p.compliance
    held = p.bristle_stiffness * state[plant.BRISTLE]
    torque = load + plant.effect_torque(p, 0.0, 0.0, 0.0) + held
    state[plant.INTEGRAL] = torque * (1.0 + p.kappa * abs(torque) / p.torque_constant)
    return state


class _Session:
    """The controller on the axis, and what a hand does to it."""

    def __init__(self, axis: GuidedAxis, law: ForceFreeController, ratio: float) -> None:
        self.axis, self.law, self.ratio = axis, law, ratio
        self.rows: list[tuple[float, ...]] = []
        self.command = 0.0
        self.steps = 0

    def run(self, seconds: float, hand: Callable[[float], Array]) -> None:
        """Step for so long; `hand` of the time since the start."""
        for k in range(round(seconds / PERIOD)):
            now, position, velocity, current = self.axis.advance(self.command, hand(k * PERIOD))
            self.steps += 1
            warm = plant.temperature(self.axis.numbers, now)
            self.command = self.law.step(
                position,
                velocity,
                current,
                PAYLOAD_KG,
                temperature_degc=round(warm),
                time_s=self.steps * PERIOD,
            )
            status = self.law.status
            self.rows.append(
                (
                    self.steps * PERIOD,
                    self.command,
                    status.external_torque,
                    status.uncertainty,
                    status.velocity_wanted,
                    float(list(State).index(status.state)),
                )
            )

    def alone(self, seconds: float) -> None:
        """Step for so long while nobody touches."""
        self.run(seconds, lambda _: NO_HAND)

    def push(self, case: Case, way: int, hold: float) -> Pushed:
        """Push, perhaps hold still, let go, leave alone."""
        speed = SPEED / self.ratio
        stiffness, damping = case.stiffness * self.ratio**2, case.damping * self.ratio**2
        length = 2.0 if case.stiffness > 300.0 else 4.0
        start, begun = self.axis.place, self.steps
        work = self.axis.work

        def hand(t: float) -> Array:
            place, pace = speed_profile(t, 0.25, speed)
            if t > length:
                less, slower = speed_profile(t - length, 0.25, speed)
                place, pace = place - less, pace - slower
            share = min(t / 0.05, 1.0)
            rise = 20.0 if t < 0.05 else 0.0
            return np.array([stiffness, damping, start + way * place, way * pace, 0.0, 0.0, share, rise])

        self.run(length + hold, hand)
        work = self.axis.work - work
        let_go = self.steps
        self.alone(_REST_S)
        truth = np.concatenate(self.axis.truth[begun:], axis=1)
        per = truth.shape[1] // (self.steps - begun)
        steady = slice(round((length - 1.0) / PERIOD) * per, round(length / PERIOD) * per)
        rest = truth[0, (let_go - begun) * per :]
        away = np.flatnonzero(np.abs(rest - rest[-1]) > COUNT)
        return Pushed(
            force=way * float(np.mean(truth[3, steady])) / self.ratio,
            speed=1e3 * self.ratio * way * float(np.mean(truth[1, steady])),
            swing=1e3 * self.ratio * float(np.std(truth[1, steady])),
            stop=float(away[-1] + 1) if len(away) else 0.0,
            ripple=float(np.ptp(rest[len(rest) // 2 :])) / COUNT,
            energy=-1e3 * work,
            moving=hold == 0.0,
        )

    def ramp(self, way: int) -> float:
        """Raise a force by 0.5 N/s until the slide has moved by 0.5 mm; that force, N (6 at most)."""
        self.alone(3.0)
        start, rate = self.axis.place, 0.5
        found = 6.0
        for k in range(round(6.0 / rate / PERIOD)):
            force = rate * k * PERIOD
            hand = NO_HAND.copy()
            hand[4:6] = way * force * self.ratio, way * rate * self.ratio
            self.run(PERIOD, lambda _, hand=hand: hand)  # type: ignore[misc]
            if way * (self.axis.place - start) * self.ratio > 0.5e-3:
                found = force
                break
        self.alone(_REST_S)
        return found


def after_tare(case: Case, newton: float, begin: float, seconds: float) -> ForceFreeController:
    """The controller after a tare into which a hand pushed for a while, N and s from its beginning."""
    axis, law = set_up(case)
    command, begun = 0.0, math.inf
    for k in range(450):
        if not math.isfinite(begun) and law.tare():
            begun = k * PERIOD
        hand = NO_HAND.copy()
        if begin <= k * PERIOD - begun < begin + seconds:
            hand[4] = newton * case.ratio
        _, position, velocity, current = axis.advance(command, hand)
        command = law.step(position, velocity, current, PAYLOAD_KG, time_s=(k + 1) * PERIOD)
    return law
