"""The errors a user can meet: bad input, words that mean nothing, and a rig that failed.

Each carries one sentence: what is wrong, where, and what to do. The command line prints it and exits
with `exit_code`; nothing else in the package prints or exits.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from os import PathLike
from typing import Any


class FfcIdError(Exception):
    """Base of every error that is the user's to read; the text is one sentence."""

    exit_code = 1

    @property
    def on_the_command_line(self) -> str:
        """The sentence as the command line prints it."""
        return str(self)


class InputError(FfcIdError):
    """A file, row, key or option that cannot be used.

    Args:
        problem: what is wrong, without a full stop.
        file: the file it is in, if any; "" for what is in none, wherever it shows (see `in_file`).
        place: the row, column or key inside it, if any.
        remedy: what to do about it, without a full stop; `force=True` is `--force` on the command line.
        argument: the argument of a Python function that holds it; the command line names its option.
    """

    exit_code = 3

    def __init__(
        self,
        problem: str,
        *,
        file: str | PathLike[str] | None = None,
        place: str | None = None,
        remedy: str | None = None,
        argument: str | None = None,
    ) -> None:
        self.problem, self.remedy = problem, remedy or ""
        self.file, self._place, self._argument = file, place, argument
        super().__init__(self._told(argument))

    def _told(self, argument: str | None) -> str:
        where = ", ".join(str(part) for part in (self.file, self._place, argument) if part)
        return sentence(f"{where}: {self.problem}" if where else self.problem, self.remedy)

    def name_file(self, file: str | PathLike[str]) -> None:
        """Say the file that it is in, unless that is known, or it is an argument that is wrong."""
        if self.file is None and self._argument is None:
            self.file = file
            self.args = (self._told(self._argument),)

    @property
    def on_the_command_line(self) -> str:
        """The sentence with options in place of arguments."""
        told = self._told(self._argument and f"--{self._argument.replace('_', '-')}")
        return told.replace("force=True", "--force")


@contextmanager
def in_file(file: str | PathLike[str]) -> Iterator[None]:
    """What is found wrong in here is in this file, unless it says otherwise."""
    try:
        yield
    except InputError as error:
        error.name_file(file)
        raise


class UnknownNameError(InputError):
    """A word that names no effect, recipe, rig or recording that there is (exit code 2)."""

    exit_code = 2


class UsageError(FfcIdError):
    """A combination of options that makes no sense (exit code 2)."""

    exit_code = 2


class RigFault(FfcIdError):  # noqa: N818 (a fault is what the rig has; the contract names it so)
    """A rig that cannot be reached, left its limits or stopped answering (exit code 4).

    Attributes:
        history: what was measured in the second before (a `rig.base.Block`); None where nothing was.
    """

    exit_code = 4
    history: Any = None


def sentence(problem: str, remedy: str | None = None) -> str:
    """What is wrong and what to do about it as one sentence; a guess ends with a question mark.

    >>> sentence("no such storm", "did you mean calm")
    'no such storm; did you mean calm?'
    """
    end = "?" if remedy and remedy.startswith("did you mean") else "."
    return f"{problem}; {remedy}{end}" if remedy else f"{problem}."


def misspelt(wanted: Iterable[str], given: Iterable[str]) -> tuple[str, str] | None:
    """A given word that is nearly a wanted one which is missing: (given, wanted); None without any.

    For tables that may hold anything else as well.

    >>> misspelt(["kind"], ["knd", "unit"])
    ('knd', 'kind')
    """
    words = list(given)
    for name in wanted:
        others = [word for word in words if word != name]
        if name not in words and (close := difflib.get_close_matches(name, others, n=1, cutoff=0.75)):
            return close[0], name
    return None


def nearest(word: str, known: Iterable[str]) -> str:
    """A remedy for a misspelt name: the nearest known one, those with a part that is near, or the whole list.

    >>> nearest("clam", ["calm", "storm"])
    'did you mean "calm"'
    >>> nearest("riple", ["position_ripple", "backlash"])
    'did you mean "position_ripple"'
    """
    names = sorted(known)
    close = difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    if not close:
        parts = [part for name in names for part in name.split("_")]
        near = difflib.get_close_matches(word, parts, n=1, cutoff=0.8)
        close = [name for name in names if set(near) & set(name.split("_"))]
    told = " or ".join(f'"{name}"' for name in close)
    return f"did you mean {told}" if close else "known are " + ", ".join(names)
