"""Whether fit-gravity, fit-static and fit-dynamic say so where their model lacks something.

Every session is of an axis with one effect that no fit is told of: a random axis of our simulated rig, or one
of `testbench/other_plants`, which shares no code with it. The three commands run one after another on the
runs that they are for, as a new user would run them. A number is honest if its 95 % interval holds the
truth, if it is told as not found, or if the command says that its model lacks something.

python -m studies.partial [--each N] [--out docs/accuracy.md]      (make study-partial)
"""

from __future__ import annotations

import json
import os
import tempfile
import zlib
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import click
import numpy as np
from click.testing import CliRunner
from idtool.cli.commands import ffc_id

from idtool.errors import InputError
from idtool.log import Log
from idtool.parameters import Parameters
from pages import markdown
from testbench.cases import EFFECTS, draw_effects
from testbench.other_plants.effects import EFFECTS as OTHER_EFFECTS
from testbench.other_plants.physics import Axis
from testbench.other_plants.physics import warmth as warmth_of
from testbench.other_plants.session import NoSuchSessionError, make
from testbench.plants import SESSION, either_bristle, random_plant, record_session

_PAGE = "docs/accuracy.md"
#: In the order of the runs of a session; and the runs of the other axes that are for each, best first.
_COMMANDS = ("fit-gravity", "fit-static", "fit-dynamic")
_OTHER_RUNS = {
    "fit-gravity": ("payloads", "slow_sweep"),
    "fit-static": ("speeds",),
    "fit-dynamic": ("sines",),
}
_AXES = ("ours", "other")
_DYNAMIC = ("bristle_stiffness", "bristle_damping")
#: An axis without an effect, of which there are so many for each with one.
NONE, _NONE = "none", 3
#: What the commands say of a model that lacks something.
_AMBIENT = 25.0
_WARNING = "the model lacks something"
_WITH_OFFSET = "the base includes any constant torque"
#: What that sentence says of an effect, which a log at one tilt cannot show.
_TOLD = {"torque_offset": ("base",), "tilt_misalignment": ("base", "per_payload")}


@dataclass(frozen=True)
class Session:
    """Logs in a folder, and the truth of the axis by the names of the parameter file.

    Attributes:
        logs: command -> its log.
        truth: no entry for what such an axis does not have.
        warmth: command -> what its friction is of that of the cold axis, over its log.
    """

    logs: dict[str, Path]
    truth: dict[str, float]
    warmth: dict[str, float]

    def truth_of(self, name: str, command: str) -> float:
        """The truth while that log was recorded; a warm axis has less friction."""
        warm = name in ("coulomb", "static", "viscous")
        return self.truth[name] * (self.warmth.get(command, 1.0) if warm else 1.0)


@dataclass(frozen=True)
class Told:
    """What one command said of one axis.

    Attributes:
        axes, effect, command: whose, which and by which command.
        off: parameters whose interval excludes the truth though they are told as found.
        checked: how many were compared.
        warned: whether it said that its model lacks something.
        with_offset: whether it said what a log at one tilt cannot show.
        refused: its sentence, if it gave no number.
    """

    axes: str
    effect: str
    command: str
    off: tuple[str, ...]
    checked: int
    warned: bool
    with_offset: bool = False
    refused: str = ""

    @property
    def honest(self) -> bool:
        """Nobody is misled."""
        told = set(_TOLD.get(self.effect, ())) if self.with_offset else set()
        return set(self.off) <= told or self.warned or bool(self.refused)


def ours(effect: str, number: int, folder: Path) -> Session:
    """A random axis of the simulated rig with that effect."""
    seed = zlib.crc32(repr(("single fits", effect, number)).encode())
    rng = np.random.default_rng(seed)
    plant = either_bristle(random_plant(rng), rng)
    sensors = ("lab", "dynamixel")[number % 2]
    plant = draw_effects(plant, () if effect == NONE else (effect,), rng, sensors, SESSION).plant
    logs = {}
    for command, log in zip(_COMMANDS, record_session(plant, sensors, seed), strict=True):
        logs[command] = folder / f"{command}.csv"
        log.write(logs[command])
    names = ("base", "per_payload", "coulomb", "static", "stribeck_velocity", "viscous", *_DYNAMIC)
    truth = {name: getattr(plant, name) for name in names}
    rate = plant.effects.get("thermal_drift", {}).get("rate_per_k", 0.0)
    warm = {command: Log.read(log).frame["temperature_degc"] - _AMBIENT for command, log in logs.items()}
    return Session(logs, truth, {command: float(np.mean(np.exp(-rate * by))) for command, by in warm.items()})


def other(effect: str, number: int, folder: Path) -> Session:
    """An axis of the others with that effect."""
    session = make(
        "session",
        () if effect == NONE else (effect,),
        zlib.crc32(repr(("single fits", effect, number)).encode()),
    )
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
    truth = {mine: numbers[its] for mine, its in names.items() if its in numbers}
    axis = Axis(**numbers)
    times = {command: Log.read(log).frame["time_s"] for command, log in logs.items()}
    warmth = {command: float(np.mean([warmth_of(axis, t) for t in time])) for command, time in times.items()}
    return Session(logs, truth, warmth)


