"""The force-free controller of a parameter file as C99, for a microcontroller.

    export_c(Parameters.read("params.toml"), Path("board"), source="params.toml")

The templates in `c/` are the modules of `idtool.control`, function by function. Every number comes from
the Python controller itself (`c_constants`), so that the two do not part, and each effect brings its own C
(`Effect.in_c`). Which function is which:

    guard.c      impossible, check, frozen        Guard._impossible, ._against_last, ._frozen
    load.c       friction_level, carry            load._level, load.carry
                 advance_bristle                  load._advance_bristle
    sensing.c    delayed                          DelayLine.delayed
                 remainder_torque                 Remainder.torque
    paper.c      listen, settle, feel, rest_friction, rests                       HandSense
                 begin, lead, brake, raw_command  PaperLaw.begin, ._lead, ._brake, .raw_command
    hand.c       watch_motion                     admittance.hand.watch; others by the same names
    rest.c       sure_bound                       a line of admittance.rest.rest; likewise
    motion.c     pushes_on                        lines of admittance.motion.guide; likewise
    tare.c       compare_part                     the middle of admittance.tare.sweep; likewise
    admittance.c forget_learned, raw_command      admittance.kernel.reset, .act
    enabling.c   arrest                           Hold.command
                 mean_left, variance_left         RestLoad._mean, ._variance
                 begin_window, listen_load        RestLoad._begin_window, .listen
                 forget_load, undo_load           RestLoad.forget, .undo
                 in_doubt                         EnabledLaw._in_doubt
                 judge_load, watch_load           RestLoad.judge, .watch
                 listen_here, begin_enabling, raw_command_enabled
                                                  EnabledLaw._listen, .begin, .raw_command
                 begin_session, check_session     SessionLimits.reset, .check
    path.h       NAME_path_at                     PathTable.at
                 NAME_path_step                   guiding.playback.play, ._approach
    force_free.c bounded, fail, NAME_reset, NAME_recover, NAME_step, NAME_ready, NAME_tare
                                                  ForceFreeController

Where the C differs in form: times are whole periods (`c_constants.periods` counts them as Python adds
them up); of the law's own place it keeps how far that is ahead of the measured one, which single
precision holds better; the bristle is kept as the torque that it holds.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from idtool.control import sensing
from idtool.control.admittance import AdmittanceLaw, record, tare
from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Limits, Reason
from idtool.effects import registry
from idtool.errors import InputError, UsageError, nearest, sentence
from idtool.export.c_constants import constants, microseconds, settle_s, tables
from idtool.export.c_literals import EffectInC
from idtool.export.c_path import in_c
from idtool.guiding.path import TaughtPath
from idtool.io.atomic import atomic_write, cannot_write, refuse_existing
from idtool.model.contribution import FIELDS
from idtool.model.units import SUFFIXES, Units, unit_text
from idtool.parameters import Parameters
from idtool.version import __version__

#: Changes of the friction level; a board remembers those that an effect makes.
_LEVEL_FIELDS = ("level_change", "level_torque", "static_change", "exponent_change")
#: A clock that jitters may bring samples so much faster than the period, and a delay is still spanned.
_FASTEST = 0.5
#: As many samples as the Python controller's own delay line holds.
_LONGEST_LINE = 64
#: What the C can find wrong.
_REASONS = {
    Reason.NOT_FINITE: "position, velocity or current is NaN or infinite",
    Reason.STALE: "the same sample again",
    Reason.TIME_JUMP: "time ran backwards, or too far",
    Reason.POSITION_JUMP: "the position jumped farther than the axis can move",
    Reason.VELOCITY: "faster than possible",
    Reason.CURRENT: "more current than possible",
    Reason.OUT_OF_RANGE: "the position is outside the range",
    Reason.SURROUNDINGS: "payload, tilt or temperature is impossible",
    Reason.TORQUE: "more torque on the axis than a hand may give",
    Reason.MISMATCH: "the axis carries at rest what neither model, friction nor uncertainties explain",
    Reason.SPEED_LIMIT: "guided faster than the session allows",
    Reason.ENERGY: "the axis gave energy to a hand that gave it none",
}
_GRAVITY_WORDS = {"arm": "gravity of an arm", "slide": "gravity of a slide", None: "no gravity"}
_NAME = re.compile(r"[a-z][a-z0-9_]{0,30}")
_SKETCH = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,62}")


@dataclass(frozen=True)
class ExportedC:
    """What was written.

    Attributes:
        files: header, source, the servo's packets, and sketch.
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
    path: TaughtPath | None = None,
    path_speed: float = 1.0,
    source: str = "",
    force: bool = False,
) -> ExportedC:
    """Write NAME.h, NAME.c, an Arduino sketch and its NAME_servo.h into `folder`, all or none.

    Where there is a path, NAME_path.h too.

    Args:
        parameters: what `ForceFreeController` takes.
        folder: made if it is missing.
        name: what every symbol and file begins with: lower case letters, digits, underscores.
        without: effects of the file to leave out.
        period_s, limits: as of `ForceFreeController`.
        path: a taught path that the board is to play, in its flash.
        path_speed: how fast, relative to how it was taught.
        source: the parameter file, for the comment at the top.
        force: overwrite what is there.

    Raises:
        UsageError: a name that is no C identifier, or an effect to leave out that the file does not hold.
        InputError: an effect that has no C form, a number that single precision cannot hold, a file that
            exists or cannot be written, a path without a range or too long for a board.
    """
    if not _NAME.fullmatch(name):
        raise UsageError(f"{name!r} cannot begin C symbols: use a-z, 0-9 and _, a letter first, up to 31.")
    if parameters.axis.reading == "voltage":
        raise InputError(
            "the parameter file reads the torque from a voltage, and the C controller from a current",
            place="[axis]",
            remedy="run the controller on a computer (ffc-id teach), or identify with a current",
        )
    kept = _without(parameters, without)
    controller = ForceFreeController(kept, period_s, limits=limits)
    effects = _effects(kept, controller)
    sketch, remark = _sketch_name(folder, name)
    kind = kept.axis.kind
    if path is not None and path.kind != kind:
        raise InputError(
            f"was taught on a {path.kind} axis and the file describes a {kind} one", place="--path"
        )
    words = unit_text("position", kind)
    played, size = in_c(path, controller.limits, words, path_speed) if path is not None else ({}, "")
    notes = (
        *((kept.unexplained,) if kept.unexplained else ()),
        *controller.model.skipped,
        *(f"{effect} is left out as asked" for effect in without),
        *((size,) if size else ()),
        *((remark,) if remark else ()),
    )
    context = _context(kept, controller, effects) | {
        "path": path is not None,
        **played,
        "name": name,
        "p": name,
        "P": name.upper(),
        "version": __version__,
        "source": _comment(source),
        "notes": [_comment(note) for note in notes],
    }
    templates = {
        f"{name}.h": "controller.h.jinja",
        f"{name}.c": "controller.c.jinja",
        f"{name}_servo.h": "servo.h.jinja",
        sketch: "sketch.ino.jinja",
    } | ({f"{name}_path.h": "path.h.jinja"} if path is not None else {})
    _write(folder, _rendered(templates, context), force)
    files = tuple(folder / file for file in templates)
    return ExportedC(files, tuple(effect.name for effect in effects), notes)


