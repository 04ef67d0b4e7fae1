"""Angles that an option takes in degrees beside radians."""

from __future__ import annotations

import math
from typing import Any

import click

from .common import Decorator
from .numbers import Number

Pair = tuple[float, float]


def range_options(help_: str) -> Decorator:
    """`--range` and `--range-deg`, handed to a command as `reach` and `reach_deg`."""

    def decorate(command: Any) -> Any:
        degrees = "The same of a rotary axis, degrees."
        for name, inside, words in (("--range-deg", "reach_deg", degrees), ("--range", "reach", help_)):
            option = click.option(name, inside, nargs=2, type=Number(), metavar="LOW HIGH", help=words)
            command = option(command)
        return command

    return decorate


def radians(option: str, plain: Pair | None, degrees: Pair | None) -> Pair | None:
    """What `--OPTION` says, or `--OPTION-deg` in degrees; None where neither was given.

    Raises:
        UsageError: both were given.
    """
    from idtool.errors import UsageError

    if degrees is None:
        return plain
    if plain is not None:
        raise UsageError(f"--{option} and --{option}-deg say the same in two units; pass one of them.")
    return math.radians(degrees[0]), math.radians(degrees[1])
