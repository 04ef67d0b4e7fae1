"""Numbers of options: NaN is none, for every option of every command."""

from __future__ import annotations

from collections.abc import Iterator

import click
import pytest
from idtool.cli.commands import ffc_id
from idtool.cli.main import main
from idtool.cli.numbers import Number, NumberRange


def commands(group: click.Group, context: click.Context) -> Iterator[click.Command]:
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        yield command
        if isinstance(command, click.Group):
            yield from commands(command, context)


def test_every_number_of_an_option_is_finite() -> None:
    """NaN passed every range: with `--contact nan` no contact was felt, with `--idle nan` no axis held."""
    every = [*commands(ffc_id, click.Context(ffc_id))]
    floats = [
        (command.name, option.name, option.type)
        for command in every
        for option in command.params
        if isinstance(option.type, click.types.FloatParamType)
    ]
    assert len(floats) > 30
    assert not [one for one in floats if not isinstance(one[2], Number | NumberRange)]


@pytest.mark.parametrize(
    "arguments",
    [
        "play taught.csv --rig sim:bench --contact nan",
        "play taught.csv --rig sim:bench --speed nan",
        "teach -p params.toml --rig sim:bench --idle nan",
        "teach -p params.toml --rig sim:bench --payload inf",
        "teach -p params.toml --rig sim:bench --tilt nan 0",
        "virtual-servo --payload nan",
        "virtual-servo --tilt 0 nan",
    ],
)
def test_one_that_is_not_is_a_mistake(arguments: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments.split())
    told = capsys.readouterr().err
    assert stop.value.code == 2
    assert "is no finite number" in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        "play t.csv --speed 1e-300",
        "tune -p p.toml --hand-force 2 --period 1e-300",
        "tune -p p.toml --hand-force 1e300",
        "tune -p p.toml --hand-force 2 --speed 1e300",
        "tune -p p.toml --hand-force 2 --lever 1e300",
    ],
)
def test_what_would_take_for_ever_or_no_hand_does_is_one_too(
    arguments: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(arguments.split())
    assert stop.value.code == 2
    assert "is not in the range" in capsys.readouterr().err