def _rendered(templates: dict[str, str], context: dict[str, Any]) -> dict[str, str]:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("idtool.export", "c"),
        autoescape=False,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return {file: environment.get_template(template).render(context) for file, template in templates.items()}


def _write(folder: Path, texts: dict[str, str], force: bool) -> None:
    """All files, or none."""
    if folder.exists() and not folder.is_dir():
        raise InputError("is a file where a folder should be", file=folder, remedy="name a folder")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    for file in texts:
        refuse_existing(folder / file, force)
    with ExitStack() as together:
        for file, text in texts.items():
            stream = together.enter_context(atomic_write(folder / file))
            stream.write(text)
            stream.flush()  # a full disk shows before the first file is put in its place


def _without(parameters: Parameters, names: Sequence[str]) -> Parameters:
    held = [entry.name for entry in parameters.effects]
    for name in names:
        if name not in held:
            known = nearest(name, held) if held else "it holds none"
            raise UsageError(sentence(f"--without {name}: the parameter file holds no such effect", known))
    return replace(parameters, effects=tuple(e for e in parameters.effects if e.name not in names))


def _effects(parameters: Parameters, controller: ForceFreeController) -> list[EffectInC]:
    """The effects that the controller compensates, in C."""
    first, others = list[EffectInC](), list[EffectInC]()
    for entry in parameters.effects:
        if not controller.model.uses(entry.name):
            continue
        effect = registry.get(entry.name)
        values = effect.from_file(entry.values(), parameters.axis.kind)
        form = effect.in_c(values)
        if form is None:
            raise InputError(
                f"effect {entry.name} has no C form", remedy=f"leave it out with --without {entry.name}"
            )
        # what holds a part of the friction comes first: see `idtool.control.load`
        (first if effect.holds(values)[0] > 0.0 else others).append(EffectInC.build(effect, form))
    return first + others


