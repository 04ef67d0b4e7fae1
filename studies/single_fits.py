"""Whether fit-gravity, fit-static and fit-dynamic say so where their model lacks something.

Every session is of an axis with one effect that no fit is told of: a random axis of our simulated rig, or one
of `testbench/other_plants`, which shares no code with it. The three commands run one after another on the
runs that they are for, as a new user would run them. A number is honest if its 95 % interval holds the
truth, if it is told as not found, or if the command says that its model lacks something.

python -m studies.single_fits [--each N] [--out docs/accuracy.md]      (make study-single_fits)
"""

from __future__ import annotations

import json
import tempfile
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
from click.testing import CliRunner

from idtool.cli.main import main as program
from pages.markdown import with_made
from testbench.cases import EFFECTS, draw_effects
from testbench.other_plants.effects import EFFECTS as OTHER_EFFECTS
from testbench.other_plants.session import NoSuchSessionError, make
from testbench.plants import SESSION, either_bristle, random_plant, record_session

#: Command -> its part of the parameter file, and the runs of the other axes that show it, best first.
_PARTS = {"fit-gravity": "gravity", "fit-static": "static", "fit-dynamic": "dynamic"}
_OTHER_RUNS = {
    "fit-gravity": ("payloads", "slow_sweep"),
    "fit-static": ("speeds",),
    "fit-dynamic": ("sines",),
}
_DYNAMIC = ("bristle_stiffness", "bristle_damping")
#: What the commands say of a model that lacks something.
_WARNING = "the model lacks something"


@dataclass(frozen=True)
class Session:
    """Logs in a folder, and the truth of the axis by the names of the parameter file.

    Attributes:
        logs: command -> its log.
        truth: no entry for what such an axis does not have.
    """

    logs: dict[str, Path]
    truth: dict[str, float]


@dataclass(frozen=True)
class Told:
    """What one command said of one axis.

    Attributes:
        axes, effect, command: whose, which and by which command.
        off: parameters whose interval excludes the truth though they are told as found.
        checked: how many were compared.
        warned: whether it said that its model lacks something.
        refused: its sentence, if it gave no number.
    """

    axes: str
    effect: str
    command: str
    off: tuple[str, ...]
    checked: int
    warned: bool
    refused: str = ""

    @property
    def honest(self) -> bool:
        """Nobody is misled."""
        return not self.off or self.warned or bool(self.refused)


def ours(effect: str, number: int, folder: Path) -> Session:
    """A random axis of the simulated rig with that effect."""
    seed = zlib.crc32(repr(("single fits", effect, number)).encode())
    rng = np.random.default_rng(seed)
    plant = either_bristle(random_plant(rng), rng)
    sensors = ("lab", "dynamixel")[number % 2]
    plant = draw_effects(plant, (effect,), rng, sensors, SESSION).plant
    logs = {}
    for command, log in zip(_PARTS, _in_order(record_session(plant, sensors, seed)), strict=True):
        logs[command] = folder / f"{command}.csv"
        log.write(logs[command])
    names = ("base", "per_payload", "coulomb", "static", "stribeck_velocity", "viscous", *_DYNAMIC)
    return Session(logs, {name: getattr(plant, name) for name in names})


def _in_order(logs: Sequence[object]) -> Sequence[object]:
    return logs


def other(effect: str, number: int, folder: Path) -> Session:
    """An axis of the others with that effect."""
    session = make("session", (effect,), zlib.crc32(repr(("single fits", effect, number)).encode()))
    numbers, law = session.truth["numbers"], session.truth["friction_law"]
    logs = {}
    for command, runs in _OTHER_RUNS.items():
        run = next((run for run in runs if run in session.logs), None)
        if run is not None:
            logs[command] = folder / f"{run}.csv"
            logs[command].write_text(session.logs[run], encoding="utf-8")
    names = {"base": "base", "per_payload": "per_payload", "sin": "sine", "cos": "cosine"}
    names |= {name: name for name in ("coulomb", "static", "stribeck_velocity", "viscous")}
    if law == "LuGre":
        names |= {"bristle_stiffness": "stiffness", "bristle_damping": "damping"}
    return Session(logs, {mine: numbers[its] for mine, its in names.items() if its in numbers})


def told(axes: str, effect: str, session: Session, folder: Path) -> Iterator[Told]:
    """What the three commands say, one after another into one file."""
    params = folder / "params.toml"
    for command, log in session.logs.items():
        done = CliRunner().invoke(program, [command, str(log), "-p", str(params), "--json"])
        if done.exit_code:
            yield Told(axes, effect, command, (), 0, False, done.stderr.strip() or repr(done.exception))
            continue
        document = json.loads(done.stdout)
        checked, off = 0, []
        for name, value in _numbers(document["parameters"]):
            if name not in session.truth or not value.get("identified") or not value.get("ci95"):
                continue
            checked += 1
            low, high = value["ci95"]
            if not low <= session.truth[name] <= high:
                off.append(name)
        warned = any(_WARNING in note for note in document["notes"])
        yield Told(axes, effect, command, tuple(off), checked, warned)


def _numbers(table: Mapping[str, object]) -> Iterator[tuple[str, Mapping[str, object]]]:
    """Every parameter under its name without the unit."""
    for name, value in table.items():
        if isinstance(value, Mapping) and "value" in value:
            yield name, value
        elif isinstance(value, Mapping):
            yield from _numbers(value)


def study(each: int, effects: Sequence[str] = ()) -> list[Told]:
    """So many sessions of each effect on either kind of axis."""
    found = []
    for axes, names, build in (("ours", EFFECTS, ours), ("other", OTHER_EFFECTS, other)):
        for effect in names:
            if effects and effect not in effects:
                continue
            for number in range(each):
                with tempfile.TemporaryDirectory() as name:
                    folder = Path(name)
                    try:
                        session = build(effect, number, folder)
                    except NoSuchSessionError:
                        continue
                    found += told(axes, effect, session, folder)
                    for one in found[-len(session.logs) :]:
                        click.echo(str(one), err=True)
    return found
