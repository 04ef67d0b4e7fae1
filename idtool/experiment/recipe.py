"""Recipes: experiments as TOML data.

A recipe names an experiment and lists trials; a list given for a number makes one trial of each value.
See the bundled ones (`ffc-id recipes show NAME`), which are meant to be copied and edited. Every key
carries its unit; on a linear axis (`axis = "linear"`) read m for rad.

    schema, name, experiment    needed; the experiment is what the log is marked as
    description, period_s       one line; time between rows of the log (0.005)
    [setup]                     for every trial: payload_kg, tilt_alpha_rad, tilt_beta_rad,
                                temperature_degc, rest_s
    [[trials]]                  kind, the keys of that kind, and any key of [setup]
      back_and_forth            speed_rad_s, travel_rad, repeats (1), acceleration_rad_s2 (2), dwell_s (0)
      sine                      frequency_hz, amplitude_rad_s, duration_s
      multisine                 frequencies_hz (a list), amplitude_rad_s, duration_s
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from idtool.errors import InputError, UnknownNameError, in_file, nearest
from idtool.experiment.trajectory import BackAndForth, Motion, Sines
from idtool.io.tables import check_schema, no_strangers, table_at
from idtool.io.toml import is_finite, load_toml, parse_toml, read_document, short
from idtool.model.units import Kind, file_key
from idtool.rig.base import TrialSetup

SCHEMA = "ffc-id/recipe/1"
#: Beyond these a recipe is a slip of the pen, not an experiment.
_MAX_TRIALS = 1000
_MAX_SECONDS = 4 * 3600.0
_MAX_SINES = 50
#: A sine of more than this share of the sampling frequency has fewer than ten rows per period.
SINE_SHARE = 0.1
#: Acceleration of ramps where a recipe does not say: slow against any servo, fast against any run.
_ACCELERATION = 2.0

_TOP = ("schema", "name", "experiment", "description", "axis", "period_s", "setup", "trials")
_SETUP = ("payload_kg", "tilt_alpha_rad", "tilt_beta_rad", "temperature_degc", "rest_s")
#: kind of motion -> its keys: (name, dimension, needed)
_KINDS: dict[str, tuple[tuple[str, str, bool], ...]] = {
    "back_and_forth": (
        ("speed", "velocity", True),
        ("travel", "position", True),
        ("repeats", "number", False),
        ("acceleration", "acceleration", False),
        ("dwell", "time", False),
    ),
    "sine": (
        ("frequency", "frequency", True),
        ("amplitude", "velocity", True),
        ("duration", "time", True),
    ),
    "multisine": (
        ("frequencies", "frequency", True),
        ("amplitude", "velocity", True),
        ("duration", "time", True),
    ),
}


@dataclass(frozen=True)
class Changes:
    """What is asked for in place of what a recipe says; None leaves it.

    Attributes:
        payloads: kg, one trial each.
        speeds: of the ways back and forth, rad/s (m/s), one trial each.
        travel: of the ways back and forth, rad (m).
        tilt: of every trial, alpha and beta, rad.
    """

    payloads: Sequence[float] | None = None
    speeds: Sequence[float] | None = None
    travel: float | None = None
    tilt: tuple[float, float] | None = None


@dataclass(frozen=True)
class RecipeTrial:
    """One trial.

    Attributes:
        setup: how the axis stands.
        motion: what it does.
        place: where it stands in the file, for messages.
        keys: names in the file of what sets the speed and the distance, for messages.
    """

    setup: TrialSetup
    motion: Motion
    place: str
    keys: tuple[str, str]


@dataclass(frozen=True)
class Recipe:
    """An experiment, expanded.

    Attributes:
        name: of the recipe.
        experiment: what its log is marked as: "gravity", "sweep", "sine" or any word.
        description: one line.
        kind: of the axis it is for.
        period_s: time between rows of the log; commands come at the rig's own period.
        trials: in order.
        source: file, for messages.
    """

    name: str
    experiment: str
    description: str
    kind: Kind
    period_s: float
    trials: tuple[RecipeTrial, ...]
    source: str

    @property
    def duration_s(self) -> float:
        """Time in motion."""
        return sum(trial.motion.duration_s for trial in self.trials)


def recipe_names() -> dict[str, str]:
    """Bundled recipes: name -> description."""
    return {name: parse_recipe(recipe_text(name), name).description for name in _bundled()}


def recipe_text(name: str) -> str:
    """The TOML of a bundled recipe.

    Raises:
        InputError: there is none of that name.
    """
    if name not in _bundled():
        raise UnknownNameError(f'unknown recipe "{name}"', remedy=nearest(name, _bundled()))
    return (resources.files("idtool.recipes") / f"{name}.toml").read_text(encoding="utf-8")


def _bundled() -> list[str]:
    entries = resources.files("idtool.recipes").iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml"))


def read_recipe(name_or_path: str, changes: Changes | None = None) -> Recipe:
    """A bundled recipe by name, or a file; a file named as a bundled recipe is read as `./NAME`.

    Args:
        name_or_path: see above.
        changes: what is asked for in place of what it says.

    Raises:
        InputError: naming the file, the key and the remedy.
    """
    if name_or_path in _bundled():
        return parse_recipe(recipe_text(name_or_path), f"recipe {name_or_path}", changes)
    path = Path(name_or_path)
    try:
        document = load_toml(path, what="a recipe", made_by="`ffc-id recipes show NAME`")
    except InputError as error:
        if not isinstance(error.__cause__, FileNotFoundError):
            raise
        if path.suffix != ".toml" and path.name == name_or_path:
            recipe_text(name_or_path)  # a word that is no file is a misspelt name
        raise InputError("no such file", file=path, remedy="ffc-id recipes lists the bundled ones") from error
    with in_file(path):
        return _recipe(document, str(path), changes)


def parse_recipe(text: str, source: str, changes: Changes | None = None) -> Recipe:
    """Check and expand the TOML of a recipe; `changes` as in `read_recipe`.

    Raises:
        InputError: naming `source`, the key and the remedy.
    """
    with in_file(source):
        return _recipe(read_document(text, source, what="a recipe"), source, changes)


def _recipe(document: dict[str, Any], source: str, changes: Changes | None) -> Recipe:
    check_schema(document, SCHEMA)
    no_strangers(document, _TOP, "")
    name = _word(document, "name")
    experiment = _word(document, "experiment")
    description = _word(document, "description", needed=False)
    kind = document.get("axis", "rotary")
    if kind not in ("rotary", "linear"):
        remedy = nearest(str(kind)[:60], ["rotary", "linear"])
        raise InputError(f"unknown kind of axis {short(kind)}", place="axis", remedy=remedy)
    period = _number(document.get("period_s", 0.005), "period_s", low=1e-3, high=0.1)
    setup = table_at(document.get("setup", {}), "setup")
    no_strangers(setup, _SETUP, "setup.")
    reader = _Reader(cast(Kind, kind), period)
    entries = _changed(document.get("trials"), cast(Kind, kind), changes or Changes())
    trials = reader.trials(setup, entries)
    return Recipe(name, experiment, description, cast(Kind, kind), period, trials, source)


def _changed(entries: Any, kind: Kind, changes: Changes) -> Any:
    """The trials with what is asked for in place of what they say."""
    if changes == Changes() or not isinstance(entries, list):
        return entries
    return [_changed_entry(entry, kind, changes) if isinstance(entry, dict) else entry for entry in entries]


def _changed_entry(entry: dict[str, Any], kind: Kind, changes: Changes) -> dict[str, Any]:
    one_each: dict[str, Sequence[float]] = {}
    values: dict[str, float] = {}
    if changes.payloads is not None:
        one_each["payload_kg"] = changes.payloads
    if changes.tilt is not None:
        values |= dict(zip(("tilt_alpha_rad", "tilt_beta_rad"), changes.tilt, strict=True))
    if entry.get("kind") == "back_and_forth":
        if changes.speeds is not None:
            one_each[file_key("speed", "velocity", kind)] = changes.speeds
        if changes.travel is not None:
            values[file_key("travel", "position", kind)] = changes.travel
    changed = entry | values
    for key, wanted in one_each.items():
        # a list of another key belongs to the values that it was written for
        changed = {k: v[0] if isinstance(v, list) and v else v for k, v in changed.items()}
        changed[key] = list(wanted)
    return changed


def document_of_command(command: str, kind: Kind) -> dict[str, Any]:
    """The recipe, as a TOML document, that a command such as `ffc-id run-sweep --speeds 0.1,0.2` runs."""
    _, run, *rest = shlex.split(command)
    document = parse_toml(recipe_text(run.removeprefix("run-")))
    options = dict(pairwise(rest))
    speeds = [float(speed) for speed in options["--speeds"].split(",")] if "--speeds" in options else None
    travel = float(options["--travel"]) if "--travel" in options else None
    document["trials"] = _changed(document["trials"], kind, Changes(speeds=speeds, travel=travel))
    return document


@dataclass(frozen=True)
class _Reader:
    """Reads the trials of one file."""

    kind: Kind
    period: float

    def trials(self, setup: Mapping[str, Any], entries: Any) -> tuple[RecipeTrial, ...]:
        if not isinstance(entries, list) or not entries:
            raise InputError("has no trials", place="trials", remedy="add a [[trials]] table")
        trials: list[RecipeTrial] = []
        seconds = 0.0
        for index, entry in enumerate(entries):
            place = f"trials[{index}]"
            for values in self._expand(entry, place):
                trial = self._trial({**setup, **values}, place)
                trials.append(trial)
                seconds += trial.motion.duration_s + trial.setup.rest_s
                if len(trials) > _MAX_TRIALS:
                    raise InputError(
                        f"makes over {_MAX_TRIALS} trials", place=place, remedy="split the recipe"
                    )
                if seconds > _MAX_SECONDS:
                    remedy = "move faster or less far, or split the recipe"
                    raise InputError("takes the recipe over four hours", place=place, remedy=remedy)
        return tuple(trials)

    def _expand(self, entry: Any, place: str) -> list[dict[str, Any]]:
        """One table per value of a list (all lists of a table must be of one length)."""
        entry = table_at(entry, place, "write it as [[trials]]")
        lists = {k: v for k, v in entry.items() if isinstance(v, list) and k != "frequencies_hz"}
        lengths = {len(values) for values in lists.values()}
        if len(lengths) > 1:
            listed = ", ".join(f"{key} {len(values)}" for key, values in lists.items())
            raise InputError(
                f"lists of different lengths ({listed})",
                place=place,
                remedy="give one value of each per trial",
            )
        count = lengths.pop() if lengths else 1
        if count == 0:
            raise InputError("an empty list makes no trial", place=place, remedy="give a value")
        if count > _MAX_TRIALS:
            raise InputError(f"makes over {_MAX_TRIALS} trials", place=place, remedy="split the recipe")
        return [{k: (v[i] if k in lists else v) for k, v in entry.items()} for i in range(count)]

    def _trial(self, values: Mapping[str, Any], place: str) -> RecipeTrial:
        motion = values.get("kind")
        if not isinstance(motion, str) or motion not in _KINDS:
            remedy = nearest(motion[:60] if isinstance(motion, str) else "", _KINDS)
            problem = f"unknown kind of motion {short(motion)}" if "kind" in values else "is missing"
            raise InputError(problem, place=f"{place}.kind", remedy=remedy)
        keys = {name: file_key(name, dimension, self.kind) for name, dimension, _ in _KINDS[motion]}
        no_strangers(values, ("kind", *keys.values(), *_SETUP), f"{place}.")
        for name, _, needed in _KINDS[motion]:
            if needed and keys[name] not in values:
                raise InputError(
                    "is missing", place=f"{place}.{keys[name]}", remedy=f"add {keys[name]} = ..."
                )

        def number(name: str, default: float | None = None, low: float = 1e-6, high: float = 1e4) -> float:
            key = keys[name]
            return _number(values.get(key, default), f"{place}.{key}", low=low, high=high)

        setup = self._setup(values, place)
        if motion == "back_and_forth":
            repeats = number("repeats", 1, 1, _MAX_TRIALS)
            if repeats != round(repeats):
                raise InputError(
                    f"expected a whole number, found {repeats:g}", place=f"{place}.repeats", remedy="round it"
                )
            acceleration = number("acceleration", _ACCELERATION)
            dwell = number("dwell", 0.0, 0.0, 3600.0)
            ways = BackAndForth(number("speed"), number("travel"), acceleration, round(repeats), dwell)
            if ways.ramp_travel > ways.travel:
                raise InputError(
                    f"the ramps up to {ways.speed:g} and down again take {ways.ramp_travel:.3g}, "
                    f"more than the travel of {ways.travel:g}",
                    place=f"{place}.{keys['travel']}",
                    remedy=f"make it {1.2 * ways.ramp_travel:.2g} or more, lower {keys['speed']} "
                    f"or raise {keys['acceleration']}",
                )
            return RecipeTrial(setup, ways, place, (keys["speed"], keys["travel"]))
        duration = number("duration", high=_MAX_SECONDS)
        frequencies = self._frequencies(values, f"{place}.{keys.get('frequencies', 'frequency_hz')}")
        if duration < 1.0 / min(frequencies):
            remedy = f"make it at least {1.0 / min(frequencies):.3g} s"
            raise InputError("is less than one period", place=f"{place}.duration_s", remedy=remedy)
        sines = Sines(frequencies, number("amplitude"), duration)
        return RecipeTrial(setup, sines, place, (keys["amplitude"], keys["amplitude"]))

    def _frequencies(self, values: Mapping[str, Any], place: str) -> tuple[float, ...]:
        listed = values["frequencies_hz"] if "frequencies_hz" in values else [values["frequency_hz"]]
        if not isinstance(listed, list) or not 0 < len(listed) <= _MAX_SINES:
            raise InputError(
                f"expected a list of 1 to {_MAX_SINES} frequencies",
                place=place,
                remedy="write it as [0.1, 0.3]",
            )
        high = SINE_SHARE / self.period
        return tuple(_number(value, place, low=1e-3, high=high) for value in listed)

    def _setup(self, values: Mapping[str, Any], place: str) -> TrialSetup:
        def number(key: str, default: float, low: float, high: float) -> float:
            return _number(values.get(key, default), f"{place}.{key}", low=low, high=high)

        return TrialSetup(
            payload_kg=number("payload_kg", 0.0, 0.0, 1e4),
            tilt_alpha_rad=number("tilt_alpha_rad", 0.0, -math.pi, math.pi),
            tilt_beta_rad=number("tilt_beta_rad", 0.0, -math.pi, math.pi),
            temperature_degc=number("temperature_degc", 25.0, -50.0, 150.0)
            if "temperature_degc" in values
            else None,
            rest_s=number("rest_s", 0.5, 0.0, 3600.0),
        )


def _word(document: Mapping[str, Any], key: str, *, needed: bool = True) -> str:
    value = document.get(key, None if needed else "")
    good = isinstance(value, str) and (value or not needed) and len(value) <= 200 and value.isprintable()
    if not good:
        raise InputError(
            f"expected a short text, found {short(value)}" if key in document else "is missing",
            place=key,
            remedy=f'write it as {key} = "..."',
        )
    return str(value)


def _number(value: Any, place: str, *, low: float, high: float) -> float:
    if not is_finite(value) or not low <= value <= high:
        raise InputError(
            f"expected a number from {low:g} to {high:g}, found {short(value)}",
            place=place,
            remedy="correct it",
        )
    return float(value)
