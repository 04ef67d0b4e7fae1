"""The program in a terminal and in a pipe: help, widths, colours, progress, misspelt words."""

from __future__ import annotations

import json
import os
import re
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import pytest
from idtool.cli.commands import ffc_id as group

from idtool import Axis, Parameters, __version__
from idtool.parameters import EffectEntry, Parameter
from testbench.fleet import session

from .support import PROGRAM, ffc_id
from .terminal import Terminal

_ESCAPE = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")
#: A colour: 30 to 49 and 90 to 107, alone or after others.
_COLOUR = re.compile(r"\x1b\[(?:[0-9]+;)*(?:3[0-9]|4[0-9]|9[0-7]|10[0-7])[0-9;]*m")
#: What a fit is at; on so short a log the one or the other is over before the screen is drawn anew.
_STAGE = re.compile("reading the motion|searching the friction parameters")
#: Commands that compute nothing, or only print what others read.
_NO_JSON = {"ffc-id", "ffc-id recipes show", "ffc-id completion", "ffc-id data", "ffc-id export"}


def commands() -> Iterator[tuple[str, click.Command]]:
    """Every command with its path, sub-commands too."""

    def walk(path: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
        yield path, command
        if isinstance(command, click.Group):
            context = click.Context(command)
            for name in command.list_commands(context):
                below = command.get_command(context, name)
                assert below is not None
                yield from walk(f"{path} {name}", below)

    yield from walk("ffc-id", group)


COMMANDS = dict(commands())


@pytest.mark.parametrize("path", COMMANDS)
def test_help_has_an_example(path: str) -> None:
    examples = [line for line in (COMMANDS[path].help or "").splitlines() if line.strip().startswith(path)]
    shown = "ffc-id completion" if path == "ffc-id completion" else path
    assert examples or f"$({shown}" in (COMMANDS[path].help or "")
    # it is not folded: a person copies it whole
    printed = ffc_id(*path.split()[1:], "--help")
    assert printed.returncode == 0
    for example in examples:
        assert example.strip() in printed.stdout


@pytest.mark.parametrize("path", COMMANDS)
def test_examples_use_options_that_exist(path: str) -> None:
    for line in (COMMANDS[path].help or "").splitlines():
        words = line.strip().split("   ")[0].split()
        if words[:1] != ["ffc-id"]:
            continue
        depth = max(n for n in range(1, len(words) + 1) if " ".join(words[:n]) in COMMANDS)
        command = COMMANDS[" ".join(words[:depth])]
        known = {name for option in command.params for name in option.opts}
        assert {word for word in words[depth:] if re.match(r"--?[a-z]", word)} <= known | {"--help"}


def test_every_command_that_computes_has_json() -> None:
    without = {path for path, command in COMMANDS.items() if "--json" not in options(command)}
    assert without == _NO_JSON


def options(command: click.Command) -> set[str]:
    return {name for option in command.params for name in option.opts}


def test_version() -> None:
    assert ffc_id("--version").stdout == f"ffc-id {__version__}\n"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two parameter files, one level apart, with a long effect name."""
    folder = tmp_path_factory.mktemp("files")

    def one(value: float) -> Parameter:
        return Parameter(value, 0.01 * value, (0.98 * value, 1.02 * value))

    a = Parameters(
        axis=Axis("rotary", 2.67),
        gravity_model="slide",
        gravity={"base": one(0.2), "per_payload": one(0.42)},
        static={
            name: one(value)
            for name, value in zip(
                ("coulomb", "static", "stribeck_velocity", "viscous"), (0.08, 0.115, 0.08, 0.12), strict=True
            )
        },
        dynamic={
            "bristle_stiffness": Parameter(8.0, None, (1.0, 90.0), at_bound=True, identified=False),
            "bristle_damping": one(0.2),
        },
        effects=(EffectEntry("load_dependent_friction", {"mu": one(0.05)}),),
    )
    a.write(folder / "a.toml")
    replace(a, static=a.static | {"coulomb": one(0.1)}).write(folder / "b.toml")
    return folder


def screen(*arguments: str, columns: int, cwd: Path, **environment: str) -> str:
    """What a person sees, control characters included."""
    with Terminal([PROGRAM, *arguments], columns=columns, cwd=cwd, environment=environment) as terminal:
        assert terminal.finish(120) == 0
        seen: str = terminal.seen
    return seen


@pytest.mark.long
@pytest.mark.parametrize(
    "arguments",
    [
        ["compare", "a.toml", "b.toml"],
        ["rigs"],
        ["recipes"],
        ["tune", "-p", "t.toml", "--hand-force", "4", "--write"],
    ],
    ids=lambda words: words[0],
)
def test_no_width_cuts_anything_off(arguments: list[str], files: Path) -> None:
    def seen(columns: int) -> str:
        (files / "t.toml").write_text((files / "a.toml").read_text())
        return _ESCAPE.sub("", screen(*arguments, columns=columns, cwd=files))

    wide = seen(300)
    for columns in (40, 80):
        narrow = seen(columns)
        # a command to copy stays on one line
        lines = [line for line in narrow.splitlines() if not line.startswith("next: ")]
        assert max(map(len, lines)) <= columns
        assert "…" not in narrow
        # every number and word of the wide screen is there, whatever its place
        assert set(re.findall(r"[\w.]+", wide)) - set(re.findall(r"[\w.]+", narrow)) <= headings(wide)


def headings(text: str) -> set[str]:
    """Words of a table's head, which a narrow screen has on every line or not at all."""
    return {"parameter", "readings", "late", "by"} & set(text.split())


def test_a_pipe_gets_plain_lines_that_are_not_folded(files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    done = subprocess.run(
        [PROGRAM, "compare", "a.toml", "b.toml"],
        env=dict(os.environ),  # without the COLUMNS that readline sets behind Python's back
        cwd=files,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (
        0,
        "next: ffc-id run --recipe validation --rig SPEC -o validation.csv\n",
    )
    assert "\x1b" not in done.stdout
    first = done.stdout.splitlines()[0]
    assert first.startswith("1 of 8 parameters differs beyond its uncertainty: coulomb is 25 % higher in B")
    assert first.endswith("(0.08 to 0.1 N m).")
    assert any(re.match(r"coulomb .* differs", line) for line in done.stdout.splitlines())
    document = json.loads(ffc_id("compare", "a.toml", "b.toml", "--json", cwd=files).stdout)
    assert document["schema"] == "ffc-id/comparison/1"
    assert [line["name"] for line in document["parameters"] if line["differs"]] == ["coulomb"]
    assert (document["verdict"], document["sentence"]) == ("different", first)


def test_compare_refuses_what_cannot_be_compared(files: Path) -> None:
    Parameters(axis=Axis("linear", 35.0)).write(files / "linear.toml", force=True)
    for arguments, expected in (
        (["a.toml", "linear.toml"], "ffc-id: A is of a rotary axis and B of a linear axis"),
        (["a.toml", "no.toml"], "ffc-id: no.toml: no such file"),
        (["a.toml", "b.toml", "no.csv"], "ffc-id: no.csv: no such file"),
    ):
        done = ffc_id("compare", *arguments, cwd=files)
        assert (done.returncode, done.stdout) == (3, "")
        assert done.stderr.startswith(expected)
        assert len(done.stderr.splitlines()) == 1
    assert ffc_id("compare", "a.toml", cwd=files).returncode == 2


_RUN = ("run-sine", "--rig", "sim:bench", "--force", "-o")


def test_progress_says_how_long_it_will_take(tmp_path: Path) -> None:
    seen = screen(*_RUN, "log.csv", columns=100, cwd=tmp_path)
    assert re.search(r"\d+ % .*trial \d of 4, \d+ s of rig time left \(wait \d+ s\)", seen)
    told = "log.csv: 11400 rows, 4 trials, 63 s of rig time on sim:bench (simulated)"
    assert told in _ESCAPE.sub("", seen)
    narrow = screen(*_RUN, "log.csv", columns=40, cwd=tmp_path)
    assert re.search(r"trial \d of 4, \d+ s left", narrow)
    assert screen(*_RUN, "log.csv", "-q", columns=100, cwd=tmp_path) == ""
    piped = ffc_id(*_RUN, "log.csv", cwd=tmp_path)
    assert (piped.returncode, piped.stderr) == (0, "next: ffc-id check log.csv\n")


@pytest.mark.long
def test_identify_shows_what_it_does_only_in_a_terminal(tmp_path: Path) -> None:
    session(tmp_path / "one")
    quick = ("--friction", "coulomb", "--gravity", "none")
    words = ("identify", "one/sine.csv", *quick, "-o", "result", "--force")
    seen = screen(*words, columns=60, cwd=tmp_path)
    assert _STAGE.search(seen)
    assert "drawing the report" in seen
    assert _COLOUR.search(seen)
    uncoloured = screen(*words, columns=60, cwd=tmp_path, NO_COLOR="1")
    assert _STAGE.search(uncoloured)
    assert not _COLOUR.search(uncoloured)
    done = ffc_id(*words, cwd=tmp_path)
    assert done.returncode == 0
    assert done.stderr.startswith("next: ffc-id ")
    assert done.stderr.count("\n") == 1
    assert "\x1b" not in done.stdout


def test_a_terminal_without_greek_letters_gets_question_marks(files: Path) -> None:
    done = subprocess.run(
        [PROGRAM, "compare", "a.toml", "b.toml"],
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        cwd=files,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (
        0,
        "next: ffc-id run --recipe validation --rig SPEC -o validation.csv\n",
    )
    assert "B ? A" in done.stdout


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["identifi"], 'no command "identifi"; did you mean "identify"?'),
        (["identify", "x.csv", "--seeed", "1"], 'no option "--seeed"; did you mean "--seed"?'),
        (["export", "mujco"], 'no command "mujco"; did you mean "mujoco"?'),
        (["recipes", "shw"], 'no command "shw"; did you mean "show"?'),
        (["identify", "--tork-constant", "2"], 'did you mean "--torque-constant"?'),
        (["identify", "x.csv", "-o", "r", "--friction", "lugr"], 'did you mean "lugre"?'),
        (["identify", "x.csv", "-o", "r", "--gravity", "slyde"], 'did you mean "slide"?'),
        (["identify", "x.csv", "-o", "r", "--optimizer", "driect"], 'did you mean "direct"?'),
        (["completion", "bsh"], 'did you mean "bash"?'),
        (["import", "x.csv", "-o", "y.csv", "--kind", "liner"], 'did you mean "linear"?'),
        (["recipes", "show", "swep"], 'did you mean "sweep"?'),
        (["run", "--recipe", "swep", "-o", "x.csv"], 'did you mean "sweep"?'),
        (["run-sine", "--rig", "sim:papr", "-o", "x.csv"], 'did you mean "paper"?'),
        (["run-sine", "--rig", "dynamixl:/dev/x", "-o", "x.csv"], 'did you mean "dynamixel:/dev/x"?'),
        (["virtual-servo", "--plant", "papr"], 'did you mean "paper"?'),
        (["virtual-servo", "--fault", "slent@2"], 'did you mean "silent@SECONDS"?'),
        (
            [
                "export",
                "c",
                "-p",
                "a.toml",
                "-o",
                "b",
                "--any-position",
                "--without",
                "load_dependant_friction",
            ],
            'did you mean "load_dependent_friction"?',
        ),
        (["import", "a.csv", "-o", "y.csv", "--unit", "positon=deg"], 'did you mean "position"?'),
        (["compare", "misspelt.toml", "a.toml"], 'did you mean "friction"?'),
    ],
)
def test_a_misspelt_word_is_answered_with_the_nearest(words: list[str], expected: str, files: Path) -> None:
    (files / "a.csv").write_text("time_s,position,current_a\n0,0,1\n1,1,2\n")
    (files / "misspelt.toml").write_text((files / "a.toml").read_text().replace("friction.", "fricton."))
    done = ffc_id(*words, cwd=files)
    assert done.returncode in (2, 3)
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
