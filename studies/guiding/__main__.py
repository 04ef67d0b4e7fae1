"""Study of hand guiding: `make study-teach` writes docs/teach.md.

Machines are drawn, a session is recorded on each, `identify` makes a file of it, effects and all, and `tune`
gives its gain for 1.9 N at 19.2 mm/s. Then each machine has several days: friction off by up to 30 %, the
payload by up to 0.02 kg, another hand. On every day every hand comes.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import click

from pages import markdown
from studies.guiding import page
from studies.guiding.axes import Axis, machine_axes

_PAGE = "docs/teach.md"


@click.command()
@click.option(
    "--axes", default=600, show_default=True, help="How many, on as many days each as machines need."
)
@click.option("--machines", default=40, show_default=True, help="How many; each is identified once.")
@markdown.out_option(_PAGE)
@click.option(
    "--cache", type=click.Path(path_type=Path), default=Path("build/guiding"), show_default=True,
    help="Where the identified files are kept.",
)  # fmt: skip
@click.option("--processes", default=os.cpu_count() or 1, show_default=True)
def main(axes: int, machines: int, out: Path, cache: Path, processes: int) -> None:
    """Run the study and write its page."""
    days = -(-axes // machines)
    found: list[Axis] = []
    with ProcessPoolExecutor(processes) as pool:
        jobs = [pool.submit(machine_axes, number, days, cache) for number in range(machines)]
        for job in jobs:
            found += job.result()
            click.echo(f"{len(found)} axes", err=True)
    found = found[:axes]
    click.echo("\n".join(page.table(found)))
    parts = page.parts(found, out.parent / "images")
    markdown.write_made(_PAGE, parts, "study-teach", out)


if __name__ == "__main__":
    main()
