"""The force-free controller of a parameter file as C99, for a microcontroller.

    export_c(Parameters.read("params.toml"), Path("board"), source="params.toml")

The templates in `c/` are the modules of `idtool.control`, function by function; what is computed is
computed here, and every constant comes from the Python controller itself, so that the two do not part.
Each effect brings its own C (`Effect.in_c`).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from idtool import __version__
from idtool.atomic import atomic_write, cannot_write, refuse_existing
from idtool.control import guard, law, load, paper, sensing
from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Limits, Reason
from idtool.control.paper import PaperLaw
from idtool.effects import registry
from idtool.errors import InputError, UsageError, nearest, sentence
from idtool.export.c_literals import EffectInC, c_float
from idtool.model.contribution import FIELDS
from idtool.model.stribeck import EXPONENT
from idtool.parameters import Parameters
from idtool.units import SUFFIXES, unit_text

#: Changes of the friction level; a board remembers those that an effect makes.
_LEVEL_FIELDS = ("level_change", "level_torque", "static_change", "exponent_change")
#: A clock that jitters may bring samples so much faster than the period, and a delay is still spanned.
_FASTEST = 0.5
#: As many samples as the Python controller's own delay line holds.
_LONGEST_LINE = 64
#: Parts of an octave and of a turn in the tables of the exponential and the sine.
_PARTS = 256
#: What the C can find wrong; a lost payload and too much torque only the light mode and a limit look for.
_REASONS = {
    Reason.NOT_FINITE: "position, velocity or current is NaN or infinite",
    Reason.STALE: "the same sample again",
    Reason.TIME_JUMP: "time ran backwards, or too far",
    Reason.POSITION_JUMP: "the position jumped farther than the axis can move",
    Reason.VELOCITY: "faster than possible",
    Reason.CURRENT: "more current than possible",
    Reason.OUT_OF_RANGE: "the position is outside the range",
    Reason.SURROUNDINGS: "payload, tilt or temperature is impossible",
}
_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_SKETCH = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,62}")


@dataclass(frozen=True)
class ExportedC:
    """What was written.

    Attributes:
        files: header, source and sketch.
        effects: those that the C carries.
        notes: what it leaves out or the user must know, each a sentence without a full stop.
    """

    files: tuple[Path, ...]
    effects: tuple[str, ...]
    notes: tuple[str, ...]


def export_c(
    parameters: Parameters,
    folder: Path,
    *,
    name: str = "ffc",
    without: Sequence[str] = (),
    period_s: float | None = None,
    limits: Limits | None = None,
    source: str = "",
    force: bool = False,
) -> ExportedC:
    """Write NAME.h, NAME.c and an Arduino sketch into `folder`, all or none.

    Args:
        parameters: what `ForceFreeController` takes.
        folder: made if it is missing.
        name: what every symbol and file begins with: lower case letters, digits, underscores.
        without: effects of the file to leave out.
        period_s, limits: as of `ForceFreeController`.
        source: the parameter file, for the comment at the top.
        force: overwrite what is there.

    Raises:
        UsageError: a name that is no C identifier, or an effect to leave out that the file does not hold.
        InputError: an effect that has no C form, a number that single precision cannot hold, a file that
            exists or cannot be written.
    """
    texts, carried, notes = generate_c(
        parameters, folder, name=name, without=without, period_s=period_s, limits=limits, source=source
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    paths = {folder / file: text for file, text in texts.items()}
    for path in paths:
        refuse_existing(path, force)
    with ExitStack() as together:
        for path, text in paths.items():
            stream = together.enter_context(atomic_write(path))
            stream.write(text)
            stream.flush()  # a full disk shows before the first file is put in its place
    return ExportedC(tuple(paths), carried, notes)


def generate_c(
    parameters: Parameters,
    folder: Path,
    *,
    name: str = "ffc",
    without: Sequence[str] = (),
    period_s: float | None = None,
    limits: Limits | None = None,
    source: str = "",
) -> tuple[dict[str, str], tuple[str, ...], tuple[str, ...]]:
    """As `export_c`, without writing: the text of each file, the effects carried, and the notes."""
    import jinja2

    if not _NAME.fullmatch(name):
        raise UsageError(f"{name!r} cannot begin C symbols: use a-z, 0-9 and _, a letter first, up to 31.")
    kept = _without(parameters, without)
    controller = ForceFreeController(kept, period_s, limits=limits)
    effects = _effects(kept, controller)
    sketch, remark = _sketch_name(folder, name)
    notes = (
        *controller.model.skipped,
        *(f"{effect} is left out as asked" for effect in without),
        *((remark,) if remark else ()),
    )
    context = _context(kept, controller, effects) | {
        "name": name,
        "p": name,
        "P": name.upper(),
        "version": __version__,
        "source": _comment(source),
        "notes": [_comment(note) for note in notes],
    }
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("idtool.export", "c"),
        autoescape=False,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    templates = {
        f"{name}.h": "controller.h.jinja",
        f"{name}.c": "controller.c.jinja",
        sketch: "sketch.ino.jinja",
    }
    texts = {file: environment.get_template(template).render(context) for file, template in templates.items()}
    return texts, tuple(effect.name for effect in effects), notes


def _without(parameters: Parameters, names: Sequence[str]) -> Parameters:
    held = [entry.name for entry in parameters.effects]
    for name in names:
        if name not in held:
            known = nearest(name, held) if held else "it holds none"
            raise UsageError(sentence(f"--without {name}: the parameter file holds no such effect", known))
    return replace(parameters, effects=tuple(e for e in parameters.effects if e.name not in names))


def _effects(parameters: Parameters, controller: ForceFreeController) -> list[EffectInC]:
    """The effects that the controller compensates, in C."""
    result = []
    for entry in parameters.effects:
        if not controller.model.uses(entry.name):
            continue
        effect = registry.get(entry.name)
        form = effect.in_c(effect.to_values(entry.values()))
        if form is None:
            raise InputError(
                f"effect {entry.name} has no C form",
                remedy=f"leave it out with --without {entry.name}",
            )
        result.append(EffectInC.build(effect, form))
    return result


def _context(parameters: Parameters, c: ForceFreeController, effects: list[EffectInC]) -> dict[str, Any]:
    """What the templates read."""
    kind = parameters.axis.kind
    used = frozenset().union(*(effect.adds for effect in effects))
    reach = max((effect.form.looks_back_s for effect in effects), default=0.0)
    length = min(math.ceil(reach / (_FASTEST * c.period)) + 2, _LONGEST_LINE) if reach else 0
    window = max(2, round(sensing._REST_WINDOW_S / c.period) + 1)
    friction = "LuGre friction" if parameters.dynamic else "Stribeck friction"
    return {
        "effects": effects,
        "fields": FIELDS,
        "used": used,
        "level_fields": [field for field in _LEVEL_FIELDS if field in used],
        "follows_temperature": any(effect.form.follows_temperature for effect in effects),
        "follows_time": any(effect.follows_time for effect in effects),
        "delay_length": length,
        "window": window,
        "period_us": _microseconds(c.period),
        "settle_ms": round(1e3 * _law(c)._settle),
        "arm": parameters.gravity_model == "arm",
        "has_range": math.isfinite(c.limits.position_min) or math.isfinite(c.limits.position_max),
        "has_command_step": c.limits.command_step is not None,
        "kind": kind,
        "unit": {dimension: unit_text(dimension, kind) for dimension in SUFFIXES},
        "gravity_words": f"gravity of {'an arm' if parameters.gravity_model == 'arm' else 'a slide'}",
        "friction_words": friction + ("" if not effects else ", and the effects"),
        "reasons": [(reason.name, words) for reason, words in _REASONS.items()],
        **_tables(),
        "constants": _constants(parameters, c, window, length, used),
    }


def _tables() -> dict[str, Any]:
    """What `decay` and `sine_and_cosine` need: their tables, arguments in 1/2^24 of an octave and
    of a turn, and how far a chord of the exponential falls."""
    return {
        "powers": [f"{round(2.0 ** (31 - k / _PARTS))}UL" for k in range(_PARTS)],
        "octaves": c_float(2.0**24 / math.log(2.0), "octaves"),
        "chord": round((1.0 - 2.0 ** (-1 / _PARTS)) * 2.0**23),
        "sines": [f"{round(2.0**30 * math.sin(2.0 * math.pi * k / _PARTS))}L" for k in range(_PARTS)],
        "turns_per_rad": c_float(2.0**24 / (2.0 * math.pi), "turns"),
    }


def _constants(
    parameters: Parameters, c: ForceFreeController, window: int, line: int, used: frozenset[str]
) -> list[tuple[str, dict[str, str]]]:
    """Every number of the C but those of the effects, as literals, in groups."""
    kind = parameters.axis.kind
    model, limits, its = c.model, c.limits, _law(c)

    def group(title: str, **numbers: float) -> tuple[str, dict[str, str]]:
        return title, {key: c_float(value, key.lower()) for key, value in numbers.items()}

    def unit(dimension: str) -> str:
        return unit_text(dimension, kind)

    gravity = {f"GRAVITY_{name.upper()}": p.value for name, p in parameters.gravity.items()}
    friction = {
        "COULOMB": model.coulomb,
        "STATIC": model.static,
        "STRIBECK_VELOCITY": model.stribeck_velocity,
        "VISCOUS": model.viscous,
        "BRISTLE_STIFFNESS": model.bristle_stiffness,
        "BRISTLE_DAMPING": model.bristle_damping,
        "LEVEL_FLOOR": load._LEVEL_FLOOR * min(model.coulomb, model.static) + 1e-12,
        "FRICTION_BOUND": model.friction_bound,
    }
    if "exponent_change" in used:
        friction["EXPONENT"] = EXPONENT
    groups = [
        group(f"motor, {unit('torque_constant')}", TORQUE_CONSTANT=model.torque_constant),
        group(f"gravity, {unit('torque')}", **gravity),
        group(f"friction, {unit('torque')} and {unit('velocity')}", **friction),
        group(
            "period, s, and smallest step of the position sensor", PERIOD=c.period, RESOLUTION=c.resolution
        ),
        group(
            f"limits, {unit('position')}, {unit('velocity')} and A",
            POSITION_MIN=limits.position_min,
            POSITION_MAX=limits.position_max,
            MARGIN=limits.margin,
            SPEED=limits.speed,
            MEASURED_SPEED=limits.measured_speed,
            CURRENT=limits.current,
            FARTHEST=guard._FARTHEST,
            **({} if limits.command_step is None else {"COMMAND_STEP": limits.command_step}),
        ),
        group(
            "law: gains, s and speed per torque; times, s",
            COMMAND_GAIN=c.command_gain,
            LOOP_GAIN=c.loop_gain,
            START_TORQUE=c.start_torque,
            REST_SPEED=law.REST_COUNTS_PER_S * c.resolution,
            SERVO_TIME=its._servo_time,
            FILTER_TIME=its._sense._filter_time,
            RELEASE=paper.RELEASE_S,
            FALL_NOISE=paper._FALL_NOISE,
            STOP_SHARE=paper._STOP_SHARE,
            TRIM_RATE=paper._TRIM_RATE,
            TRIM_RANGE=paper._TRIM_RANGE,
            UNSEEN_TORQUE=sensing._BRISTLE_COUNTS * c.resolution * model.bristle_stiffness,
        ),
    ]
    counts = {
        "STALE_SAMPLES": f"{min(limits.stale_samples, 0xFFFF)}u",
        "START_SAMPLES": f"{paper._START_SAMPLES}u",
        "REST_WINDOW": f"{window}u",
        "GAP_US": f"{_microseconds(limits.gap_periods * c.period)}UL",
        "SETTLE_US": f"{_microseconds(its._settle)}UL",
        "BRAKE_US": f"{_microseconds(paper._BRAKE_S)}L",
    }
    if line:
        counts["DELAY_LENGTH"] = f"{line}u"
    return [*groups, ("samples and microseconds", counts)]


def _law(controller: ForceFreeController) -> PaperLaw:
    """The law, if it is the one that the templates hold."""
    law = controller.law
    if not isinstance(law, PaperLaw):
        raise InputError(
            "the C holds the paper's control law only", place="controller.mode", remedy='set mode = "paper"'
        )
    return law


def _microseconds(seconds: float) -> int:
    """Whole microseconds, as far as a signed 32-bit clock goes."""
    return round(min(1e6 * seconds, 2.0**31 - 1))


def _comment(text: str) -> str:
    """Text that cannot end a comment, nor its line."""
    return " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")


def _sketch_name(folder: Path, name: str) -> tuple[str, str]:
    """An Arduino sketch has the name of its folder; and what to say where that cannot be."""
    own = folder.resolve().name
    if _SKETCH.fullmatch(own):
        return f"{own}.ino", ""
    return f"{name}.ino", f"the Arduino IDE wants the sketch in a folder named {name}: move the three files"
