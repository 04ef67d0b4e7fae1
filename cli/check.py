"""`ffc-id check`: quality of logs before any fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .axis import Given, axis_options
from .common import Output, logs_argument, output_options

if TYPE_CHECKING:
    from rich.console import Console


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

    def show(console: Console) -> None:
        for log in result.logs:
            facts = log.facts
            seconds = facts["seconds"]
            click.echo(
                f"{log.file}: {facts['rows']} rows, {counted(facts['trials'], 'trial')}, "
                f"{seconds:{'.0f' if seconds >= 10 else '.2g'}} s at {facts['rate_hz']:.0f} Hz, "
                f"{counted(facts['steady_windows'], 'steady window')}"
            )
            for finding in log.findings:
                click.echo(f"  ! {finding}")
        for note in result.notes:
            click.echo(f"note: {note}")
        click.echo("\nthese logs can determine")
        for verdict in result.can:
            click.echo(f"  {verdict.what}" + ("" if verdict.why == "testable" else f" ({verdict.why})"))
        if result.cannot:
            click.echo("they cannot determine")
        for verdict in result.cannot:
            click.echo(f"  {verdict.what}: {verdict.why}" + (f"; try {verdict.run}" if verdict.run else ""))
        if result.open:
            click.echo("only ffc-id identify tells, which looks for effects")
        for verdict in result.open:
            click.echo(f"  {verdict.what}: {verdict.why}")
        if result.findings:
            click.echo("what they lack")
        for lacking in result.findings:
            click.echo(f"  {lacking.sentence}")

    output.result(result.to_document(), show)
    output.next("identify", *logs, "-o", "result", odd=result.odd)
