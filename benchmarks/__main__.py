"""python -m benchmarks [PART...]"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from benchmarks import commands, control, dynamic, files, hard, kernel, machine, scaling, session, startup
from benchmarks.table import Section, goals_table

PARTS: dict[str, Callable[[], Section]] = {
    "kernel": kernel.measure,
    "dynamic": dynamic.measure,
    "scaling": scaling.measure,
    "startup": startup.measure,
    "commands": commands.measure,
    "control": control.measure,
    "session": session.measure,
    "hard": hard.measure,
    "files": files.measure,
}
_REPORT = Path(__file__).resolve().parent.parent / "docs" / "benchmarks.md"

_HEAD = """# Benchmarks

You get: what each part costs in time and memory, as ratios against named alternatives, and what a short
command takes.

Written by `make bench` (`python -m benchmarks`; `python -m benchmarks kernel` prints one part). Everything on
one core; times are those of the processor (of a second process, by the clock). What is compared was run in
turns, and the shortest of several rounds counts: other work on a machine only ever adds to a time. Ratios
carry over to other machines better than times do.
"""


@click.command()
@click.argument("parts", nargs=-1, type=click.Choice(list(PARTS)), metavar="[PART]...")
def main(parts: tuple[str, ...]) -> None:
    """Run the PARTs that were named, or all; only a run of all writes the report."""
    sections = []
    for name in parts or PARTS:
        sections.append(PARTS[name]())
        print(sections[-1].markdown(), flush=True)
    goals = goals_table(sections)
    print(goals.markdown())
    if not parts:
        packages = ", ".join(f"{name} {version}" for name, version in machine.versions().items())
        goals.notes.append(f"Processor: {machine.processor()}. {packages}.")
        text = "\n".join([_HEAD, *(part.markdown() for part in (goals, *sections))])
        _REPORT.write_text(text.rstrip() + "\n")
        print(f"written: docs/{_REPORT.name}")


if __name__ == "__main__":
    main()
