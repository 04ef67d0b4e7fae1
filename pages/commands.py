"""Every command with its arguments and options, from the program itself.

python -m pages.commands     (make docs-commands)
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path

import click
from idtool.cli.commands import ffc_id

PAGE = Path("docs/commands.md")
_HEAD = """# Commands

You get: every command with every option and its default.

Made by `make docs-commands` from the program itself; `--help` after a command says the same in the terminal.

{index}

Every command also takes `-h` and `--help`; `ffc-id --version` says which version this is.
Exit codes: 0 done, 2 usage, 3 bad input, 4 rig or device fault, 70 a fault of the program, 130 interrupted.
"""


def commands(
    command: click.Command = ffc_id, context: click.Context | None = None
) -> Iterator[tuple[str, click.Command, click.Context]]:
    """Every command that does something, by its whole name ("export c"); groups are walked through."""
    context = context or click.Context(command, info_name="ffc-id")
    if not isinstance(command, click.Group):
        yield context.command_path.removeprefix("ffc-id "), command, context
        return
    if command.invoke_without_command:
        yield context.command_path.removeprefix("ffc-id "), command, context
    for name in command.list_commands(context):
        below = command.get_command(context, name)
        assert below is not None
        yield from commands(below, click.Context(below, info_name=name, parent=context))


def page() -> str:
    """The text of docs/commands.md."""
    every = list(commands())
    index = " · ".join(f"[{name}](#{_anchor(name)})" for name, _, _ in every)
    sections = [_section(name, command, context) for name, command, context in every]
    return "\n".join([_HEAD.format(index=index), *sections])


def option_names(parameter: click.Parameter) -> tuple[str, ...]:
    """As a user types it: `-o`, `--output`, `--yes`, `--no-yes`; nothing for an argument."""
    if not isinstance(parameter, click.Option) or parameter.hidden:
        return ()
    return (*parameter.opts, *parameter.secondary_opts)


def _anchor(name: str) -> str:
    return "ffc-id-" + name.replace(" ", "-")


def _section(name: str, command: click.Command, context: click.Context) -> str:
    prose, example = _help(command)
    pieces = " ".join(command.collect_usage_pieces(context))
    lines = [f"## ffc-id {name}", "", *prose, f"Usage: **ffc-id {name}** `{pieces}`", ""]
    if example:
        lines += ["```", *example, "```", ""]
    rows = [_row(p, context) for p in command.params if option_names(p)]
    if rows:
        lines += ["| option | what | without it |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


def _help(command: click.Command) -> tuple[list[str], list[str]]:
    r"""The paragraphs of a command's help as they are written, and the example that follows a \b.

    A later paragraph that is laid out by hand (a second \b) stays laid out, as a block.
    """
    prose: list[str] = []
    example: list[str] = []
    for paragraph in inspect.cleandoc(command.help or "").split("\n\n"):
        first, *rest = paragraph.splitlines()
        if first != "\b":
            prose += [paragraph, ""]
        elif rest[0].startswith("ffc-id") and not example:
            example = rest
        else:
            prose += ["```text", *rest, "```", ""]
    return prose, example


def _row(option: click.Parameter, context: click.Context) -> str:
    assert isinstance(option, click.Option)
    names = ", ".join(f"`{name}`" for name in option_names(option))
    choices = ""
    if isinstance(option.type, click.Choice) and not option.metavar:
        choices = " One of " + ", ".join(f"`{choice}`" for choice in option.type.choices) + "."
    elif not option.is_flag and not option.count:
        names += f" `{option.make_metavar(context).removesuffix(' RANGE')}`"
    shown = "needed" if option.required else ""
    default = option.get_default(context, call=False)
    if option.show_default and default is not None and not callable(default):
        shown = f"`{default}`"
    what = (option.help or "").replace("|", "\\|") + choices
    return f"| {names} | {what} | {shown} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    click.echo(f"written: {PAGE}")
