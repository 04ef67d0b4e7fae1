"""Recipes: experiments as TOML data.

A recipe names an experiment and lists trials; a list given for a number makes one trial of each value.
See the bundled ones in `recipes/`, which are meant to be copied and edited.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from idtool.errors import InputError, nearest
from idtool.experiment.trajectory import back_and_forth, excursion, multisine
from idtool.model.motion import Array
from idtool.rig.base import TrialSetup

SCHEMA = "ffc-id/recipe/1"
_MAX_BYTES = 1 << 20
_MAX_TRIALS = 1000
_MAX_SECONDS = 4 * 3600.0
#: Acceleration of ramps where a recipe does not say: slow against any servo, fast against any run.
_ACCELERATION = 2.0

_TOP = ("schema", "name", "experiment", "description", "period_s", "setup", "trials")
_SETUP = ("payload_kg", "tilt_alpha_rad", "tilt_beta_rad", "temperature_degc", "rest_s")
#: kind of motion -> its keys on a rotary axis; True: needed
_KINDS: dict[str, dict[str, bool]] = {
    "back_and_forth": {
        "speed_rad_s": True,
        "travel_rad": True,
        "repeats": False,
        "acceleration_rad_s2": False,
    },
    "sine": {"frequency_hz": True, "amplitude_rad_s": True, "duration_s": True},
    "multisine": {"frequencies_hz": True, "amplitude_rad_s": True, "duration_s": True},
}


@dataclass(frozen=True)
class RecipeTrial:
    """One trial.

    Attributes:
        setup: how the axis stands.
        command: velocity commands, rad/s (m/s), shape (samples,).
        place: where it stands in the file, for messages.
    """

    setup: TrialSetup
    command: Array
    place: str

    def excursion(self, period: float) -> tuple[float, float]:
        """Lowest and highest position relative to the start."""
        return excursion(self.command, period)


@dataclass(frozen=True)
class Recipe:
    """An experiment, expanded.

    Attributes:
        name: of the recipe.
        experiment: what its log is marked as: "gravity", "sweep", "sine" or any word.
        description: one line.
        period_s: sampling and command period.
        trials: in order.
        source: file, for messages.
    """

    name: str
    experiment: str
    description: str
    period_s: float
    trials: tuple[RecipeTrial, ...]
    source: str

    @property
    def duration_s(self) -> float:
        """Time in motion."""
        return self.period_s * sum(len(trial.command) for trial in self.trials)


def recipe_names() -> dict[str, str]:
    """Bundled recipes: name -> description."""
    folder = resources.files("idtool.recipes")
    names = sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )
    return {name: str(tomllib.loads(recipe_text(name)).get("description", "")) for name in names}


def recipe_text(name: str) -> str:
    """The TOML of a bundled recipe.

    Raises:
        InputError: there is none of that name.
    """
    folder = resources.files("idtool.recipes")
    known = [entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")]
    if name not in known:
        raise InputError(f"unknown recipe {name!r}", remedy=nearest(name, known))
    return (folder / f"{name}.toml").read_text(encoding="utf-8")


def read_recipe(name_or_path: str) -> Recipe:
    """A bundled recipe by name, or a file.

    Raises:
        InputError: naming the file, the key and the remedy.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml" and not path.exists():
        return parse_recipe(recipe_text(name_or_path), f"recipe {name_or_path}")
    if path.is_dir():
        raise InputError("is a folder where a recipe should be", file=path, remedy="name the file in it")
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise InputError("is over 1 MiB, no recipe", file=path)
        text = path.read_bytes().decode("utf-8")
    except FileNotFoundError as error:
        raise InputError(
            "no such file", file=path, remedy="`ffc-id recipes` lists the bundled ones"
        ) from error
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read ({error})", file=path, remedy="check the file") from error
    return parse_recipe(text, str(path))


def parse_recipe(text: str, source: str) -> Recipe:
    """Check and expand the TOML of a recipe."""
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"is not TOML ({error})", file=source, remedy="mend that place") from error
    if document.get("schema") != SCHEMA:
        raise InputError(
            f"schema is {document.get('schema')!r}",
            file=source,
            place="schema",
            remedy=f'expected "{SCHEMA}"',
        )
    _known(document, _TOP, "", source)
    name = _word(document, "name", source)
    experiment = _word(document, "experiment", source)
    period = _number(document.get("period_s", 0.005), "period_s", source, low=1e-3, high=0.1)
    setup = document.get("setup", {})
    if not isinstance(setup, dict):
        raise InputError("expected a table", file=source, place="setup", remedy="write it as [setup]")
    _known(setup, _SETUP, "setup.", source)
    entries = document.get("trials")
    if not isinstance(entries, list) or not entries:
        raise InputError("has no trials", file=source, place="trials", remedy="add a [[trials]] table")
    trials: list[RecipeTrial] = []
    for index, entry in enumerate(entries):
        for values in _expand(entry, f"trials[{index}]", source):
            trials.append(_trial({**setup, **values}, f"trials[{index}]", period, source))
            if len(trials) > _MAX_TRIALS:
                raise InputError(f"makes over {_MAX_TRIALS} trials", file=source, remedy="split it")
    recipe = Recipe(name, experiment, str(document.get("description", "")), period, tuple(trials), source)
    if recipe.duration_s > _MAX_SECONDS:
        raise InputError("takes over four hours", file=source, remedy="split it")
    return recipe