def told(axes: str, effect: str, session: Session, folder: Path) -> Iterator[Told]:
    """What the three commands say, one after another into one file."""
    params = folder / "params.toml"
    for command, log in session.logs.items():
        done = CliRunner().invoke(ffc_id, [command, str(log), "-p", str(params), "--json"])
        if isinstance(done.exception, InputError):
            yield Told(axes, effect, command, (), 0, False, refused=str(done.exception))
            continue
        if done.exception is not None:
            raise done.exception
        notes = json.loads(done.stdout)["notes"]
        found = {
            name: one.ci95
            for name, one in getattr(Parameters.read(params), command.removeprefix("fit-")).items()
            if name in session.truth and one.identified and one.ci95 is not None
        }
        off = tuple(n for n, (low, high) in found.items() if not low <= session.truth_of(n, command) <= high)
        warned, with_offset = (any(words in note for note in notes) for words in (_WARNING, _WITH_OFFSET))
        yield Told(axes, effect, command, off, len(found), warned, with_offset)


def one_session(axes: str, effect: str, number: int) -> list[Told]:
    """Record it and run the commands; nothing where no such axis can be drawn."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            session = {"ours": ours, "other": other}[axes](effect, number, folder)
        except NoSuchSessionError:
            return []
        return list(told(axes, effect, session, folder))


def study(each: int, effects: Sequence[str] = (), kinds: Sequence[str] = _AXES) -> list[Told]:
    """So many sessions of each effect on either kind of axis, on the cores there are."""
    wanted = [
        (axes, effect, number)
        for axes, names in (("ours", EFFECTS), ("other", OTHER_EFFECTS))
        if axes in kinds
        for effect in (*names, NONE)
        for number in range(each * (_NONE if effect == NONE else 1))
        if not effects or effect in effects
    ]
    found = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for some in pool.map(one_session, *zip(*wanted, strict=True)):
            found += some
            click.echo("\n".join(map(str, some)), err=True)
    return found


def table(found: Sequence[Told]) -> list[str]:
    """One row an effect, and one for each kind of axis together."""
    groups: dict[tuple[str, str, str], list[Told]] = defaultdict(list)
    for one in found:
        groups[one.effect, one.axes, one.command].append(one)
        if one.effect != NONE:
            groups["together", one.axes, one.command].append(one)
    columns = list(product(_AXES, _COMMANDS))
    rows = [
        [effect.replace("_", " "), *(_cell(groups[effect, axes, command]) for axes, command in columns)]
        for effect in [*dict.fromkeys(one.effect for one in found), "together"]
    ]
    head = ["effect", *(f"{axes}, {command}" for axes, command in columns)]
    return markdown.table(head, rows)


def _cell(group: Sequence[Told]) -> str:
    return f"{sum(one.honest for one in group)} of {len(group)}" if group else "–"


def section(found: Sequence[Told], each: int) -> list[str]:
    """The part of docs/accuracy.md."""
    without = [one for one in found if one.effect == NONE]
    alarms = " and ".join(
        f"{sum(one.warned for one in some)} of {len(some)} ({axes})"
        for axes in _AXES
        if (some := [one for one in without if one.axes == axes])
    )
    missed, all_numbers = sum(len(one.off) for one in without), sum(one.checked for one in without)
    found = [one for one in found if one.effect != NONE]
    honest = sum(one.honest for one in found)
    covered = sum(not one.off and not one.refused for one in found)
    numbers, off = sum(one.checked for one in found), sum(len(one.off) for one in found)
    silent = sum(len(one.off) for one in found if not one.warned)
    warned = sum(one.warned for one in found)
    text = f"""Each effect is in {each} of the sessions on either kind of axis.

It was so in {honest} of {len(found)} fits ({100 * honest / max(len(found), 1):.0f} %): in {covered} of them
every interval held the truth, and {warned} said that the model lacks something. Of {numbers} numbers told as
found {off} had an interval that excludes the truth, {silent} of them without a word.

Without an effect {alarms} fits said that something is lacking; the friction
of the other axes need not be LuGre's, which is a lack too. Of the {all_numbers} numbers that these fits
told as found {missed} had an interval that excludes the truth.
"""
    return [text, *table([*found, *without])]


@click.command()
@click.option("--each", default=1, show_default=True, help="Sessions of each effect on each kind of axis.")
@click.option("--effect", "effects", multiple=True, help="Only this one; may be repeated.")
@click.option("--axes", "kinds", multiple=True, default=_AXES, type=click.Choice(_AXES), help="Only these.")
@markdown.out_option(_PAGE)
def main(each: int, effects: tuple[str, ...], kinds: tuple[str, ...], out: Path) -> None:
    """Run the study and write its part of the page."""
    found = section(study(each, effects, kinds), each)
    markdown.write_made(_PAGE, {"single fits": found}, "study-partial", out)
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
