"""Reading the documentation: its pages, the commands in it, its links."""

from __future__ import annotations

import itertools
import os
import re
from pathlib import Path
from unittest import mock

import click
from idtool.cli.commands import ffc_id

from pages.markdown import FENCE, WIDTH, commands_in, fences, shell_words
from tests.cli import support

PROJECT = Path(__file__).resolve().parents[2]
PAGES = [PROJECT / "README.md", *sorted((PROJECT / "docs").rglob("*.md"))]

#: How the program begins a sentence about a mistake.
_TOLD = "ffc-id: "
_INLINE = re.compile(r"`(ffc-id [^`]+)`")
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def printed(words: list[str], folder: Path) -> str:
    """What `ffc-id WORDS...` prints as wide as the pages, run in this process, which saves its imports."""
    with mock.patch.dict(os.environ, {"COLUMNS": WIDTH}):
        done = support.ffc_id(*words, cwd=folder)
    assert done.returncode == 0, f"ffc-id {' '.join(words)}: {done.stderr}"
    return done.stdout + done.stderr


def page_id(page: Path) -> str:
    """The page as a test names it."""
    return page.relative_to(PROJECT).as_posix()


def indented(page: Path) -> list[str]:
    """Lines of blocks that are indented instead of fenced."""
    return [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("    ")]


def every_command(page: Path) -> list[list[str]]:
    """Every `ffc-id` command that a page shows as a block."""
    refused = [command for command, _ in refusals(page)]
    return [command for block in _blocks(page) for command in commands_in(block) if command not in refused]


def refusals(page: Path) -> list[tuple[list[str], str]]:
    """Commands that a page shows to be refused, and what it says they are answered with."""
    blocks = [[line.strip() for line in block.splitlines()] for block in _blocks(page)]
    return [
        (command, answer.removeprefix(_TOLD))
        for lines in blocks
        for line, answer in itertools.pairwise(lines)
        if answer.startswith(_TOLD)
        for command in commands_in(line)
    ]


def _blocks(page: Path) -> list[str]:
    return [fence.text for fence in fences(page)] + ["\n".join(indented(page))]


def mentioned(page: Path) -> list[list[str]]:
    """Every `ffc-id` command that a page names in running text."""
    return [words[1:] for text in _INLINE.findall(_prose(page)) if (words := shell_words(text))]


def links(page: Path) -> list[str]:
    """What a page links to inside the project."""
    return [link for link in _LINK.findall(_prose(page)) if "://" not in link]


def _prose(page: Path) -> str:
    return FENCE.sub("", page.read_text(encoding="utf-8"))


def parse(words: list[str], *, whole: bool) -> None:
    """Read a command as the program does, without running it.

    Args:
        words: what follows `ffc-id`.
        whole: also require what the command requires; a mention in a sentence may leave things out.

    Raises:
        click.UsageError: no such command or option, a wrong choice, something missing or left over.
    """
    command: click.Command = ffc_id
    context = click.Context(command, info_name="ffc-id")
    rest = list(words)
    while isinstance(command, click.Group) and rest and not rest[0].startswith("-"):
        name = rest.pop(0)
        below = command.get_command(context, name)
        if below is None:
            raise click.UsageError(f"no command {name!r}", context)
        command, context = below, click.Context(below, info_name=name, parent=context)
    values, left, _ = command.make_parser(context).parse_args(rest)
    if left and not isinstance(command, click.Group):
        raise click.UsageError(f"left over: {left}", context)
    for parameter in command.params:
        value = values.get(parameter.name or "")
        given = value is not None and repr(value) != "Sentinel.UNSET" and value != ()
        if given and isinstance(parameter.type, click.Choice):
            parameter.type.convert(str(value), parameter, context)
        if whole and parameter.required and not given and not {"-h", "--help"} & set(rest):
            raise click.MissingParameter(ctx=context, param=parameter)
