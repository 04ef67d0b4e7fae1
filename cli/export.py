"""`ffc-id export`: a parameter file as something else; each form is a sub-command imported when used."""

from __future__ import annotations

import click

from .lazy import LazyGroup

#: sub-command -> (module beside this one, function, help line)
COMMANDS: dict[str, tuple[str, str, str]] = {
    "c": ("export_c", "export_c", "The force-free controller as C99, with an Arduino sketch."),
}


@click.command(cls=LazyGroup, commands_of=COMMANDS)
def export() -> None:
    """Turn a parameter file into what other programs and boards use.

    \b
    ffc-id export c -p result/params.toml -o board
    """
