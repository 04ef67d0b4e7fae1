"""Random axes: a slide, a pendulum arm, a free shaft, a linear stage, and the drive and sensors they have."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from testbench.draws import between
from testbench.other_plants.motion import Drive
from testbench.other_plants.physics import ELASTO_PLASTIC, LUGRE, MAXWELL_SLIP, Axis

KINDS = ("slide", "arm", "shaft", "stage")
GRADES = ("lab", "dynamixel", "drive")
RATES = (50, 100, 200, 250, 500, 1000)


@dataclass(frozen=True)
class Machine:
    """One axis as it stands there.

    Attributes:
        kind, grade: of `KINDS`, `GRADES`.
        axis: its physics without effects.
        drive: its controller.
        speed: the highest of its experiments, rad/s or m/s.
        constant: torque (force) per ampere.
        logs_current: whether the log has the current rather than the torque.
        rate: of the log, Hz.
        reading_noise, drive_noise: torque, of a reading and of the drive itself.
        soft: whether commands are smooth.
        jitter: of the sampling instants over the period.
    """

    kind: str
    grade: str
    axis: Axis
    drive: Drive
    speed: float
    constant: float
    logs_current: bool
    rate: int
    reading_noise: float
    drive_noise: float
    soft: bool
    jitter: float

    @property
    def linear(self) -> bool:
        """Whether it moves in metres."""
        return self.kind == "stage"


#: Current and speed steps of a DYNAMIXEL XH540 (e-manual): 2.69 mA, 0.229 rpm; 4096 counts a turn.
CURRENT_STEP, SPEED_STEP, COUNT = 2.69e-3, 0.229 * math.pi / 30.0, 2.0 * math.pi / 4096.0


def draw(
    rng: np.random.Generator,
    *,
    kinds: tuple[str, ...] = KINDS,
    law: int | None = None,
    stiff: bool = False,
    least_rate: int = 50,
) -> Machine:
    """A machine from a wide range; `stiff` where an effect needs presliding that is short."""
    kind = str(rng.choice(kinds))
    linear = kind == "stage"
    grade = str(rng.choice([g for g in GRADES if not (linear and g == "dynamixel")]))
    half = between(rng, 0.1, 0.4) if linear else between(rng, 1.0, 2.6)
    speed = half * rng.uniform(0.6, 1.5)
    if grade == "dynamixel":
        speed = max(speed, 25.0 * SPEED_STEP)
    if grade == "dynamixel":
        coulomb = between(rng, 0.05, 0.3)
    else:
        coulomb = between(rng, 4.0, 60.0) if linear else between(rng, 0.04, 15.0)
    ratio = between(rng, 1.1, 1.6)
    static = coulomb * (ratio if rng.random() < 0.75 else 1.0 / ratio)
    viscous = coulomb * rng.uniform(0.3, 1.5) / speed
    damping = viscous * between(rng, 0.2, 1.2)
    while viscous < 1.3 * damping * (static - coulomb) / coulomb:
        damping *= 0.7
    soft_bristle = rng.random() < 0.5 and not stiff
    presliding = half * (between(rng, 0.08, 0.6) if soft_bristle else between(rng, 1e-3, 0.03))
    inertia = coulomb * between(rng, 0.1, 0.8) / (speed * 2.0 * math.pi)
    if law is None:
        # over a soft presliding the laws differ by many times the noise: there it is LuGre's
        law = LUGRE if soft_bristle else int(rng.choice((LUGRE, ELASTO_PLASTIC, MAXWELL_SLIP)))
    axis = Axis(
        inertia=inertia,
        coulomb=coulomb,
        static=static,
        stribeck_velocity=speed * between(rng, 0.06, 0.2),
        viscous=viscous,
        stiffness=max(coulomb, static) / presliding,
        damping=damping if law != MAXWELL_SLIP else 0.1 * damping,
        law=law,
        plastic_from=rng.uniform(0.3, 0.8),
        middle=0.0,
        half_stroke=half,
        ripple_softness=0.01 * speed,
    )
    if kind == "slide":
        per_payload = coulomb * between(rng, 2.0, 6.0)
        axis = axis._replace(
            base=coulomb * between(rng, 1.0, 3.5),
            per_payload=per_payload,
            payload_inertia=0.02 * inertia * rng.uniform(0.0, 1.0),
        )
    elif kind == "arm":
        size, turn = coulomb * between(rng, 1.5, 6.0), rng.normal(0.0, 0.15)
        axis = axis._replace(sine=size * math.cos(turn), cosine=size * math.sin(turn))
    highest = (
        4.0 * (max(coulomb, static) + axis.base + 1.5 * axis.per_payload + abs(axis.sine)) + viscous * speed
    )
    return Machine(
        kind=kind,
        grade=grade,
        axis=axis,
        drive=_drive(rng, axis, speed, highest),
        speed=speed,
        constant=2.67 if grade == "dynamixel" else coulomb * between(rng, 3.0, 12.0),
        logs_current=grade == "dynamixel" or rng.random() < 0.6,
        rate=_rate(rng, grade, least_rate),
        reading_noise=_noise(rng, grade, coulomb),
        drive_noise=coulomb * between(rng, 0.003, 0.015),
        soft=bool(rng.random() < 0.5),
        jitter=float(rng.choice((0.0, 0.02, 0.08))),
    )


def _drive(rng: np.random.Generator, axis: Axis, speed: float, limit: float) -> Drive:
    bandwidth = between(rng, 30.0, 120.0)
    gain = axis.inertia * bandwidth + axis.viscous
    position = between(rng, 5.0, 25.0) if rng.random() < 0.7 else 0.0
    return Drive(
        position, gain, gain * bandwidth / 5.0, 1.0 if rng.random() < 0.7 or position == 0 else 0.0, limit
    )


def _rate(rng: np.random.Generator, grade: str, least: int) -> int:
    weights = {50: 1, 100: 3, 200: 4, 250: 3, 500: 2, 1000: 1}
    if grade == "dynamixel":
        weights |= {500: 0, 1000: 0}
    rates = [r for r in RATES if r >= least and weights[r]]
    chances = np.array([weights[r] for r in rates], float)
    return int(rng.choice(rates, p=chances / chances.sum()))


def _noise(rng: np.random.Generator, grade: str, coulomb: float) -> float:
    if grade == "dynamixel":
        return 2.67 * CURRENT_STEP * rng.uniform(0.5, 1.0)
    return coulomb * (between(rng, 0.008, 0.03) if grade == "lab" else between(rng, 0.005, 0.02))
