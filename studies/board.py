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
#: In the light mode, and in the published one.
_HEADS = {
    True: ("light mode", "cycles, worst, guided", "ms, the same", "ms, worst at rest", "ms, worst in a tare"),
    False: (
        *("parameter file", "cycles, worst", "ms, mean", "ms, worst"),
        "ms, worst, tilt changes at every step",
    ),
}


def cells(figures: Figures, *, light: bool) -> tuple[str, ...]:
    """A row of the table of one mode: cycles at worst, three times in ms, flash and RAM."""
    half = len(figures.cycles) // 2
    still, tilted = figures.cycles[:half], figures.cycles[half:]
    if light:  # not tilted anew
        worst: dict[int, int] = {}
        for state, cycles in zip(figures.states, still, strict=False):
            worst[state] = max(cycles, worst.get(state, 0))
        most = max(worst[state] for state in (GUIDING, STOPPING) if state in worst)
        times: tuple[float, ...] = (most, worst[RESTING], worst[TARING])
    else:
        most, times = max(still), (sum(still) / half, max(still), max(tilted))
    memory = f"{figures.controller} + {figures.stack}"
    return (f"{most}", *(f"{1e3 * time / CLOCK_HZ:.2f}" for time in times), f"{figures.flash}", memory)


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
    rows = []
    for title, names in files.items():
        with tempfile.TemporaryDirectory() as folder:
            figures = measure(with_effects(*names, light=light), Path(folder))
        rows.append((title, *cells(figures, light=light)))
        click.echo(markdown.row(rows[-1]))
    return markdown.table((*_HEADS[light], "flash, bytes", "RAM, bytes: structure + stack"), rows)


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
