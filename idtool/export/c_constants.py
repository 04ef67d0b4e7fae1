"""Every number of the exported C but those of the effects, read from the Python controller itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from idtool.control import button, enabling, guard, law, paper, rest_load, sensing
from idtool.control.admittance import AdmittanceLaw, motion, record, rest, tare
from idtool.control.admittance.constants import SAMPLES_PER_SUM
from idtool.control.force_free import ForceFreeController
from idtool.control.paper import PaperLaw
from idtool.errors import InputError
from idtool.export.c_literals import c_float
from idtool.model.stribeck import EXPONENT, least_level
from idtool.model.units import unit_text
from idtool.parameters import Parameters

Groups = list[tuple[str, dict[str, str]]]

#: Parts of an octave and of a turn in the tables of the exponential and the sine.
_PARTS = 256
#: The most that the C's counters of periods hold.
_MOST_PERIODS = 0xFFFF


def tables() -> dict[str, Any]:
    """What the C's own functions need: their tables, arguments in 1/2^24 of an octave and of a turn, and how
    far a chord of the exponential falls."""
    seeds = [round(2.0**16 / (1.0 + (k + 0.5) / _PARTS)) for k in range(_PARTS)]
    return {
        "powers": [f"{min(round(2.0 ** (32 - k / _PARTS)), 0xFFFFFFFF)}UL" for k in range(_PARTS)],
        "octaves": c_float(2.0**24 / math.log(2.0), "octaves"),
        "chord": round((1.0 - 2.0 ** (-1 / _PARTS)) * 2.0**24),
        "inverses": [f"{seed}u" for seed in seeds],
        "logarithms": [f"{round(2.0**24 * (16.0 - math.log2(seed)))}UL" for seed in seeds],
        # 2 / ln 2 less the 2 that a shift gives
        "beyond_two": round(2.0**16 * (2.0 / math.log(2.0) - 2.0)),
        "sines": [f"{round(2.0**30 * math.sin(2.0 * math.pi * k / _PARTS))}L" for k in range(_PARTS)],
        "turns_per_rad": c_float(2.0**24 / (2.0 * math.pi), "turns"),
    }


def microseconds(seconds: float) -> int:
    """Whole microseconds, as far as a signed 32-bit clock goes."""
    return round(min(1e6 * seconds, 2.0**31 - 1))


def settle_s(controller: ForceFreeController) -> float:
    """How long the controller listens before it follows a hand, s."""
    its = controller.law
    assert isinstance(its, PaperLaw | AdmittanceLaw)
    return its.settings.settle


def periods(period: float, holds: Callable[[float], bool]) -> int:
    """After so many periods, added up one by one as the controller does, `holds` of the time is true.

    Raises:
        InputError: more than a counter of the C holds.
    """
    time = 0.0
    for count in range(1, _MOST_PERIODS):
        time += period
        if holds(time):
            return count
    raise _too_short(period)


def _too_short(period: float) -> InputError:
    return InputError(
        f"the C cannot count its times in periods of {period:g} s",
        place="controller.period_s",
        remedy="take a longer one",
    )


def constants(
    parameters: Parameters, c: ForceFreeController, window: int, line: int, used: frozenset[str]
) -> Groups:
    """Literals by name, in groups with a title.

    Args:
        parameters: the file.
        c: the controller of the file.
        window: samples in which the paper's law looks for rest.
        line: samples that the delay line holds, 0 if there is none.
        used: fields of the contribution that effects add to.
    """
    groups = _axis(parameters, c, used)
    counts = {
        "STALE_SAMPLES": f"{min(c.limits.stale_samples, 0xFFFF)}u",
        "GAP_US": f"{microseconds(c.limits.gap_periods * c.period)}UL",
    }
    if line:
        counts["DELAY_LENGTH"] = f"{line}u"
    groups.append(("samples and microseconds", counts))
    groups += _enabling(c)
    if isinstance(c.law, AdmittanceLaw):
        return groups + _light(c, c.law)
    assert isinstance(c.law, PaperLaw)
    return groups + _paper(c, c.law, window)


def _group(title: str, **numbers: float) -> tuple[str, dict[str, str]]:
    return title, {key: c_float(value, key.lower()) for key, value in numbers.items()}


def _axis(parameters: Parameters, c: ForceFreeController, used: frozenset[str]) -> Groups:
    """What both laws need of the axis and its limits."""
    kind = parameters.axis.kind
    model, limits = c.model, c.limits

    def unit(dimension: str) -> str:
        return unit_text(dimension, kind)

    gravity = {f"GRAVITY_{name.upper()}": p.value for name, p in parameters.gravity.items()}
    if parameters.weightless:
        gravity = {"GRAVITY_BASE": 0.0, "GRAVITY_PER_PAYLOAD": 0.0}
    friction = {
        "COULOMB": model.coulomb,
        "STATIC": model.static,
        "VISCOUS": model.viscous,
        "BRISTLE_STIFFNESS": model.bristle_stiffness,
        "BRISTLE_DAMPING": model.bristle_damping,
        "LEVEL_FLOOR": least_level(model.coulomb, model.static),
        "FRICTION_BOUND": model.friction_bound,
        "GRIP": model.grip,
    }
    share, reach = model.held
    if share > 0.0:
        friction |= {"HELD_SHARE": share, "PER_HELD_REACH": 1.0 / reach}
    # where the exponent is the square, its parts are that of the speed in these units
    parts = 1.0 if "exponent_change" in used else math.sqrt(2.0**24 / math.log(2.0))
    friction["PER_SPEED"] = parts / model.stribeck_velocity
    if "exponent_change" in used:
        friction["EXPONENT"] = EXPONENT
    bounds = {
        "POSITION_MIN": limits.position_min,
        "POSITION_MAX": limits.position_max,
        "MARGIN": limits.margin,
        "SPEED": limits.speed,
        "MEASURED_SPEED": limits.measured_speed,
        "CURRENT": limits.current,
        "FARTHEST": guard._FARTHEST,
    }
    if limits.command_step is not None:
        bounds["COMMAND_STEP"] = limits.command_step
    if math.isfinite(limits.torque):
        bounds["TORQUE"] = limits.torque
    return [
        _group(f"motor, {unit('torque_constant')}", TORQUE_CONSTANT=model.torque_constant),
        _group(f"gravity, {unit('torque')}", **gravity),
        _group(f"friction, {unit('torque')} and {unit('velocity')}", **friction),
        _group(
            "period, s, and smallest step of the position sensor", PERIOD=c.period, RESOLUTION=c.resolution
        ),
        _group(f"limits, {unit('position')}, {unit('velocity')}, {unit('torque')} and A", **bounds),
    ]


def _enabling(c: ForceFreeController) -> Groups:
    """The button and the load at rest."""
    uncertainty = c.rest_uncertainty
    numbers = {
        "ARREST_KICK": button.KICK_SHARE * c.servo_time,
        "ARREST_COAST": button.COAST_S,
        "LEAST_CHANGE": rest_load.CHANGE_NOISES * uncertainty.noise,
        "LEAST_VARIANCE": rest_load.STEP_VARIANCE * uncertainty.noise**2,
        "QUIET": rest_load.QUIET,
        "ALIKE": rest_load.ALIKE,
        "LOUD": rest_load.LOUD,
        "LIFT": c.period / enabling.LIFT_S,
        "LIFT_SPEED": enabling.LIFT_SPEED[c.model.axis.kind],
    }
    if c.limits.mismatch is not None and math.isfinite(c.limits.mismatch):
        numbers["MISMATCH"] = c.limits.mismatch
    elif c.limits.mismatch is None:
        error = uncertainty.of(0.0)
        numbers["LOAD_ERROR"] = error**2 if uncertainty.per_payload > 0.0 else rest_load.SIGMAS * error
        numbers["MOST_LOAD_ERROR"] = uncertainty.most**2
        numbers["PER_PAYLOAD_ERROR"] = uncertainty.per_payload
        numbers["SIGMAS"] = rest_load.SIGMAS
    limits = c.limits
    if math.isfinite(limits.guided_speed):
        numbers["GUIDED_SPEED"] = limits.guided_speed
    if math.isfinite(limits.energy):
        numbers["ENERGY"] = limits.energy
    counts = {
        "ARREST": periods(c.period, lambda t: t >= button.BRAKE_S),
        "ARREST_KICK_END": periods(c.period, lambda t: t >= button.KICK_S),
        "LOAD_WINDOW": c.rest_window,
        "STEADY_WINDOWS": rest_load.STEADY_WINDOWS,
        "PATIENCE": enabling.PATIENCE,
    }
    if math.isfinite(limits.idle_s):
        counts["IDLE"] = periods(c.period, lambda t: t > limits.idle_s)
    looks = {"DOUBT": enabling.DOUBT_S, "LOOK": enabling.LOOK_S}
    signed = {name: str(max(1, round(time / c.period))) for name, time in looks.items()}
    return [
        _group("button and load at rest", **numbers),
        ("button and load at rest: samples", {n: f"{count}u" for n, count in counts.items()} | signed),
    ]


def _paper(c: ForceFreeController, its: PaperLaw, window: int) -> Groups:
    numbers = _group(
        "law: gains, s and speed per torque; times, s",
        COMMAND_GAIN=c.command_gain,
        LOOP_GAIN=c.loop_gain,
        START_TORQUE=c.start_torque,
        REST_SPEED=law.REST_COUNTS_PER_S * c.resolution,
        SERVO_TIME=its.settings.servo_time,
        FILTER_TIME=its.settings.filter_time,
        RELEASE=paper.RELEASE_S,
        FALL_NOISE=paper._FALL_NOISE,
        STOP_SHARE=paper._STOP_SHARE,
        TRIM_RATE=paper._TRIM_RATE,
        TRIM_RANGE=paper._TRIM_RANGE,
        UNSEEN_TORQUE=sensing._BRISTLE_COUNTS * c.resolution * c.model.bristle_stiffness,
    )
    counts = {
        "START_SAMPLES": f"{paper._START_SAMPLES}u",
        "REST_WINDOW": f"{window}u",
        "SETTLE_US": f"{microseconds(its.settings.settle)}UL",
        "BRAKE_US": f"{microseconds(paper._BRAKE_S)}L",
    }
    return [numbers, ("law: samples and microseconds", counts)]


def _light(c: ForceFreeController, its: AdmittanceLaw) -> Groups:
    k = its.constants

    def read(*names: str, **others: str) -> dict[str, float]:
        return {
            name.upper(): float(k[key]) for name, key in (*zip(names, names, strict=True), *others.items())
        }

    torques = read(
        *("gain", "noise", "floor", "coverage", "left", "seems", "jump", "start_torque"),
        *("zero_samples", "bias_most", "zero_most"),
    )
    torques["COMES"], torques["STEADY"] = rest.COMES, rest.STEADY
    torques["STOP_VARIANCE"] = float(k["stop_torque"]) ** 2 + float(k["stop_noise"]) ** 2
    shares = read(
        *(
            "virtual",
            "follows",
            "velocity_gain",
            "hand_filter",
            *(("reports",) if k["reports"] < 1.0 else ()),
        ),
        ZERO_SHARE="zero_time",
        USUAL_SHARE="usual_time",
        LEAST_SHARE="least_time",
        BIAS_SHARE="bias_time",
    )
    numbers = [
        _group("law: gains, and torques of the hand", **torques),
        _group("law: shares per period", **shares),
        _group(
            "law: motion",
            **read("rest_speed", "grain", "servo_time"),
            TRIM=2.0 * float(k["trim_rate"]) * c.period,  # at every other sample
            **read("trim_range", "tracking_time"),
            TRACKING_LEAST=4.0 * c.resolution,
            **read("coast"),
        ),
        _group(
            "law: standard deviations before anything is learned",
            **{
                f"{name}_PRIOR": float(value)
                for name, value in zip(("LOAD", "LEVEL", "DAMPING", "BRISTLE"), k["prior"], strict=True)
            },
        ),
        _group(
            "law: tare",
            **read("tare_middle", "tare_top", "tare_apart"),
            TARE_VARIANCE=float(k["tare_noise"]) ** 2 / SAMPLES_PER_SUM,
            TARE_LATE=float(k["tare_late"]) / math.sqrt(SAMPLES_PER_SUM),
            TARE_TURNS=float(k["tare_turns"]) / math.sqrt(SAMPLES_PER_SUM),
            TARE_LEFT=float(k["tare_left"]) ** 2,
            **(read("refuse") if math.isfinite(k["refuse"]) else {}),
        ),
    ]
    cycle = round(float(k["tare_cycle"]))
    counts = {
        "START_SAMPLES": rest.START_SAMPLES,
        "LEAVE_SAMPLES": motion.LEAVE_SAMPLES,
        "STRAYS": rest.STRAYS,
        "SETTLE": _counted(k["settle_periods"], c.period),
        "STILL": _counted(k["still_periods"], c.period),
        "STEADY_PERIODS": _counted(k["steady_periods"], c.period),
        "BRAKE": _counted(k["brake_periods"], c.period),
        "TARE_TURN": round(2**32 / cycle),  # in 1/2^32 of a turn per sample
        "TARE_PART": round(float(k["tare_part"])),
        "TARE_PARTS": record.PARTS,
        "TARE_CYCLE": cycle,
        "TARE_END": _counted(tare.CYCLES * cycle, c.period),
        "SOLVE_SAMPLES": tare.SOLVE_SAMPLES,
    }
    return [*numbers, ("law: periods", {name: f"{count}u" for name, count in counts.items()})]


def _counted(number: float, period: float) -> int:
    """A number of periods that a counter of the C holds.

    Raises:
        InputError: it is more.
    """
    if number < _MOST_PERIODS:
        return round(float(number))
    raise _too_short(period)
