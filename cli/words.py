"""The words that an option knows: completed in a shell, and the nearest one named after a mistake.

Nothing here imports numpy: a shell asks at every press of the Tab key.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

_PACKAGE = Path(__file__).parent.parent
Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem[str]]]
_NO_EFFECTS = ("__init__", "base", "registry")


class Choice(click.Choice[str]):
    """One of a few words; a misspelt one is answered with the nearest."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        from idtool.errors import nearest, sentence

        remedy = nearest(str(value), self.choices)
        guess = remedy if remedy.startswith("did you mean") else None
        return sentence(f'"{value}" is not one of {", ".join(self.choices)}', guess)


def rig_names() -> list[str]:
    """Names of the simulated rigs that come with the package."""
    return sorted(path.stem for path in _inside("rig").glob("*.toml"))


def recipe_names() -> list[str]:
    """Names of the recipes that come with the package."""
    return sorted(path.stem for path in _inside("recipes").glob("*.toml"))


def effect_names() -> list[str]:
    """Names of all effects, those of other packages too."""
    from idtool.io.entry_points import outside

    brought = (path.stem for path in _inside("effects").glob("*.py") if path.stem not in _NO_EFFECTS)
    return sorted([*brought, *outside("ffc_id.effects")])


def complete_rig(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem[str]]:
    """Rig specs: names, plant files, logs and serial devices."""
    kind, colon, rest = incomplete.partition(":")
    if not colon:
        from idtool.io.entry_points import outside

        others = (f"{name}:" for name in outside("ffc_id.rigs"))
        known = [*(f"sim:{name}" for name in rig_names()), "dynamixel:", "feetech:", "replay:", *others]
        return _items(word for word in known if word.startswith(incomplete))
    if kind == "sim":
        found = _names_or_files(rig_names(), rest)
    elif kind == "replay":
        found = list(_paths(rest, (".csv", ".gz")))
    elif kind in ("dynamixel", "feetech"):
        devices = sorted(str(path) for mask in ("ttyUSB*", "ttyACM*") for path in Path("/dev").glob(mask))
        found = [device for device in devices if device.startswith(rest)]
    else:
        found = []
    return _items(f"{kind}:{word}" for word in found)


def _completing(names: Callable[[], list[str]], *, files: bool) -> Completer:
    """Completes these names, and TOML files if they are taken in place of them."""

    def complete(_: click.Context, __: click.Parameter, incomplete: str) -> list[CompletionItem[str]]:
        if files:
            return _items(_names_or_files(names(), incomplete))
        return _items(name for name in names() if name.startswith(incomplete))

    return complete


complete_recipe = _completing(recipe_names, files=True)
complete_bundled = _completing(recipe_names, files=False)
complete_plant = _completing(rig_names, files=True)
complete_effect = _completing(effect_names, files=False)


def _inside(folder: str) -> Path:
    """A folder of the package; of an editable install `recipes` lies beside `idtool`, not in it."""
    from importlib.util import find_spec

    spec = find_spec(f"idtool.{folder}")
    return Path(spec.submodule_search_locations[0]) if spec and spec.submodule_search_locations else _PACKAGE


def _names_or_files(names: list[str], start: str) -> list[str]:
    """Names and TOML files that begin so."""
    return [*(name for name in names if name.startswith(start)), *_paths(start, (".toml",))]


def _paths(start: str, endings: tuple[str, ...]) -> Iterator[str]:
    """Folders, and files with these endings, whose path begins so."""
    folder, name = os.path.split(start)
    try:
        entries = sorted(os.scandir(folder or "."), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in entries:
        if not entry.name.startswith(name) or (entry.name.startswith(".") and not name):
            continue
        if entry.is_dir():
            yield os.path.join(folder, entry.name) + "/"
        elif entry.name.endswith(endings):
            yield os.path.join(folder, entry.name)


def _items(words: Any) -> list[CompletionItem[str]]:
    return [CompletionItem(word) for word in words]
