"""What the commands share: options, where text goes, and JSON.

Results go to standard output; progress and messages to standard error. With `--json` standard
output holds one JSON document and nothing else.
"""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from .screen import Screen

Decorator = Callable[[Any], Any]
#: The type of an argument or an option that names a file or a folder.
PATH = click.Path(path_type=Path)


@dataclass(frozen=True)
class Output:
    """Where a command's words go.

    Attributes:
        json: print one JSON document on standard output.
        quiet: print no progress and no messages.
    """

    json: bool
    quiet: bool

    def say(self, text: str) -> None:
        """A message for a person, on standard error, unless quiet."""
        if not self.quiet:
            click.echo(text, err=True)

    def warn(self, *sentences: str) -> None:
        """Warnings, on standard error, even when quiet."""
        for sentence in sentences:
            click.echo(f"note: {sentence}", err=True)

    def next(self, *words: str | os.PathLike[str], odd: Sequence[str] = ()) -> None:
        """The one command to go on with, `ffc-id` left away, on standard error; not where a program reads.

        Args:
            words: the command.
            odd: logs whose columns contradict each other, which no other run cures: one is to be looked at.
        """
        if not self.json:
            self.say(f"next: {shlex.join(['ffc-id', *map(str, ('plot', odd[0]) if odd else words)])}")

    def result(self, document: Any, show: Callable[[Screen], None] | Iterable[str]) -> None:
        """The result: `document` as JSON; or its lines, or what `show` prints on a screen."""
        if self.json:
            from idtool.io.plain import plain

            click.echo(json.dumps(plain(document), indent=1, allow_nan=False, default=str))
        elif callable(show):
            from .screen import Screen

            show(Screen())
        else:
            for line in show:
                click.echo(line)


def given_words(*but: str) -> list[str]:
    """The arguments and options of the running command as they were given; `but` are options to leave out."""
    context = click.get_current_context()
    given = click.core.ParameterSource.COMMANDLINE
    words: list[str] = []
    for parameter in context.command.params:
        if not parameter.name or context.get_parameter_source(parameter.name) is not given:
            continue
        value = context.params[parameter.name]
        option = [parameter.opts[0]] if isinstance(parameter, click.Option) else []
        if but and option and option[0] in but:
            continue
        for one in value if option and parameter.multiple else (value,):
            words += option if one is True else [*option, *_as_typed(one)]
    return words


def _as_typed(value: Any) -> list[str]:
    """A value of the command line as a person would type it."""
    if isinstance(value, tuple):
        return [word for one in value for word in _as_typed(one)]
    if isinstance(value, list):
        return [",".join(word for one in value for word in _as_typed(one))]
    return [str(value).removesuffix(".0") if isinstance(value, float) else str(value)]


def handed(name: str, kind: type[Any], *options: Decorator) -> Decorator:
    """These options, handed to a command as one argument: a dataclass with a field for each of them."""

    def decorate(command: Any) -> Any:
        @wraps(command)
        def gathered(**given: Any) -> Any:
            own = kind(**{field.name: given.pop(field.name) for field in fields(kind)})
            return command(**{name: own}, **given)

        decorated: Any = gathered
        for option in reversed(options):
            decorated = option(decorated)
        return decorated

    return decorate


#: `--json` and `-q`, handed to the command as `output: Output`.
output_options = handed(
    "output",
    Output,
    click.option("--json", is_flag=True, help="One JSON document on standard output."),
    click.option("-q", "--quiet", is_flag=True, help="No progress, no messages."),
)
logs_argument = click.argument("logs", nargs=-1, required=True, type=PATH, metavar="LOG...")


#: An option whose help shows its default.
defaulted = partial(click.option, show_default=True)


def params_option(text: str = "Parameter file.", *, required: bool = True) -> Decorator:
    """`-p`."""
    return click.option("-p", "--params", required=required, type=PATH, help=text)


seed_option = defaulted("--seed", type=click.IntRange(0), default=0, help="Seed of all randomness.")
force_option = click.option("--force", is_flag=True, help="Overwrite what is there.")


def picture_name(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
    """The file of a picture, whose name says what kind it is."""
    if path is not None and path.suffix.lower() not in (".png", ".svg"):
        raise click.BadParameter(f"{path}: expected a name that ends in .png or .svg")
    return path