def _context(parameters: Parameters, c: ForceFreeController, effects: list[EffectInC]) -> dict[str, Any]:
    """What the templates read."""
    kind = parameters.axis.kind
    used = frozenset().union(*(effect.adds for effect in effects))
    light = isinstance(c.law, AdmittanceLaw)
    late = light and c.model.late > 0.0
    reach = 0.0 if late else max((effect.form.looks_back_s for effect in effects), default=0.0)
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
        "period_us": microseconds(c.period),
        "light": light,
        "holds": c.model.holding,
        "late": late,
        "limits_speed": math.isfinite(c.limits.guided_speed),
        "limits_energy": math.isfinite(c.limits.energy),
        "limits_idle": math.isfinite(c.limits.idle_s),
        "limits_session": min(c.limits.guided_speed, c.limits.energy, c.limits.idle_s) < math.inf,
        "watches_torque": math.isfinite(c.limits.torque),
        "watches_mismatch": c.limits.mismatch != math.inf,
        "mismatch_fixed": c.limits.mismatch is not None,
        "mismatch_of_payload": c.limits.mismatch is None and c.rest_uncertainty.per_payload > 0.0,
        "refuses_load": isinstance(c.law, AdmittanceLaw) and math.isfinite(c.law.settings.refuse),
        "follows_acceleration": any("row->acceleration" in effect.code for effect in effects),
        "settle_ms": round(1e3 * settle_s(c)),
        "arm": parameters.gravity_model == "arm",
        "has_range": math.isfinite(c.limits.position_min) or math.isfinite(c.limits.position_max),
        "has_command_step": c.limits.command_step is not None,
        "kind": kind,
        "unit": {dimension: unit_text(dimension, kind) for dimension in SUFFIXES},
        "gravity_words": _GRAVITY_WORDS[parameters.gravity_model],
        "friction_words": friction + ("" if not effects else ", and the effects"),
        "reasons": [(reason.name, words) for reason, words in _REASONS.items()],
        **_tare_words(c, kind),
        **tables(),
        "constants": constants(parameters, c, window, length, used),
    }


def _tare_words(c: ForceFreeController, kind: Units) -> dict[str, str]:
    """How long a tare takes, how far it moves and in how many parts, for the header."""
    if not isinstance(c.law, AdmittanceLaw):
        return {}
    time = (tare.CYCLES * float(c.law.constants["tare_cycle"]) + tare.SOLVE_SAMPLES) * c.period
    travel = f"{c.law.settings.tare_travel:g} {unit_text('position', kind)}"
    return {"tare_s": f"{time:.1f}", "tare_travel": travel, "tare_parts": str(record.PARTS)}


def _comment(text: str) -> str:
    """Text that cannot end a comment, nor its line."""
    return " ".join(text.split()).replace("*/", "* /").replace("/*", "/ *").replace("\\", "/")


def _sketch_name(folder: Path, name: str) -> tuple[str, str]:
    """An Arduino sketch has the name of its folder; and what to say where that cannot be."""
    own = folder.resolve().name
    if _SKETCH.fullmatch(own):
        return f"{own}.ino", ""
    return f"{name}.ino", f"the Arduino IDE wants the sketch in a folder named {name}: move the files"
