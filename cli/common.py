"""What the commands share: options, where text goes, and JSON.

Results go to standard output; progress and messages to standard error. With `--json` standard
output holds one JSON document and nothing else.
"""

from __future__ import annotations

import json
import math
import os
import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .numbers import Number
from .words import complete_rig

if TYPE_CHECKING:
    from rich.console import Console

F = TypeVar("F", bound=Callable[..., Any])

_PIPED_WIDTH = 1000


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

    def result(self, document: Any, show: Callable[[Console], None]) -> None:
        """The result: `document` as JSON, or what `show` prints on a rich console."""
        if self.json:
            click.echo(json.dumps(finite(document), indent=1, allow_nan=False, default=_plain))
        else:
            show(console())


def given_words() -> list[str]:
    """The arguments and options of the running command as they were given."""
    context = click.get_current_context()
    given = click.core.ParameterSource.COMMANDLINE
    words: list[str] = []
    for parameter in context.command.params:
        if not parameter.name or context.get_parameter_source(parameter.name) is not given:
            continue
        value = context.params[parameter.name]
        if isinstance(parameter, click.Option):
            words.append(parameter.opts[0])
        if value is not True:
            words += map(str, value) if isinstance(value, tuple) else [f"{value}"]
    return words


def console(*, stderr: bool = False) -> Console:
    """A rich console; where the output is not a terminal plain text, as wide as it needs to be.

    NO_COLOR and COLUMNS are respected.
    """
    from rich.console import Console

    screen = Console(stderr=stderr, highlight=False, soft_wrap=False)
    if not screen.is_terminal and not os.environ.get("COLUMNS"):
        screen.width = _PIPED_WIDTH  # nobody folds what another program reads
    return screen


def finite(document: Any) -> Any:
    """The document with every NaN and infinity as null, which is what JSON has."""
    if isinstance(document, dict):
        return {str(key): finite(value) for key, value in document.items()}
    if isinstance(document, list | tuple):
        return [finite(value) for value in document]
    if isinstance(document, float) and not math.isfinite(document):
        return None
    return document


def _plain(value: Any) -> Any:
    if hasattr(value, "item"):
        return finite(value.item())
    return str(value)


def output_options(command: F) -> F:
    """`--json` and `-q`, handed to the command as `output: Output`."""

    def collect(ctx: click.Context, /, **kwargs: Any) -> Any:
        output = Output(json=kwargs.pop("json"), quiet=kwargs.pop("quiet"))
        return ctx.invoke(command, output=output, **kwargs)

    collect.__name__ = command.__name__
    collect.__doc__ = command.__doc__
    collect.__click_params__ = getattr(command, "__click_params__", [])  # type: ignore[attr-defined]
    decorated = click.pass_context(collect)
    decorated = click.option("-q", "--quiet", is_flag=True, help="No progress, no messages.")(decorated)
    decorated = click.option("--json", is_flag=True, help="One JSON document on standard output.")(decorated)
    return decorated  # type: ignore[return-value]


seed_option = click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of all randomness."
)
force_option = click.option("--force", is_flag=True, help="Overwrite what is there.")
#: The rig of examples; no command takes it by itself.
EXAMPLE_RIG = "sim:paper"
rig_option = click.option(
    "--rig",
    metavar="SPEC",
    shell_complete=complete_rig,
    help="sim:NAME, sim:FILE.toml, dynamixel:DEVICE, feetech:DEVICE or replay:LOG; asked for where it is left"
    " out.",
)


def told_rig(spec: str | None, output: Output) -> str:
    """The rig: as given, or asked for on a terminal.

    Raises:
        UsageError: no option, and nobody to ask.
    """
    from idtool.errors import UsageError

    if spec is not None:
        return spec
    if sys.stdin.isatty() and not output.json:
        return click.prompt("which rig (sim:paper, dynamixel:DEVICE, ...; ffc-id rigs lists them)", err=True)
    raise UsageError(
        f"--rig is missing; name the axis, as --rig {EXAMPLE_RIG} (simulated) or --rig dynamixel:DEVICE."
    )


def picture_name(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
    """The file of a picture, whose name says what kind it is."""
    if path is not None and path.suffix.lower() not in (".png", ".svg"):
        raise click.BadParameter(f"{path}: expected a name that ends in .png or .svg")
    return path


def radians(
    degrees: tuple[float, float] | None, tilt: tuple[float, float] | None
) -> tuple[float, float] | None:
    """Tilt of `--tilt` (rad) or `--tilt-deg`.

    Raises:
        UsageError: both were given.
    """
    from idtool.errors import UsageError

    for angle in degrees or ():
        if not abs(angle) <= 180.0:
            raise UsageError(f"--tilt-deg: expected -180 to 180 degrees, found {angle:g}")
    if degrees is None:
        return tilt
    if tilt is not None:
        raise UsageError("--tilt and --tilt-deg say the same in two units; pass one of them.")
    return math.radians(degrees[0]), math.radians(degrees[1])


tilt_deg_option = click.option(
    "--tilt-deg", nargs=2, type=Number(), metavar="ALPHA BETA", help="Tilt of the axis, degrees."
)
