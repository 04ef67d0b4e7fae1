"""TOML files written anew with their comments and layout; reading them needs no tomlkit."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, MutableMapping
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AoT, InlineTable

from idtool.io.toml import is_finite


def revised(text: str, document: Mapping[str, Any]) -> str:
    """TOML text of `document` that keeps the comments, the order and the layout of `text`.

    Where `text` is empty, every identified parameter is one inline table on one line.

    Raises:
        ValueError: `text` cannot be revised.
    """
    try:
        kept = tomlkit.parse(text)
        _revise(kept, document)
        result = tomlkit.dumps(kept)
    except TOMLKitError as error:
        raise ValueError("its layout cannot be kept") from error
    if text and tomllib.loads(result) != tomllib.loads(revised("", document)):
        raise ValueError("its layout cannot be kept")
    return result


def _revise(kept: MutableMapping[str, Any], document: Mapping[str, Any]) -> None:
    for key in [key for key in kept if key not in document]:
        del kept[key]
    for key, value in document.items():
        old = kept.get(key)
        if isinstance(value, dict) and isinstance(old, MutableMapping) and not isinstance(old, InlineTable):
            _revise(old, value)
        elif _is_table_list(value) and isinstance(old, AoT):
            del old[len(value) :]
            for table, one in zip(old, value, strict=False):
                _revise(table, one)
            for one in value[len(old) :]:
                old.append(_item(one))
        elif old != value:
            kept[key] = _item(value)


def _item(value: Any) -> Any:
    """A value as tomlkit writes it: an identified parameter on one line, other tables with a head."""
    if isinstance(value, dict):
        table = tomlkit.inline_table() if is_finite(value.get("value")) else tomlkit.table(None)
        for key, one in value.items():
            table.append(key, _item(one))
        return table
    if _is_table_list(value):
        tables = tomlkit.aot()
        for one in value:
            tables.append(_item(one))
        return tables
    return tomlkit.item(value)


def _is_table_list(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(item, dict) for item in value)
