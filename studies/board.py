"""Measure several files on the simulated board and write the table into docs/board.md."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from idtool.effects import registry
from pages import markdown
from testbench.board.files import EFFECTS, with_effects
from testbench.board.measure import CLOCK_HZ, Figures, measure, missing

RESTING, TARING, GUIDING, STOPPING = 1, 2, 3, 4
_PAGE = "docs/board.md"


def milliseconds(cycles: float) -> str:
    """Cycles as time."""
    return f"{1e3 * cycles / CLOCK_HZ:.2f}"


def row(title: str, figures: Figures) -> list[str]:
    """Cells of the published mode's table."""
    half = len(figures.cycles) // 2
    still, tilted = figures.cycles[:half], figures.cycles[half:]
    return [
        title,
        f"{max(still)}",
        milliseconds(sum(still) / half),
        milliseconds(max(still)),
        milliseconds(max(tilted)),
        f"{figures.flash}",
        f"{figures.controller} + {figures.stack}",
    ]


def light_row(title: str, figures: Figures) -> list[str]:
    """Cells of the light mode's table; not tilted anew."""
    half = len(figures.cycles) // 2
    worst = {
        state: max(c for c, s in zip(figures.cycles[:half], figures.states[:half], strict=True) if s == state)
        for state in set(figures.states[:half])
    }
    moved = max(worst[state] for state in (GUIDING, STOPPING) if state in worst)
    return [
        title,
        f"{moved}",
        milliseconds(moved),
        milliseconds(worst[RESTING]),
        milliseconds(worst[TARING]),
        f"{figures.flash}",
        f"{figures.controller} + {figures.stack}",
    ]


def table(*, light: bool) -> list[str]:
    """The table of one mode, measured."""
    alone = {f"`{name}`": [name] for name in registry.names() if name in EFFECTS and name != "inertia"}
    files = {
        "gravity and LuGre friction": [],
        "the same and `inertia`": ["inertia"],
        "`inertia`, `position_ripple`": ["inertia", "position_ripple"],
        **alone,
        "all of these at once": list(EFFECTS),
    }
    heads = [
        "parameter file",
        "cycles, worst",
        "ms, mean",
        "ms, worst",
        "ms, worst, tilt changes at every step",
    ]
    if light:
        heads = [
            "light mode",
            "cycles, worst, guided",
            "ms, the same",
            "ms, worst at rest",
            "ms, worst in a tare",
        ]
    heads += ["flash, bytes", "RAM, bytes: structure + stack"]
    lines = markdown.table(heads, ())
    for title, names in files.items():
        with tempfile.TemporaryDirectory() as folder:
            figures = measure(with_effects(*names, light=light), Path(folder))
        lines.append(markdown.row((light_row if light else row)(title, figures)))
        click.echo(lines[-1])
    return lines


@click.command()
@markdown.out_option(_PAGE)
def main(out: Path) -> None:
    """Run the study and put its table into the page."""
    tool = missing()
    if tool:
        raise click.ClickException(f"{tool} is missing; on Debian: apt-get install gcc-avr avr-libc simavr")
    made = [*table(light=False), "", *table(light=True)]
    markdown.write_made(_PAGE, {"cycles": made}, "study-board", out)


if __name__ == "__main__":
    main()
