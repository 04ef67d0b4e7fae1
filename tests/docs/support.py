"""Reading the documentation: its pages, the commands in it, its links."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import click
from idtool.cli.main import ffc_id

PROJECT = Path(__file__).resolve().parents[2]
PAGES = [PROJECT / "README.md", *sorted((PROJECT / "docs").rglob("*.md"))]

_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_INLINE = re.compile(r"`(ffc-id [^`]+)`")
_LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
_ASIDE = re.compile(r" {4,}(?=[a-z])")
#: Where a command of the shell ends.
_ENDS = {"|", ">", ">>", "2>", "&&", "||", ";", "&"}


def page_id(page: Path) -> str:
    """The page as a test names it."""
    return page.relative_to(PROJECT).as_posix()


@dataclass(frozen=True)
class Fence:
    """A fenced block: its language, its text, and the line of the page at which it starts."""

    language: str
    text: str
    line: int


def fences(page: Path) -> list[Fence]:
    """Every fenced block of a page."""
    text = page.read_text(encoding="utf-8")
    return [Fence(m[1], m[2], text.count("\n", 0, m.start()) + 1) for m in _FENCE.finditer(text)]


def indented(page: Path) -> list[str]:
    """Lines of blocks that are indented instead of fenced."""
    return [line for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("    ")]


def commands_in(block: str) -> list[list[str]]:
    """The words after `ffc-id` of every such command in a block, without prompt, comment and redirection."""
    found = []
    for line in block.replace("\\\n", " ").splitlines():
        words = shell_words(line.strip().removeprefix("$ "))
        if words[:1] == ["ffc-id"]:
            found.append(words[1:])
    return found


def shell_words(line: str) -> list[str]:
    """The words of the first command of a line; none where it is not one.

    What stands four spaces or more behind a command, as in a help text, says what it does.
    """
    try:
        words = shlex.split(_ASIDE.split(line)[0], comments=True)
    except ValueError:  # an apostrophe in prose
        return []
    end = next((k for k, word in enumerate(words) if word in _ENDS), len(words))
    return words[:end]


def every_command(page: Path) -> list[list[str]]:
    """Every `ffc-id` command that a page shows as a block."""
    blocks = [fence.text for fence in fences(page)] + ["\n".join(indented(page))]
    return [command for block in blocks for command in commands_in(block)]


def mentioned(page: Path) -> list[list[str]]:
    """Every `ffc-id` command that a page names in running text."""
    return [words[1:] for text in _INLINE.findall(_prose(page)) if (words := shell_words(text))]


def links(page: Path) -> list[str]:
    """What a page links to inside the project."""
    return [link for link in _LINK.findall(_prose(page)) if "://" not in link]


def _prose(page: Path) -> str:
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


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
