"""Whether effects that are added to recordings of real machines are named.

python -m studies.planted [--folder FOLDER] [--size SHARE] [--out docs/planted.md]      (make study-planted)

Each is added at a share of the Coulomb level that the regression finds (`testbench/planted.py`). What is
named is compared with what was named before, and with what the regression sees then.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from idtool.errors import FfcIdError
from idtool.importing import import_recording
from idtool.log import Log
from idtool.verbs.identify import identify
from studies.measured import BY_NAME, default_folder
from testbench.planted import EFFECTS, LATE_S, planted
from testbench.recordings import Recording
from testbench.regression import STANDS_FOR, moving, regress

#: Of each machine one recording that is an axis by itself, and not one sided.
RECORDINGS = (
    "ur_1",
    "ur_2",
    "ur_3",
    "damiao_3",
    "damiao_5",
    "mtm",
    "psm_3",
    "cicese_break",
    "servo_triangle",
)
#: Names that are true too: at one speed an offset and an asymmetry are one thing.
_ALSO = {
    "torque_offset": {"direction_asymmetry"},
    "direction_asymmetry": {"torque_offset"},
    "load_dependent_friction": {"drive_backdrive"},
}


@dataclass(frozen=True)
class Outcome:
    """What came of one effect in one recording.

    Attributes:
        recording, effect: whose, and which.
        before, after: what was named without it and with it.
        seen: whether a column of the regression stands for it that did not before.
    """

    recording: str
    effect: str
    before: frozenset[str]
    after: frozenset[str]
    seen: bool

    @property
    def true(self) -> set[str]:
        """The names that are right."""
        return {self.effect} | _ALSO.get(self.effect, set())

    @property
    def counts(self) -> bool:
        """Whether it was not there before."""
        return not self.true & self.before

    @property
    def named(self) -> bool:
        """Whether it was named."""
        return bool(self.true & self.after)

    @property
    def wrong(self) -> set[str]:
        """What is named since that is not what was added."""
        return set(self.after - self.before - self.true)


def outcomes(recording: Recording, folder: Path, share: float) -> Iterable[Outcome]:
    """Every effect in one recording."""
    log = import_recording(folder / recording.file, **recording.options).log
    (before, _), plain = _named(log, recording), regress(moving(log, {}), recording.gravity)
    known = {term.name for term in plain.found}
    for effect in EFFECTS:
        rng = np.random.default_rng(zlib.crc32(f"{recording.name} {effect}".encode()))
        spoilt = planted(log, effect, share * plain.coulomb, rng)
        told = {effect, *_ALSO.get(effect, ())}
        terms = regress(moving(spoilt, {}), recording.gravity).found
        seen = any(told & set(STANDS_FOR[term.name]) for term in terms if term.name not in known)
        after, testable = _named(spoilt, recording)
        if effect in testable:
            yield Outcome(recording.name, effect, before, after, seen)


def _named(log: Log, recording: Recording) -> tuple[frozenset[str], frozenset[str]]:
    """What is named, and what these rows can show."""
    try:
        found = identify([log], friction=recording.friction).diagnosis
    except FfcIdError:
        return frozenset(), frozenset(EFFECTS)
    testable = {one["name"] for one in found["candidates"] if not one["why"].startswith("not testable")}
    return frozenset(one["name"] for one in found["effects"]) - {"inertia"}, frozenset(testable)


def page(found: list[Outcome], share: float) -> str:
    """The page."""
    new = [one for one in found if one.counts]
    lines = [
        "# Known effects, added to recordings of real machines",
        "",
        "You get: how often the tool names an effect of a known size beside everything that a real machine",
        "leaves, and what else it names then.",
        "",
        f"Made by `make study-planted`. Each effect is added at {100 * share:.0f} % (rms) of the Coulomb",
        "level to a recording of [measured.md](measured.md), by a plain formula of the measured motion",
        f"(`testbench/planted.py`); a delay is of {1000 * LATE_S:.0f} ms. Counted is what was not named",
        "before and what the rows can show; a column of the regression sees an effect if it joined since.",
        "Nothing is tuned to these.",
        "",
        "| effect | named | of these, seen by the regression too | seen by the regression, not named |"
        " something else named since |",
        "|---|---:|---:|---:|---:|",
    ]
    for effect in (*EFFECTS, ""):
        own = [one for one in new if effect in ("", one.effect)]
        named = [one for one in own if one.named]
        lines.append(
            f"| {effect or 'all'} | {len(named)} of {len(own)} | {sum(one.seen for one in named)} |"
            f" {sum(one.seen and not one.named for one in own)} | {sum(bool(one.wrong) for one in own)} |"
        )
    lines += ["", "| recording | named before | named | not named | named since, not added |"]
    lines.append("|---|---|---|---|---|")
    for name in dict.fromkeys(one.recording for one in found):
        own = [one for one in new if one.recording == name]
        before = next(one.before for one in found if one.recording == name)
        right = [one.effect for one in own if one.named]
        lacking = [one for one in own if not one.named]
        missed = [one.effect + ("" if one.seen else " (nor by the regression)") for one in lacking]
        wrong = [f"{', '.join(sorted(one.wrong))} (for {one.effect})" for one in own if one.wrong]
        cells = (sorted(before), right, missed, wrong)
        lines.append(f"| {BY_NAME[name].title} | {' | '.join(', '.join(cell) or '–' for cell in cells)} |")
    return "\n".join(lines) + "\n"


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=None)
@click.option("--size", default=0.15, help="Of what is added, share of the Coulomb level.")
@click.option("--only", multiple=True, type=click.Choice(RECORDINGS), help="These recordings.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("docs/planted.md"))
def main(folder: Path | None, size: float, only: tuple[str, ...], out: Path) -> None:
    """Plant every effect in every recording and write the page."""
    where = folder or default_folder()
    if not where.is_dir():
        raise click.ClickException(f"{where}: no recordings there; give --folder")
    found: list[Outcome] = []
    for name in only or RECORDINGS:
        for one in outcomes(BY_NAME[name], where, size):
            found.append(one)
            click.echo(f"{name} {one.effect}: {', '.join(sorted(one.after)) or 'nothing'}", err=True)
        out.write_text(page(found, size))
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
