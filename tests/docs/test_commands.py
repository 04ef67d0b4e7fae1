"""What the documentation says of commands is what the program has."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

from pages.commands import PAGE, commands, option_names, page
from pages.markdown import commands_in

from .support import PAGES, PROJECT, every_command, mentioned, page_id, parse, refusals

EVERY = {name: command for name, command, _ in commands()}


def test_the_page_of_commands_is_up_to_date() -> None:
    written = (PROJECT / PAGE).read_text(encoding="utf-8")
    assert written == page(), "run `make docs-commands`"


@pytest.mark.parametrize("name", EVERY)
def test_every_command_and_option_has_its_line(name: str) -> None:
    text = (PROJECT / PAGE).read_text(encoding="utf-8")
    _, found, section = text.partition(f"## ffc-id {name}\n")
    assert found
    section = section.split("\n## ")[0]
    for parameter in EVERY[name].params:
        for option in option_names(parameter):
            assert f"`{option}`" in section, option


@pytest.mark.parametrize("name", EVERY)
def test_every_option_says_what_it_does(name: str) -> None:
    """Only what --help shows can be looked up."""
    for parameter in EVERY[name].params:
        if isinstance(parameter, click.Option) and not parameter.hidden:
            assert parameter.help, parameter.opts


@pytest.mark.parametrize("name", EVERY)
def test_every_command_is_told_about_outside_its_reference(name: str) -> None:
    pages = [p for p in PAGES if p != PROJECT / PAGE]
    told = [words for p in pages for words in (*every_command(p), *mentioned(p))]
    assert any(words[: len(name.split())] == name.split() for words in told)


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_every_command_shown_is_one(page: Path) -> None:
    for words in every_command(page):
        try:
            parse(words, whole=True)
        except click.UsageError as error:
            pytest.fail(f"ffc-id {' '.join(words)}: {error.format_message()}")


@pytest.mark.parametrize("page", PAGES, ids=page_id)
def test_every_command_named_in_a_sentence_is_one(page: Path) -> None:
    for words in mentioned(page):
        try:
            parse(words, whole=False)
        except click.UsageError as error:
            pytest.fail(f"ffc-id {' '.join(words)}: {error.format_message()}")


@pytest.mark.parametrize(
    "wrong",
    [
        "ffc-id identfy a.csv -o result",
        "ffc-id identify a.csv -o result --frction coulomb",
        "ffc-id identify a.csv -o result --friction columb",
        "ffc-id identify a.csv",
        "ffc-id report one two",
        "ffc-id export d -p params.toml -o board",
    ],
)
def test_the_check_sees_mistakes(wrong: str) -> None:
    (words,) = commands_in(wrong)
    with pytest.raises(click.UsageError):
        parse(words, whole=True)


def test_commands_are_found_as_people_write_them() -> None:
    block = """
$ ffc-id rigs --scan                  which servos are there
ffc-id recipes show sweep > mine.toml   # to edit
ffc-id identify a.csv \\
    -o result && echo done
it's no command
"""
    assert commands_in(block) == [
        ["rigs", "--scan"],
        ["recipes", "show", "sweep"],
        ["identify", "a.csv", "-o", "result"],
    ]


def test_a_mistake_is_answered_as_shown() -> None:
    shown = [refusal for page in PAGES for refusal in refusals(page)]
    assert shown
    for words, answer in shown:
        with pytest.raises(click.UsageError) as raised:
            parse(words, whole=True)
        assert raised.value.format_message() == answer
