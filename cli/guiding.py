"""What commands of hand guiding share: payload, limits, file of which axis, start from a stop."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from idtool.errors import InputError, UsageError

from .common import PATH, Output, defaulted
from .moving import Moving, moving_options, result_on
from .numbers import POSITIVE, NumberRange, Tilt

if TYPE_CHECKING:
    from idtool.control import Limits
    from idtool.guiding.jog import Jogged
    from idtool.guiding.playback import Played
    from idtool.guiding.player import Watching
    from idtool.parameters import Parameters
    from idtool.rig.base import Rig, TrialSetup

    from .screen import Screen

#: What a simulated axis carries unless told otherwise, kg: the paper's camera.
SIMULATED_PAYLOAD_KG = 0.4
#: What pulls so many times as hard as the drive does is in another unit.
_BEYOND = 10.0
#: Beyond this factor between the torque constants of file and rig the file is of another axis; beyond the
#: share it is worth a word.
_OTHER_AXIS, _WORTH_A_WORD = 1.5, 0.05
#: So far inside its limit an axis is brought that lies beyond it, share of the range; at most, rad (m).
_INSIDE, _INSIDE_MOST = 0.05, 0.1

_MEASURED = {"current": "the motor's current", "voltage": "the voltage at the motor"}

#: A force at the moving part that is a contact, N: beyond the 5 N that the paper's hand needs.
CONTACT_N = 10.0
#: Where the file does not say how the part moves: so many friction levels are a contact.
_CONTACT_LEVELS = 4.0

#: Most energy that a guided axis may give to a hand that it has not from it, J.
ENERGY_J = 0.05


@dataclass(frozen=True)
class Guiding(Moving):
    """What a command is told that moves the axis where a person wants it.

    Attributes:
        payload: what the axis carries, kg; None where it was not told.
        tilt: how the axis stands, rad.
        move_inside: an axis at its stop may move inside.
        log: where the run is written; None for nowhere.
    """

    payload: float | None
    tilt: tuple[float, float] | None
    move_inside: bool
    log: Path | None

    @property
    def tilted(self) -> tuple[float, float]:
        """Tilt of the axis, rad."""
        return self.told_tilt(self.tilt) or (0.0, 0.0)

    def told_payload(self, parameters: Parameters, axis: Rig) -> float:
        """The payload, kg: as given, asked for on a terminal, and assumed on a simulated axis only.

        Raises:
            UsageError: a real axis, no option, and nobody to ask; or more than such a drive ever holds.
        """
        if self.payload is not None:
            _refuse_beyond_the_drive(self.payload, parameters, axis)
            return self.payload
        if parameters.gravity_model == "arm":
            return 0.0  # its file knows no payload
        if axis.simulated:
            return SIMULATED_PAYLOAD_KG
        if not sys.stdin.isatty():
            raise UsageError(
                "--payload: a real axis is not guided with a payload that nobody told; pass what it carries,"
                " kg (0 for nothing)."
            )
        return click.prompt("what does the axis carry, kg", type=NumberRange(0.0), err=True)

    def inside(self, axis: Rig) -> float | None:
        """Where to bring an axis first that lies at its stop; None where it may stay.

        Raises:
            UsageError: it lies outside, and nobody allowed it to move.
        """
        here = axis.where()
        low, high = axis.limits.position
        if here is None or low <= here <= high:
            return None
        way = min(_INSIDE * (high - low), _INSIDE_MOST)
        goal = low + way if here < low else high - way
        where = f"the axis lies at {here:.3g}, outside its limits {low:.3g} to {high:.3g}"
        if not self.move_inside:
            if not sys.stdin.isatty():
                raise UsageError(f"{where}: pass --move-inside to let it move slowly to {goal:.3g} first.")
            if not click.confirm(f"{where}. Move it slowly to {goal:.3g}?", err=True):
                raise UsageError(f"{where}: move it inside by hand.")
        self.output.say(f"moving slowly to {goal:.3g}")
        return goal


@dataclass(frozen=True)
class Watched(Guiding):
    """What `play` and `jog` are told: they feel what the axis meets.

    Attributes:
        params: parameter file; None where the axis is moved without its model.
        contact: force at the moving part that is a contact, N; None where it was not told.
    """

    params: Path | None
    contact: float | None

    def watching(self, *read: Path | None) -> Watching:
        """How the axis is watched; `read`: files that the log must not overwrite.

        Raises:
            InputError: the parameter file is wrong or incomplete, or the log is there already.
            UsageError: see `contact_limit`.
        """
        from idtool.control.online import check_complete
        from idtool.guiding.player import Watching
        from idtool.io.atomic import refuse_existing
        from idtool.parameters import Parameters

        parameters = Parameters.read(self.params) if self.params is not None else None
        if parameters is not None:
            check_complete(parameters, self.params)
        limit = contact_limit(parameters, self.contact)
        if self.log is not None:
            refuse_existing(self.log, self.force, self.params, *read)
        return Watching(parameters=parameters, contact=limit, log=self.log, force=self.force)

    def load(self, parameters: Parameters | None, axis: Rig) -> float:
        """What the axis carries, kg, once its file is seen to be its own; without a file as told, or nothing.

        Raises:
            InputError, UsageError: see `check_axis` and `told_payload`.
        """
        if parameters is None or self.params is None:
            return self.payload or 0.0
        check_axis(parameters, self.params, axis, self.output)
        return self.told_payload(parameters, axis)


_GUIDING = (
    click.option(
        "--payload",
        metavar="KG",
        type=NumberRange(0.0),
        help="What the axis carries [simulated: 0.4; a real axis: asked for].",
    ),
    click.option("--tilt", nargs=2, type=Tilt(), metavar="ALPHA BETA", help="Tilt of the axis, rad [none]."),
    click.option(
        "--move-inside", is_flag=True, help="Let an axis that lies at its stop move inside, slowly."
    ),
    click.option("-o", "--output", "log", type=PATH, help="Write the run as a log."),
)
guiding_options = moving_options(Guiding, *_GUIDING)
watched_options = moving_options(
    Watched,
    click.option(
        "-p", "--params", type=PATH, help="Parameter file: feel a contact by its model, and count in mm."
    ),
    click.option(
        "--contact",
        metavar="N",
        type=POSITIVE,
        help="Stop at this force at the moving part [10 N; needs -p].",
    ),
    *_GUIDING,
)

period_option = click.option(
    "--period",
    metavar="S",
    type=NumberRange(1e-4, 1.0),
    help="Control period (default: the file's, or 0.01).",
)
max_speed_option = defaulted(
    "--max-speed",
    default=250.0,
    metavar="MM_S",
    type=POSITIVE,
    help="Speed limit of the session, where the file says how far the axis moves per radian.",
)
idle_option = defaulted(
    "--idle",
    default=60.0,
    metavar="S",
    type=POSITIVE,
    help="Hold the axis after so long without a hand, until the button was up.",
)


def session_limits(parameters: Parameters, limits: Limits, max_speed_mm_s: float, idle_s: float) -> Limits:
    """These limits, and those of a session with a hand."""
    from idtool.guiding.hand import travel_per_position
    from idtool.guiding.session import with_session

    ratio = travel_per_position(parameters)
    speed = math.inf if ratio is None else 1e-3 * max_speed_mm_s / ratio
    return with_session(limits, guided_speed=speed, energy=ENERGY_J, idle_s=idle_s)


def _refuse_beyond_the_drive(payload: float, parameters: Parameters, axis: Rig) -> None:
    from idtool.model.units import unit_text

    slope, constant = parameters.gravity.get("per_payload"), axis.axis.torque_constant
    if slope is None or constant is None or parameters.axis.effort != "torque":
        return
    pull, most = abs(slope.value) * payload, axis.limits.current * constant
    if pull > _BEYOND * most:
        unit = unit_text("torque", axis.axis.kind)
        raise UsageError(
            f"--payload: {payload:g} kg would pull with {pull:.3g} {unit} by the file, and the drive gives "
            f"{most:.3g} {unit}; payloads are in kg."
        )


def check_axis(parameters: Parameters, file: Path, axis: Rig, output: Output) -> None:
    """Notice a parameter file of another axis; say what its session left unexplained.

    Raises:
        InputError: it is of another kind, or its torque constant is far from the rig's.
    """
    if parameters.unexplained:
        output.warn(f"{parameters.unexplained}.")
    ours, theirs = parameters.axis, axis.axis

    def other(problem: str, place: str, or_else: str = "") -> InputError:
        remedy = f"take the parameter file of this axis{or_else}"
        return InputError(problem, file=file, place=place, remedy=remedy)

    if ours.kind != theirs.kind:
        raise other(f"describes a {ours.kind} axis and the rig is {theirs.kind}", "axis.kind")
    if ours.per_reading is not None and ours.reading != axis.measures:
        needs, has = (_MEASURED[name] for name in (ours.reading, axis.measures))
        raise other(f"reads the torque from {needs} and the rig measures {has}", "[axis]")
    mine, its = ours.per_reading, theirs.per_reading
    if mine is None or its is None or ours.effort != theirs.effort:
        return
    apart = max(abs(mine / its), abs(its / mine)) if mine * its > 0.0 else float("inf")
    if apart > _OTHER_AXIS:
        problem = f"has the torque constant {mine:g} and the rig {its:g}"
        raise other(problem, f"axis.{ours.constant_key}", ", or tell the rig its constant (constant=)")
    if apart > 1.0 + _WORTH_A_WORD:
        output.warn(
            f"the torque constant of {file} is {mine:g} and that of the rig {its:g}; the file's is taken."
        )


def setup_of(payload: float, tilt: tuple[float, float], axis: Rig, start: float | None = None) -> TrialSetup:
    """How the axis stands before it is guided; a real one stays where it is unless `start` is given."""
    from idtool.rig.base import TrialSetup

    middle = 0.5 * sum(axis.limits.position) if axis.simulated else start
    return TrialSetup(
        payload_kg=payload, tilt_alpha_rad=tilt[0], tilt_beta_rad=tilt[1], start_position=middle
    )


def travel_of(parameters: Parameters | None, kind: str) -> float | None:
    """m of travel per position; None where nothing says it."""
    from idtool.guiding.hand import travel_per_position

    if kind == "linear":
        return 1.0
    return travel_per_position(parameters) if parameters is not None else None


def contact_limit(parameters: Parameters | None, force_n: float | None) -> float:
    """The torque that is a contact, N m (N).

    Raises:
        UsageError: a force was told, and there is no model to tell it by.
    """
    if parameters is None:
        if force_n is not None:
            raise UsageError(
                "--contact is a force that only the model of -p can tell; pass the parameter file."
            )
        return math.inf
    ratio = travel_of(parameters, parameters.axis.kind)
    if ratio is not None:
        return (force_n or CONTACT_N) * ratio
    level = max((parameters.static[name].value for name in ("coulomb", "static")), default=0.0)
    return force_n or _CONTACT_LEVELS * level


def tell_end(
    told: Watched,
    rig: str,
    axis: Rig,
    moved: Played | Jogged,
    document: dict[str, Any],
    show: Callable[[Screen], None],
) -> int:
    """What a motion came to, where and why it was stopped if it was, and what was written; the exit code."""
    from idtool.model.units import unit_text

    stop, kind, log = moved.stopped, axis.axis.kind, told.log

    def shown(screen: Screen) -> None:
        show(screen)
        if stop is not None:
            where = f"{stop.position:.4g} {unit_text('position', kind)}"
            felt = "" if stop.torque is None else f", {stop.torque:+.3g} {unit_text('torque', kind)} felt"
            word = "met something" if stop.why == "contact" else "stayed behind where it was wanted"
            screen.print(f"stopped: the axis {word} at {where}{felt}.")
        if log is not None:
            screen.print(f"written: {log}", folded=False)

    document |= {
        "stopped": None if stop is None else asdict(stop),
        "interrupted": moved.interrupted,
        "log": str(log) if log else None,
    }
    result_on(rig, axis.simulated, told.output, document, shown)
    return 130 if moved.interrupted else 4 if stop is not None else 0
