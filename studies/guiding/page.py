"""What is made of docs/teach.md: the tables, and the picture of the published law."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np

from idtool.control.admittance.constants import CONSTANTS
from idtool.control.admittance.states import GRIP_TRANSITIONS
from idtool.control.states import AROUND, LAWS
from pages import markdown
from studies import teach_paper
from studies.guiding.axes import Axis

#: What is judged: heading, scenario, figure, what is asked for, whether more is better.
ROWS: tuple[tuple[str, str, str, float, bool], ...] = (
    ("hand force at 19.2 mm/s, mean of four pushes, N", "kind", "force", 2.0, False),
    ("the heaviest of the four, N", "kind", "heaviest", 2.0, False),
    ("break-away force, N", "kind", "break_away", 1.0, False),
    ("stop after release, ms", "kind", "stop", 48.0, False),
    ("drift without a hand, 2 s, counts", "kind", "drift", 1.0, False),
    ("ripple at rest, counts", "kind", "ripple", 1.0, False),
    ("speed ripple while pushed, rms, mm/s", "kind", "swing", 2.0, False),
    ("energy given to the hand over a push, mJ", "kind", "energy", 0.0, False),
    ("starts without a hand, times", "kind", "starts", 0.0, False),
    ("pushed back at once or after 0.1 s, let go: stop, ms", "reversing", "turned", 60.0, False),
    ("and the way until then, mm", "reversing", "beyond", 1.2, False),
    ("and starts without a hand, times", "reversing", "starts", 0.0, False),
    ("zero-mean 0.4 N, 0.3 Hz, 20 s: wanders, mm", "breathing", "wander_0.4", 12.0, False),
    ("zero-mean 0.6 N: wanders, mm", "breathing", "wander_0.6", 12.0, False),
    ("zero-mean 1.2 N: wanders, mm", "breathing", "wander_1.2", 12.0, False),
    ("5 N within 20 and 30 ms, 4 N within 10 ms: followed by, mm", "brisk", "followed", 5.0, True),
    ("and starts without a hand, times", "brisk", "starts", 0.0, False),
    ("0.5 N through the tare, then gone: runs, mm", "leaning_0.5", "ran", 0.5, False),
    ("0.75 N through the tare, then gone: runs, mm", "leaning_0.75", "ran", 0.5, False),
    ("1 N through the tare, then gone: runs, mm", "leaning_1", "ran", 0.5, False),
    ("3 N into the end of the stroke, back with 2.5 N: leaves by, mm", "ending", "left", 5.0, True),
    ("trembling 0.5 N, 8 to 12 Hz, while led: rms, mm/s", "trembling", "tremble", 3.0, False),
    ("and pushes in which it stopped, of six", "trembling", "false_stops", 0.0, False),
    ("starts without a hand in all of these, times", "all", "starts", 0.0, False),
    ("and the most that it moves 0.4 s after a hand and later, mm", "all", "crept", 0.5, False),
)


def table(axes: list[Axis]) -> list[str]:
    """Distribution of every figure, and on how many axes it is as asked."""
    rows = []
    for title, scenario, name, asked, more in ROWS:
        values = np.array([axis.figures[scenario][name] for axis in axes])
        sign = -1.0 if more else 1.0
        worst = int(np.argmax(sign * values))
        late = sign * float(np.quantile(sign * values, 0.95))
        met = int(np.sum(sign * values <= sign * asked))
        numbers = (f"{one:.3g}" for one in (np.median(values), late, values[worst]))
        rows.append((title, *numbers, f"{asked:g}", f"{met} of {len(axes)}", axes[worst].name))
    return markdown.table(("", "median", "95 %", "worst", "asked for", "met by", "worst on"), rows, "lrrrrrl")


def transitions() -> list[str]:
    """The tables of legal changes of state."""
    laws = {"published": LAWS["paper"], "admittance": LAWS["light"]}
    rows = [
        (law, state.value, to.value, when)
        for law, table in laws.items()
        for state, ways in table.items()
        for to, when in ways
    ]
    grips = [
        ("admittance", f"hand {grip}", f"hand {to}", when)
        for grip, ways in GRIP_TRANSITIONS.items()
        for to, when in ways
    ]
    around = [("both", state or "any other", to, when) for state, to, when in AROUND]
    return markdown.table(("law", "from", "to", "when"), [*rows, *grips, *around])


def constants() -> list[str]:
    """The table of constants."""
    rows = (
        (f"`{name}`", f"{c.value:g}{'' if c.unit == '1' else f' {c.unit}'}", c.meaning, c.source)
        for name, c in CONSTANTS.items()
    )
    return markdown.table(("name", "value", "what it does", "from"), rows, "lrll")


def days(axes: list[Axis]) -> list[str]:
    """What was asked of `tune`, and what came of it on every day."""
    forces = {axis.name.split(",")[0]: axis.asked for axis in axes}
    machines, asked = len(forces), list(forces.values())
    said = (
        f"{len(axes)} days of {machines} machines. The force that `tune` is asked for is {min(asked):g} N; "
        f"on {sum(f > min(asked) for f in asked)} of {machines} machines that would leave less than the "
        "margin that it asks for, and they take the least force that does not, up to "
        f"{max(asked):.2f} N; 2 N is accepted on {sum(f <= 2.0 for f in asked)} of {machines}."
    )
    return [textwrap.fill(said, 110), "", *table(axes)]


def parts(axes: list[Axis], images: Path) -> dict[str, list[str]]:
    """What is made of the page; its picture goes to `images`."""
    images.mkdir(parents=True, exist_ok=True)
    return {
        "published": teach_paper.table(images),
        "transitions": transitions(),
        "constants": constants(),
        "days": days(axes),
    }
