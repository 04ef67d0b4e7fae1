"""Completion: what Tab offers, and that bash, zsh and fish really do it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest
from idtool.cli.words import complete_rig, effect_names, recipe_names, rig_names

from idtool.effects import registry
from idtool.experiment.recipe import recipe_names as recipes
from idtool.rig import named_rigs

from .support import PROGRAM
from .terminal import Terminal

#: readline's own
WORD_BREAKS = " \t\n\"'><=;|&(:"
#: A program that fails if anything wants to compute.
_LIGHT = (
    "import sys\n"
    "for name in ('numpy', 'pandas', 'scipy', 'numba', 'matplotlib', 'rich'): sys.modules[name] = None\n"
    "from idtool.cli.main import main; main()"
)


def offered(line: str, cwd: Path) -> list[str]:
    """What bash is told at Tab behind `line`: words, or "<file>"."""
    done = subprocess.run(
        [sys.executable, "-c", _LIGHT],
        env={
            **os.environ,
            "_FFC_ID_COMPLETE": "bash_complete",
            "COMP_LINE": line,
            "COMP_WORDBREAKS": WORD_BREAKS,
        },
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    items = [item.split(",", 1) for item in done.stdout.split()]
    return [value if kind == "plain" else f"<{kind}>" for kind, value in items]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("ffc-id run-s", ["run-sweep", "run-sine"]),
        ("ffc-id export ", ["c", "mujoco", "isaac", "urdf", "ros2", "json", "bam", "cogging"]),
        ("ffc-id export m", ["mujoco"]),
        ("ffc-id recipes ", ["list", "show"]),
        ("ffc-id recipes show p", ["pauses"]),
        ("ffc-id run-sine --torq", []),
        ("ffc-id identify --torq", ["--torque-constant"]),
        ("ffc-id identify --friction ", ["lugre", "stribeck", "coulomb"]),
        ("ffc-id identify --friction=st", ["stribeck"]),
        ("ffc-id identify ", ["<file>"]),
        (
            "ffc-id run-sine --rig ",
            ["sim:bench", "sim:paper", "sim:sts3215", "dynamixel:", "feetech:", "replay:"],
        ),
        # bash takes sim for a word of its own and wants what follows the colon
        ("ffc-id run-sine --rig sim:p", ["paper", "plants/"]),
        ("ffc-id run-sine --rig=sim:pa", ["paper"]),
        ("ffc-id run-sine --rig sim:plants/", ["plants/mine.toml"]),
        ("ffc-id run-sine --rig replay:", ["plants/", "run.csv"]),
        ("ffc-id run --recipe pa", ["pauses"]),
        ("ffc-id run --recipe plants/m", ["plants/mine.toml"]),
        ("ffc-id virtual-servo --plant b", ["bench"]),
        ("ffc-id export c --without position_r", ["position_ripple"]),
        ("ffc-id completion ", ["bash", "zsh", "fish"]),
        ("ffc-id nothing --x", []),
    ],
)
def test_tab_offers(line: str, expected: list[str], tmp_path: Path) -> None:
    (tmp_path / "plants").mkdir()
    (tmp_path / "plants" / "mine.toml").touch()
    (tmp_path / "run.csv").touch()
    (tmp_path / ".hidden.toml").touch()
    assert offered(line, tmp_path) == expected


def test_the_words_are_those_of_the_package() -> None:
    assert effect_names() == sorted(registry.names())
    assert recipe_names() == sorted(recipes())
    assert [f"sim:{name}" for name in rig_names()] == sorted(named_rigs())


_START = {
    "bash": (["bash", "--norc", "--noprofile", "-i"], 'eval "$(ffc-id completion bash)"'),
    "zsh": (
        ["zsh", "-f", "-i"],
        'autoload -Uz compinit; compinit -u -D; eval "$(ffc-id completion zsh)"',
    ),
    "fish": (["fish", "--no-config", "-i"], "ffc-id completion fish | source"),
}


@pytest.mark.parametrize("shell", _START)
def test_a_real_shell_completes(shell: str, tmp_path: Path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    command, install = _START[shell]
    path = f"{PROGRAM.parent}{os.pathsep}{os.environ['PATH']}"
    with Terminal(command, cwd=tmp_path, environment={"PATH": path, "HOME": str(tmp_path)}) as screen:
        # the word comes from the shell, not from the echo of what was typed
        screen.send(f'{install}; echo rea""dy\n')
        screen.until("ready")
        screen.send("ffc-id recipes sh\tsw\t")
        screen.until("sweep")
        screen.send("\n")
        screen.until('experiment = "sweep"')
        screen.send("ffc-id rigs --js\t")
        screen.until("--json")
        screen.send("\n")
        screen.until('"sim:paper"')
        screen.send("ffc-id run-sine --rig sim:pa\t")
        screen.until("sim:paper")
        screen.send('-o sine.csv -q; echo do""ne\n')
        screen.until("done", timeout=120)
    assert (tmp_path / "sine.csv").read_text().startswith("# ffc-id-log = 1")


@pytest.mark.parametrize("shell", _START)
def test_the_script_says_how_to_install_it(shell: str) -> None:
    done = subprocess.run(
        [PROGRAM, "completion", shell], capture_output=True, text=True, timeout=60, check=True
    )
    first, second, *_ = done.stdout.splitlines()
    # zsh wants its directive first
    line = second if shell == "zsh" else first
    assert line.startswith("# To install it, ")
    assert f"ffc-id completion {shell}" in line


@pytest.mark.parametrize("bus", ["dynamixel", "feetech"])
def test_the_serial_devices_are_those_of_the_machine(bus: str, monkeypatch: pytest.MonkeyPatch) -> None:
    devices = {"ttyUSB*": ["/dev/ttyUSB0"], "ttyACM*": ["/dev/ttyACM1"]}
    monkeypatch.setattr(Path, "glob", lambda _, mask: map(Path, devices[mask]))
    context, parameter = click.Context(click.Command("run")), click.Option(["--rig"])
    for typed, expected in (("", ["/dev/ttyACM1", "/dev/ttyUSB0"]), ("/dev/ttyU", ["/dev/ttyUSB0"])):
        found = complete_rig(context, parameter, f"{bus}:{typed}")
        assert [item.value for item in found] == [f"{bus}:{device}" for device in expected]