def _expand(entry: Any, place: str, source: str) -> list[dict[str, Any]]:
    """One table per value of a list (all lists of a table must be of one length)."""
    if not isinstance(entry, dict):
        raise InputError("expected a table", file=source, place=place, remedy="write it as [[trials]]")
    lists = {k: v for k, v in entry.items() if isinstance(v, list) and k != "frequencies_hz"}
    lengths = {len(values) for values in lists.values()}
    if len(lengths) > 1:
        raise InputError(
            "lists of different lengths", file=source, place=place, remedy="give one value per trial"
        )
    count = lengths.pop() if lengths else 1
    if count == 0:
        raise InputError("an empty list makes no trial", file=source, place=place, remedy="give a value")
    if count > _MAX_TRIALS:
        raise InputError(f"makes over {_MAX_TRIALS} trials", file=source, place=place, remedy="split it")
    return [{k: (v[i] if k in lists else v) for k, v in entry.items()} for i in range(count)]


def _trial(values: Mapping[str, Any], place: str, period: float, source: str) -> RecipeTrial:
    kind = values.get("kind")
    if kind not in _KINDS:
        raise InputError(
            f"unknown kind of motion {kind!r}",
            file=source,
            place=f"{place}.kind",
            remedy=nearest(str(kind), _KINDS),
        )
    keys = _KINDS[kind]
    _known(values, ("kind", *keys, *_SETUP), f"{place}.", source)
    for key, needed in keys.items():
        if needed and key not in values:
            raise InputError("is missing", file=source, place=f"{place}.{key}", remedy=f"add {key} = ...")

    def positive(key: str, default: float | None = None, high: float = 1e4) -> float:
        return _number(values.get(key, default), f"{place}.{key}", source, low=1e-6, high=high)

    if kind == "back_and_forth":
        travel, speed = positive("travel_rad"), positive("speed_rad_s")
        repeats = round(positive("repeats", 1, 1000))
        if 2 * travel / speed * repeats > _MAX_SECONDS:
            raise InputError(
                "takes over four hours", file=source, place=place, remedy="move faster or less far"
            )
        acceleration = positive("acceleration_rad_s2", _ACCELERATION)
        command = back_and_forth(speed, travel, repeats, acceleration, period)
    else:
        frequencies = values["frequency_hz"] if kind == "sine" else values["frequencies_hz"]
        listed = frequencies if isinstance(frequencies, list) else [frequencies]
        checked = [_number(f, f"{place}.frequencies", source, low=1e-3, high=0.1 / period) for f in listed]
        if not checked or len(checked) > 50:
            raise InputError("expected 1 to 50 frequencies", file=source, place=place)
        command = multisine(
            checked, positive("amplitude_rad_s"), positive("duration_s", high=_MAX_SECONDS), period
        )
    return RecipeTrial(_setup(values, place, source), command, place)


def _setup(values: Mapping[str, Any], place: str, source: str) -> TrialSetup:
    def number(key: str, default: float, low: float, high: float) -> float:
        return _number(values.get(key, default), f"{place}.{key}", source, low=low, high=high)

    temperature = values.get("temperature_degc")
    return TrialSetup(
        payload_kg=number("payload_kg", 0.0, 0.0, 1e4),
        tilt_alpha_rad=number("tilt_alpha_rad", 0.0, -math.pi, math.pi),
        tilt_beta_rad=number("tilt_beta_rad", 0.0, -math.pi, math.pi),
        temperature_degc=None if temperature is None else number("temperature_degc", 25.0, -50.0, 150.0),
        rest_s=number("rest_s", 0.5, 0.0, 3600.0),
    )


def _known(table: Mapping[str, Any], known: tuple[str, ...], prefix: str, source: str) -> None:
    for key in table:
        if key not in known:
            raise InputError("unknown key", file=source, place=f"{prefix}{key}", remedy=nearest(key, known))


def _word(document: Mapping[str, Any], key: str, source: str) -> str:
    value = document.get(key)
    if not isinstance(value, str) or not value or len(value) > 100 or not value.isprintable():
        raise InputError("expected a short text in quotes", file=source, place=key)
    return value


def _number(value: Any, place: str, source: str, *, low: float, high: float) -> float:
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not good or not low <= value <= high:
        raise InputError(
            f"expected a number from {low:g} to {high:g}, found {value!r}", file=source, place=place
        )
    return float(value)
