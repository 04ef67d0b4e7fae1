"""`ffc-id run-gravity`, `run-sweep`, `run-sine` and `run`: run an experiment, log the current."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .common import PATH, Decorator, given_words
from .live import live_views
from .moving import Moving, moving_options, rig_words
from .numbers import Number
from .progress import Progress
from .words import complete_recipe

if TYPE_CHECKING:
    from idtool.experiment.recipe import Recipe
    from idtool.experiment.runner import Progress as RunProgress
    from idtool.experiment.runner import RunSummary
    from idtool.rig.base import TrialSetup

#: Beyond this share of late samples a run says so.
_MANY_OVERRUNS = 0.02


@dataclass(frozen=True)
class RunOptions(Moving):
    """What every run is told.

    Attributes:
        log: the log.
        yes: nobody is asked to set the axis up.
        resume: go on with the log.
    """

    log: Path
    yes: bool
    resume: bool


_shared = moving_options(
    RunOptions,
    click.option("-o", "--output", "log", required=True, type=PATH, help="The log."),
    click.option("--yes", is_flag=True, help="Ask nobody to change payload or tilt of a real axis."),
    click.option("--resume", is_flag=True, help="Go on with the log at its first unfinished trial."),
)


def _recipe_option(default: str | None) -> Decorator:
    # click takes a default of None for a value, so where there is none it must not be given
    given: dict[str, Any] = {"default": default, "show_default": True} if default else {"required": True}
    return click.option(
        "--recipe",
        metavar="NAME|FILE",
        shell_complete=complete_recipe,
        help="A bundled recipe or a TOML file of yours; `ffc-id recipes show NAME` prints one to edit.",
        **given,
    )


def _numbers(_context: click.Context, _option: click.Parameter, value: str | None) -> list[float] | None:
    """Numbers with commas between them."""
    if value is None:
        return None
    try:
        return [float(part) for part in value.split(",")]
    except ValueError as error:
        raise click.BadParameter(f"{value!r} is no list of numbers; write it as 0.02,0.05,0.1") from error


@click.command("run-gravity")
@_recipe_option("gravity")
@click.option(
    "--payloads",
    metavar="KG,KG,...",
    callback=_numbers,
    help="Payloads in place of the recipe's, kg, one trial each.",
)
@_shared
def run_gravity(recipe: str, payloads: list[float] | None, told: RunOptions) -> int:
    """Payload steps: move slowly up and down at each payload, and log the current.

    \b
    ffc-id run-gravity --rig sim:paper -o gravity.csv
    ffc-id run-gravity --rig sim:paper --payloads 0,0.5,1 -o gravity.csv
    """
    return _run(recipe, told, "gravity", payloads=payloads)


@click.command("run-sweep")
@_recipe_option("sweep")
@click.option(
    "--speeds",
    metavar="W,W,...",
    callback=_numbers,
    help="Speeds in place of the recipe's, rad/s (m/s), one trial each.",
)
@click.option(
    "--travel", type=Number(), metavar="Q", help="Travel of each way in place of the recipe's, rad (m)."
)
@_shared
def run_sweep(recipe: str, speeds: list[float] | None, travel: float | None, told: RunOptions) -> int:
    """Velocity sweep: constant speeds both ways, lying on its side.

    \b
    ffc-id run-sweep --rig sim:bench -o sweep.csv
    ffc-id run-sweep --rig sim:bench --speeds 0.01,0.02,0.05 --travel 0.5 -o slow.csv
    """
    return _run(recipe, told, "sweep", speeds=speeds, travel=travel)


@click.command("run-sine")
@_recipe_option("sine")
@_shared
def run_sine(recipe: str, told: RunOptions) -> int:
    """Velocity sines of several frequencies.

    \b
    ffc-id run-sine --rig sim:paper -o sine.csv
    """
    return _run(recipe, told, "sine")


@click.command("run")
@_recipe_option(None)
@_shared
def run_any(recipe: str, told: RunOptions) -> int:
    """Run any recipe.

    \b
    ffc-id run --recipe validation --rig sim:paper -o validation.csv
    """
    return _run(recipe, told, None)


def _run(name: str, told: RunOptions, experiment: str | None, **changes: Any) -> int:
    from idtool.errors import UsageError
    from idtool.experiment.plan import doubted_payload
    from idtool.experiment.recipe import Changes, read_recipe
    from idtool.experiment.runner import run
    from idtool.io.atomic import refuse_existing
    from idtool.rig import open_rig

    output, log = told.output, told.log
    if told.resume and told.force:
        raise UsageError("--resume continues the log and --force overwrites it; pass one of them.")
    recipe = read_recipe(name, Changes(tilt=told.told_tilt(), **changes))
    if experiment is not None and recipe.experiment != experiment:
        output.warn(
            f'recipe {recipe.name} is marked as experiment "{recipe.experiment}", and so will be the log; '
            f'run-{experiment} expects "{experiment}".'
        )
    refuse_existing(log, told.force or told.resume, Path(name))
    spec = told.told_rig()
    with (
        open_rig(spec, seed=told.seed) as rig,
        live_views(told, rig) as watch,
        _Bar(output, recipe.name, timed=False) as bar,
    ):
        if doubt := doubted_payload(recipe, rig):
            output.warn(doubt)
        summary = run(
            recipe,
            rig,
            log,
            force=told.force,
            resume=told.resume,
            confirm=bar.ask if rig.by_hand and not told.yes else None,
            progress=bar.show if bar.visible else None,
            watch=watch,
            spec=spec,
        )
    _tell(summary, recipe, told, spec, rig.simulated)
    return 130 if summary.interrupted else 0


def _tell(summary: RunSummary, recipe: Recipe, told: RunOptions, rig: str, simulated: bool) -> None:
    from idtool.presentation.text import counted

    output = told.output
    loop = summary.loop
    document = {
        "file": summary.file if summary.rows else None,
        "experiment": recipe.experiment,
        "recipe": recipe.name,
        "rig": rig,
        "simulated": simulated,
        "rows": summary.rows,
        "trials": summary.trials,
        "duration_s": summary.duration_s,
        "interrupted": summary.interrupted,
        "resumed_trials": summary.resumed,
        "samples": loop.samples,
        "overruns": loop.overruns,
        "longest_period_s": loop.longest_s,
    }
    done = (
        f"{summary.file}: {counted(summary.rows, 'row')}, {counted(summary.trials, 'trial')}, "
        f"{summary.duration_s:.0f} s of rig time on {rig_words(rig, simulated)}"
    )
    output.result(document, () if output.quiet or summary.interrupted else [done])
    if summary.resumed == len(recipe.trials):
        output.say(f"note: every trial was in {summary.file} already; nothing was run.")
    if loop.overruns > _MANY_OVERRUNS * loop.samples:
        output.warn(
            f"{loop.overruns} of {loop.samples} samples came late, by up to {1e3 * loop.longest_s:.0f} ms "
            "after the one before; a slower period= or an idle computer helps (see docs/hardware.md)."
        )
    if summary.interrupted:
        kept = (
            f"{counted(summary.rows, 'row is', 'rows are')} kept in {summary.file}"
            if summary.rows
            else "no row was measured"
        )
        output.warn(
            f"interrupted: the axis was stopped; {kept} "
            f"({summary.trials} of {len(recipe.trials)} trials finished)."
        )
        if 0 < summary.trials < len(recipe.trials):
            command = click.get_current_context().command.name or "run"
            output.next(command, *given_words("--force", "--resume"), "--resume")
    elif summary.rows:
        output.next("check", summary.file)


class _Bar(Progress):
    """How far a run is, and the questions that it has for a person."""

    def show(self, now: RunProgress) -> None:
        """How far it is."""
        from idtool.presentation.pace import spoken

        self.at(now.share, 1.0)
        wait = spoken(now.wall_s_left)
        left = f"{wait} left" if self.narrow else f"{spoken(now.rig_s_left)} of rig time left (wait {wait})"
        self.say(f"trial {now.trial} of {now.trials}, {left}")

    def ask(self, trial: int, trials: int, setup: TrialSetup, before: TrialSetup | None) -> None:
        """Have a person set the axis up, and wait for Enter.

        Raises:
            UsageError: standard input ended: nobody is there.
        """
        from idtool.errors import UsageError

        self.stop()
        was = f" (now {_words(before)})" if before is not None else ""
        click.echo(
            f"trial {trial} of {trials}: set the axis to {_words(setup)}{was}, then press Enter; Ctrl-C ends",
            err=True,
        )
        if not sys.stdin.readline():
            raise UsageError(
                "nobody confirmed that the axis is set up for its trial; pass --yes if it needs no hand."
            )
        self.start()


def _words(setup: TrialSetup) -> str:
    """A set-up for a person."""
    tilt = f"{math.degrees(setup.tilt_alpha_rad):.3g}° and {math.degrees(setup.tilt_beta_rad):.3g}°"
    warm = "" if setup.temperature_degc is None else f", surroundings {setup.temperature_degc:g} °C"
    return f"payload {setup.payload_kg:g} kg, tilt {tilt}{warm}"
