"""`ffc-id check`: quality of logs before any fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from .axis import Given, axis_options
from .common import Output, logs_argument, output_options


@click.command()
@logs_argument
@axis_options
@output_options
def check(logs: Sequence[Path], given: Given, output: Output) -> None:
    """Quality of logs before any fit: gaps, jitter, saturation, steady windows, and what they determine.

    Findings are no errors: the exit code is 0 as long as the logs can be read.

    \b
    ffc-id check gravity.csv sweep.csv sine.csv
    """
    from idtool.presentation.text import counted
    from idtool.verbs.check import check as run

    result = run(given.read(logs, output))

    lines = []
    for log in result.logs:
        facts = log.facts
        seconds = facts["seconds"]
        lines.append(
            f"{log.file}: {counted(facts['rows'], 'row')}, {counted(facts['trials'], 'trial')}, "
            f"{seconds:{'.0f' if seconds >= 10 else '.2g'}} s at {facts['rate_hz']:.0f} Hz, "
            f"{counted(facts['steady_windows'], 'steady window')}"
        )
        lines += [f"  ! {finding}" for finding in log.findings]
    lines += [f"note: {note}" for note in result.notes]
    can = [one.what + ("" if one.why == "testable" else f" ({one.why})") for one in result.can]
    cannot = [f"{one.what}: {one.why}" + (f"; try {one.run}" if one.run else "") for one in result.cannot]
    for title, found in (
        ("\nthese logs can determine", can),
        ("they cannot determine", cannot),
        ("only ffc-id identify tells, which looks for effects", [f"{o.what}: {o.why}" for o in result.open]),
        ("what they lack", [lacking.sentence for lacking in result.findings]),
    ):
        if found or found is can:
            lines += [title, *(f"  {line}" for line in found)]
    output.result(result.to_document(), lines)
    output.next("identify", *logs, "-o", "result", odd=result.odd)
