"""How `ffc-id fleet` scales: thousands of short sessions on this machine; writes its part of docs/fleet.md.

python -m studies.fleet     (make study-fleet)
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import click

from idtool.fleet import run_fleet
from pages import markdown
from testbench.fleet import QUICK, session

_HEAD = ("sessions", "s since the start", "ms a session in this quarter", "memory of the program, MB")
_QUARTERS = 4
#: What 100,000 sessions are compared with.
_MANY = 100_000
_UNITS = 40


def _memory_mb() -> float:
    """Most memory that this process has had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _spent_s() -> float:
    """Processor time of this process and of all that have ended, user and system."""
    parts = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(part.ru_utime + part.ru_stime for part in parts)


@click.command()
@click.option("--sessions", default=2000, show_default=True)
@click.option("--workers", default=2, show_default=True)
def main(sessions: int, workers: int) -> None:
    """Make the sessions, identify them, and say what each quarter of them took."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for k in range(sessions):
            day = f"2026-{1 + k // _UNITS % 12:02d}-{1 + k // _UNITS // 12:02d}"
            unit = f"U{k % _UNITS:02d}"
            session(folder / "sessions" / f"{unit}_{day}_{k:05d}", coulomb=0.08 + 1e-4 * (k % _UNITS), seed=k,
                    unit=unit, date=day)  # fmt: skip
        rows: list[tuple[int, float, float]] = []
        began = time.perf_counter()
        spent = _spent_s()

        def note(done: int, of: int) -> None:
            if done * _QUARTERS // of > (done - 1) * _QUARTERS // of:
                rows.append((done, time.perf_counter() - began, _memory_mb()))
                print(*rows[-1], flush=True)

        fleet = run_fleet(folder / "sessions", folder / "out", QUICK, workers=workers, progress=note)
        whole, spent = time.perf_counter() - began, _spent_s() - spent
        lines = []
        before, then = 0, 0.0
        for done, seconds, memory in rows:
            each_ms = 1e3 * (seconds - then) / (done - before)
            lines.append((f"{done:,}", f"{seconds:.0f}", f"{each_ms:.0f}", f"{memory:.0f}"))
            before, then = done, seconds
        summing = whole - rows[-1][1]
        sizes = {file: (folder / "out" / file).stat().st_size / 1e6
                 for file in ("fleet.html", "summary.csv", "summary.parquet", "summary.json")}  # fmt: skip
        each = (
            sum(f.stat().st_size for f in (folder / "out" / "sessions").rglob("*") if f.is_file()) / sessions
        )
        growth = (rows[-1][2] - rows[0][2]) / (rows[-1][0] - rows[0][0])
    told = ", ".join(f"{file} {size:.1f} MB" for file, size in sizes.items())
    hours, disk_gb = _MANY * spent / sessions / 3600.0, _MANY * each / 1e9
    memory_mb, page_mb = rows[0][2] + growth * _MANY, _MANY / sessions * sizes["fleet.html"]
    text = f"""{sessions:,} sessions of 1,200 rows each (Coulomb and viscous friction, no search for effects),
{workers} processes of one machine, by `make study-fleet`; {len(fleet.failed)} failed:

{chr(10).join(markdown.table(_HEAD, lines, "rrrr"))}

The summary and the page took {summing:.0f} s at the end. {told};
{each / 1e3:.0f} kB of results a session. Each session took {1e3 * spent / sessions:.0f} ms of processor time.

From that, {_MANY:,} sessions would need {hours:.1f} hours of one processor for so simple a fit,
{disk_gb:.0f} GB on disk, {memory_mb / 1e3:.1f} GB in the program while it hands out the work, and
{page_mb:.0f} MB of page, which no browser likes: split such a fleet into folders by unit or by month,
and join the Parquet files."""
    markdown.write_made("docs/fleet.md", {"scaling": [text]}, "study-fleet")
    print(text)


if __name__ == "__main__":
    main()
