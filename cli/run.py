"""`ffc-id run-gravity`, `run-sweep`, `run-sine` and `run`: run an experiment, log the current."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .common import Output, console, force_option, output_options, rig_option, seed_option

if TYPE_CHECKING:
    from rich.console import Console

F = TypeVar("F", bound=Callable[..., Any])


def _shared(command: F) -> F:
    for decorate in (
        output_options,
        force_option,
        seed_option,
        click.option(
            "-o", "--output", "log", required=True, type=click.Path(path_type=Path), help="The log."
        ),
        rig_option,
    ):
        command = decorate(command)
    return command


def _recipe_option(default: str | None) -> Callable[[F], F]:
    return click.option(
        "--recipe",
        default=default,
        required=default is None,
        show_default=default is not None,
        metavar="NAME|FILE",
        help="A bundled recipe or a TOML file of yours; `ffc-id recipes show NAME` prints one to edit.",
    )


@click.command("run-gravity")
@_recipe_option("gravity")
@_shared
def run_gravity(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Payload steps: move slowly up and down at each payload, and log the current.

    \b
    ffc-id run-gravity -o gravity.csv
    """
    return _run(recipe, rig, log, seed, force, output)


@click.command("run-sweep")
@_recipe_option("sweep")
@_shared
def run_sweep(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Velocity sweep: constant speeds both ways, lying on its side.

    \b
    ffc-id run-sweep --rig sim:bench -o sweep.csv
    """
    return _run(recipe, rig, log, seed, force, output)


@click.command("run-sine")
@_recipe_option("sine")
@_shared
def run_sine(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Velocity sines of several frequencies.

    \b
    ffc-id run-sine -o sine.csv
    """
    return _run(recipe, rig, log, seed, force, output)


@click.command("run")
@_recipe_option(None)
@_shared
def run_any(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Run any recipe.

    \b
    ffc-id run --recipe validation -o validation.csv
    """
    return _run(recipe, rig, log, seed, force, output)


def _run(name: str, spec: str, log: Path, seed: int, force: bool, output: Output) -> int:
    from idtool.atomic import refuse_existing
    from idtool.experiment.recipe import read_recipe
    from idtool.experiment.runner import RunSummary, run
    from idtool.rig import open_rig

    recipe = read_recipe(name)
    refuse_existing(log, force)
    with open_rig(spec, seed=seed) as rig:

        def go(progress: Callable[[float, float], None] | None) -> RunSummary:
            return run(recipe, rig, log, force=force, progress=progress)

        summary = _with_bar(recipe.name, go, output)
    document = {
        "file": summary.file,
        "experiment": recipe.experiment,
        "recipe": recipe.name,
        "rig": spec,
        "rows": summary.rows,
        "trials": summary.trials,
        "duration_s": summary.duration_s,
        "interrupted": summary.interrupted,
    }

    def show(_: Console) -> None:
        click.echo(
            f"{summary.file}: {summary.rows} rows, {summary.trials} of {len(recipe.trials)} trials, "
            f"{summary.duration_s:.0f} s of rig time"
        )

    output.result(document, show)
    if summary.interrupted:
        output.warn(f"interrupted: the axis was stopped and {summary.rows} rows were kept in {summary.file}.")
        return 130
    return 0


def _with_bar(title: str, go: Callable[[Callable[[float, float], None] | None], Any], output: Output) -> Any:
    """Run with a progress bar on standard error, if that is a terminal and nobody asked for quiet."""
    screen = console(stderr=True)
    if output.quiet or output.json or not screen.is_terminal:
        return go(None)
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[left]}"))
    with Progress(*columns, console=screen, transient=True) as bar:
        task = bar.add_task(title, total=1.0, left="")
        return go(
            lambda share, left: bar.update(task, completed=share, left=f"{left:.0f} s of rig time left")
        )
