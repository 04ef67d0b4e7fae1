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
from pages import markdown
from studies.measured import BY_NAME, recordings
from testbench.planted import EFFECTS, LATE_S, planted
from testbench.recordings import Recording
from testbench.regression import STANDS_FOR, moving, regress

_PAGE = "docs/planted.md"
_EFFECT_HEAD = (
    *("effect", "named", "of these, seen by the regression too"),
    *("seen by the regression, not named", "something else named since"),
)
_RECORDING_HEAD = ("recording", "named before", "named", "not named", "named since, not added")
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


def made_part(found: list[Outcome], share: float) -> list[str]:
    """The part of the page."""
    new = [one for one in found if one.counts]
    effects, recordings = [], []
    for effect in (*EFFECTS, ""):
        own = [one for one in new if effect in ("", one.effect)]
        named = [one for one in own if one.named]
        seen = sum(one.seen for one in named), sum(one.seen and not one.named for one in own)
        effects.append(
            (effect or "all", f"{len(named)} of {len(own)}", *seen, sum(bool(one.wrong) for one in own))
        )
    for name in dict.fromkeys(one.recording for one in found):
        own = [one for one in new if one.recording == name]
        before = next(one.before for one in found if one.recording == name)
        right = [one.effect for one in own if one.named]
        lacking = [one for one in own if not one.named]
        missed = [one.effect + ("" if one.seen else " (nor by the regression)") for one in lacking]
        wrong = [f"{', '.join(sorted(one.wrong))} (for {one.effect})" for one in own if one.wrong]
        cells = (", ".join(cell) or "–" for cell in (sorted(before), right, missed, wrong))
        recordings.append((BY_NAME[name].title, *cells))
    return [
        f"Each is added at {100 * share:.0f} % (rms) of the Coulomb level; "
        f"a delay is of {1000 * LATE_S:.0f} ms.",
        "",
        *markdown.table(_EFFECT_HEAD, effects, "lrrrr"),
        "",
        *markdown.table(_RECORDING_HEAD, recordings),
    ]


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=None)
@click.option("--size", default=0.15, help="Of what is added, share of the Coulomb level.")
@click.option("--only", multiple=True, type=click.Choice(RECORDINGS), help="These recordings.")
@markdown.out_option(_PAGE)
def main(folder: Path | None, size: float, only: tuple[str, ...], out: Path) -> None:
    """Plant every effect in every recording and write the page."""
    where = recordings(folder)
    found: list[Outcome] = []
    for name in only or RECORDINGS:
        for one in outcomes(BY_NAME[name], where, size):
            found.append(one)
            click.echo(f"{name} {one.effect}: {', '.join(sorted(one.after)) or 'nothing'}", err=True)
        markdown.write_made(_PAGE, {"named": made_part(found, size)}, "study-planted", out)
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
