"""`ffc-id run-gravity`, `run-sweep`, `run-sine` and `run`: run an experiment, log the current."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .common import Output, console, force_option, output_options, rig_option, seed_option

if TYPE_CHECKING:
    from idtool.experiment.runner import Progress, RunSummary

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
    # click takes a default of None for a value, so where there is none it must not be given
    given: dict[str, Any] = {"default": default, "show_default": True} if default else {"required": True}
    return click.option(
        "--recipe",
        metavar="NAME|FILE",
        help="A bundled recipe or a TOML file of yours; `ffc-id recipes show NAME` prints one to edit.",
        **given,
    )


@click.command("run-gravity")
@_recipe_option("gravity")
@_shared
def run_gravity(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Payload steps: move slowly up and down at each payload, and log the current.

    \b
    ffc-id run-gravity -o gravity.csv
    """
    return _run(recipe, rig, log, seed, force, output, "gravity")


def _numbers(_context: click.Context, _option: click.Parameter, value: str | None) -> list[float] | None:
    """Numbers with commas between them."""
    if value is None:
        return None
    try:
        return [float(part) for part in value.split(",")]
    except ValueError as error:
        raise click.BadParameter(f"{value!r} is no list of numbers; write it as 0.02,0.05,0.1") from error


@click.command("run-sweep")
@_recipe_option("sweep")
@click.option(
    "--speeds",
    metavar="W,W,...",
    callback=_numbers,
    help="Speeds in place of the recipe's, rad/s (m/s), one trial each.",
)
@click.option(
    "--travel", type=float, metavar="Q", help="Travel of each way in place of the recipe's, rad (m)."
)
@_shared
def run_sweep(
    recipe: str,
    speeds: list[float] | None,
    travel: float | None,
    rig: str,
    log: Path,
    seed: int,
    force: bool,
    output: Output,
) -> int:
    """Velocity sweep: constant speeds both ways, lying on its side.

    \b
    ffc-id run-sweep --rig sim:bench -o sweep.csv
    ffc-id run-sweep --speeds 0.01,0.02,0.05 --travel 0.5 -o slow.csv
    """
    return _run(recipe, rig, log, seed, force, output, "sweep", speeds, travel)


@click.command("run-sine")
@_recipe_option("sine")
@_shared
def run_sine(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Velocity sines of several frequencies.

    \b
    ffc-id run-sine -o sine.csv
    """
    return _run(recipe, rig, log, seed, force, output, "sine")


@click.command("run")
@_recipe_option(None)
@_shared
def run_any(recipe: str, rig: str, log: Path, seed: int, force: bool, output: Output) -> int:
    """Run any recipe.

    \b
    ffc-id run --recipe validation -o validation.csv
    """
    return _run(recipe, rig, log, seed, force, output, None)


def _run(
    name: str,
    spec: str,
    log: Path,
    seed: int,
    force: bool,
    output: Output,
    experiment: str | None,
    speeds: list[float] | None = None,
    travel: float | None = None,
) -> int:
    from idtool.atomic import refuse_existing
    from idtool.experiment.recipe import read_recipe
    from idtool.experiment.runner import run
    from idtool.rig import open_rig

    recipe = read_recipe(name, speeds=speeds, travel=travel)
    if experiment is not None and recipe.experiment != experiment:
        output.warn(
            f'recipe {recipe.name} is marked as experiment "{recipe.experiment}", and so will be the log; '
            f'run-{experiment} expects "{experiment}".'
        )
    refuse_existing(log, force)
    _refuse_itself(name, log)
    with _stop_signals(), open_rig(spec, seed=seed) as rig:

        def go(progress: Callable[[Progress], None] | None) -> RunSummary:
            return run(recipe, rig, log, force=force, progress=progress)

        summary = _with_bar(recipe.name, go, output)
    document = {
        "file": summary.file if summary.rows else None,
        "experiment": recipe.experiment,
        "recipe": recipe.name,
        "rig": spec,
        "rows": summary.rows,
        "trials": summary.trials,
        "duration_s": summary.duration_s,
        "interrupted": summary.interrupted,
    }
    if output.json:
        output.result(document, lambda _: None)
    elif not output.quiet and not summary.interrupted:
        click.echo(
            f"{summary.file}: {summary.rows} rows, {summary.trials} trials, "
            f"{summary.duration_s:.0f} s of rig time"
        )
    if summary.interrupted:
        kept = f"{summary.rows} rows are kept in {summary.file}" if summary.rows else "no row was measured"
        output.warn(
            f"interrupted: the axis was stopped; {kept} "
            f"({summary.trials} of {len(recipe.trials)} trials finished)."
        )
        return 130
    return 0


def _refuse_itself(recipe: str, log: Path) -> None:
    """Do not overwrite the recipe with its own log."""
    from idtool.errors import UsageError

    file = Path(recipe)
    if log.exists() and file.exists() and file.samefile(log):
        raise UsageError(f"{log} is the recipe itself; name another file for the log.")


@contextmanager
def _stop_signals() -> Iterator[None]:
    """Let a closed terminal or a polite kill end a run as Ctrl-C does: the axis is stopped."""

    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    numbers = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    before = {number: signal.signal(number, interrupt) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)


def _with_bar(
    title: str, go: Callable[[Callable[[Progress], None] | None], RunSummary], output: Output
) -> RunSummary:
    """Run with a progress bar on standard error, if that is a terminal and nobody asked for quiet."""
    screen = console(stderr=True)
    if output.quiet or not screen.is_terminal:
        return go(None)
    from rich.markup import escape
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[left]}"))
    with Bar(*columns, console=screen, transient=True) as bar:
        task = bar.add_task(escape(title), total=1.0, left="")

        def show(now: Progress) -> None:
            left = (
                f"trial {now.trial} of {now.trials}, {now.rig_s_left:.0f} s of rig time left "
                f"(about {now.wall_s_left:.0f} s to wait)"
            )
            bar.update(task, completed=now.share, left=left)

        return go(show)
