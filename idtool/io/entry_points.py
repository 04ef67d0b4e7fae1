"""What other packages add to this one, by entry points of their `pyproject.toml`.

    [project.entry-points."ffc_id.effects"]
    imbalance = "my_package.imbalance:Imbalance"

Groups: `ffc_id.effects`, `ffc_id.rigs`, `ffc_id.readers`, `ffc_id.exports` (docs/extending.md). A name is
known without its package being imported; `load` imports it.
"""

from __future__ import annotations

from collections.abc import Container
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import TypeVar

from idtool.errors import InputError

T = TypeVar("T")


def outside(group: str, own: Container[str] = ()) -> dict[str, EntryPoint]:
    """The entry points of a group by name, in that order; `own`: the names that the tool has itself.

    Raises:
        InputError: two packages add the same name, or one adds one of `own`.
    """
    found = _points(group)
    if taken := next((point for name, point in found.items() if name in own), None):
        raise InputError(
            f'{_package(taken)} adds "{taken.name}" to {group}, a name that the tool has itself',
            file="",
            remedy="uninstall it, or have it name what it adds otherwise",
        )
    return found


@cache
def _points(group: str) -> dict[str, EntryPoint]:
    found: dict[str, EntryPoint] = {}
    for point in sorted(entry_points(group=group), key=lambda point: point.name):
        other = found.setdefault(point.name, point)
        if other.value != point.value:
            raise InputError(
                f'{_package(other)} and {_package(point)} both add "{point.name}" to {group}',
                file="",
                remedy="uninstall one of them",
            )
    return found


def load(group: str, name: str, kind: type[T]) -> T:
    """What an entry point names: a `kind`, or a sub-class of it, which is made.

    Raises:
        InputError: it cannot be imported, or is none.
    """
    point = _points(group)[name]

    def wrong(why: str) -> InputError:
        return InputError(
            f'{_package(point)} adds "{name}" to {group}, but {point.value} {why}',
            file="",
            remedy="install another version of that package, or uninstall it",
        )

    try:
        value = point.load()
        if isinstance(value, type) and issubclass(value, kind):
            value = value()
    except Exception as error:  # code of others may raise anything
        raise wrong(f"cannot be loaded ({error})") from error
    if not isinstance(value, kind):
        raise wrong(f"is no {kind.__name__}")
    return value


def _package(point: EntryPoint) -> str:
    return f"the package {point.dist.name}" if point.dist else "a package"
