"""A group of commands that are imported only when they are used, so that `--help` answers at once."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class LazyGroup(click.Group):
    """A click group that knows its commands by name and imports one only to run it."""

    def __init__(
        self, *args: Any, commands_of: Mapping[str, tuple[str, str, str]] | None = None, **kwargs: Any
    ) -> None:
        """`commands_of`: command -> (module beside this one, function, help line)."""
        super().__init__(*args, **kwargs)
        self._known = dict(commands_of or {})

    def known(self) -> dict[str, tuple[str, str, str]]:
        """Command -> (module beside this one, function, help line)."""
        return self._known

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self.known())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.known():
            return None
        module, function, _ = self.known()[cmd_name]
        command: click.Command = getattr(importlib.import_module(f"idtool.cli.{module}"), function)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in self.known() and not args[0].startswith("-") and not ctx.resilient_parsing:
            from idtool.errors import nearest, sentence

            ctx.fail(sentence(f'no command "{args[0]}"', nearest(args[0], self.known())))
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[str]]:
        from click.shell_completion import CompletionItem

        found = [
            CompletionItem(name, help=text)
            for name, (_, _, text) in self.known().items()
            if name.startswith(incomplete)
        ]
        return [*found, *click.Command.shell_complete(self, ctx, incomplete)]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, _, text) in self.known().items()])
