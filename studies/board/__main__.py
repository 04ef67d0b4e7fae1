"""Measure several files on the simulated board and write the table into docs/board.md."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import click

from idtool.effects import registry
from idtool.parameters import EffectEntry, Parameter, Parameters
from studies.board.files import BASE, EFFECTS, LIGHT
from studies.board.measure import CLOCK_HZ, Figures, measure, missing

BEGIN, END = "<!-- make study-board: begin -->", "<!-- make study-board: end -->"


def with_effects(*names: str, light: bool = False) -> Parameters:
    """The base file and these effects, in the published or the light mode."""
    file = replace(BASE, controller=LIGHT) if light else BASE
    for name in names:
        numbers = {key: Parameter(value) for key, value in EFFECTS[name].items()}
        file = file.with_effect(EffectEntry(name, numbers))
    return file


def row(title: str, figures: Figures) -> str:
    """One line of the table."""
    half = len(figures.cycles) // 2
    still, tilted = figures.cycles[:half], figures.cycles[half:]

    def milliseconds(cycles: float) -> str:
        return f"{1e3 * cycles / CLOCK_HZ:.2f}"

    cells = [
        title,
        f"{max(still)}",
        milliseconds(sum(still) / half),
        milliseconds(max(still)),
        milliseconds(max(tilted)),
        f"{figures.flash}",
        f"{figures.controller} + {figures.stack}",
    ]
    return "| " + " | ".join(cells) + " |"


def table() -> list[str]:
    """The table, measured."""
    alone = {f"`{name}`": [name] for name in registry.names() if name in EFFECTS and name != "inertia"}
    files = {
        "gravity and LuGre friction": [],
        "the same and `inertia`": ["inertia"],
        "`inertia`, `position_ripple`": ["inertia", "position_ripple"],
        **alone,
        "all of these at once": list(EFFECTS),
    }
    lines = [
        "| parameter file | cycles, worst | ms, mean | ms, worst | ms, worst, tilted anew at every step "
        "| flash, bytes | RAM, bytes: structure + stack |",
        "|---|---|---|---|---|---|---|",
    ]
    for title, names in files.items():
        with tempfile.TemporaryDirectory() as folder:
            lines.append(row(title, measure(with_effects(*names), Path(folder))))
        click.echo(lines[-1])
    return lines


@click.command()
@click.option("--out", type=click.Path(path_type=Path), default=Path("docs/board.md"), show_default=True)
def main(out: Path) -> None:
    """Run the study and put its table into the page."""
    tool = missing()
    if tool:
        raise click.ClickException(f"{tool} is missing; on Debian: apt-get install gcc-avr avr-libc simavr")
    head, rest = out.read_text(encoding="utf-8").split(BEGIN)
    tail = rest.split(END)[1]
    out.write_text(head + "\n".join([BEGIN, *table(), END]) + tail, encoding="utf-8")


if __name__ == "__main__":
    main()
