"""`ffc-id demo`: the whole loop on the simulated rig."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .common import PATH, Output, defaulted, force_option, output_options, seed_option
from .progress import Progress

if TYPE_CHECKING:
    from idtool.parameters import Parameters
    from idtool.verbs.identification import Identification

    from .screen import Screen

#: The undeclared effect of the demo: the plant file's name among the package's data.
_PLANT = "demo_rig.toml"
_RECIPES = ("gravity", "sweep", "sine")
#: Published values (paper, tables 2 to 4; the gravity torques follow from table 2 and r = 26.5 mm).
_PUBLISHED = {
    "gravity": {"base": 0.2295, "per_payload": 0.4457},
    "static": {"coulomb": 0.070, "static": 0.030, "stribeck_velocity": 0.090, "viscous": 0.155},
    "dynamic": {"bristle_stiffness": 0.051, "bristle_damping": 0.297},
}


@click.command()
@defaulted("-o", "--output", "folder", default="demo", type=PATH, help="Where logs and results go.")
@seed_option
@force_option
@output_options
def demo(folder: Path, seed: int, force: bool, output: Output) -> None:
    """The whole loop on the simulated rig, with an undeclared effect.

    Runs the three experiments on the paper's axis, to which something was added that no parameter
    declares; fits, diagnoses, writes the report, and lets a simulated hand guide the axis.

    \b
    ffc-id demo -o demo
    """
    from importlib import resources

    from idtool.report import write_report
    from idtool.report.guiding import FILE as GUIDING
    from idtool.report.result_folder import result_folder, write_json, write_results
    from idtool.verbs.identify import identify

    began = time.perf_counter()
    with (
        result_folder(folder, force),
        resources.as_file(resources.files("idtool.data") / _PLANT) as plant,
        Progress(output) as progress,
    ):
        logs = _record(f"sim:{plant}", folder, seed, progress)
        result = identify(logs, seed=seed, tell=progress.say)
        write_results(result, folder, command="ffc-id demo", seed=seed)
        progress.say("guiding by hand")
        guided = _guide(f"sim:{plant}", result, seed)
        write_json(folder / GUIDING, guided)
        progress.say("drawing the report")
        page = write_report(folder, progress=progress.at)
    seconds = time.perf_counter() - began
    document = {
        "recovered": _recovered(result.parameters),
        "diagnosis": result.diagnosis,
        "teach": guided,
        "report": str(page),
        "seconds": seconds,
    }
    output.result(document, lambda screen: _show(screen, document))
    output.next("run-gravity", "--rig", "SPEC", "-o", "gravity.csv")


def _record(rig: str, folder: Path, seed: int, progress: Progress) -> list[Any]:
    from idtool.experiment.recipe import read_recipe
    from idtool.experiment.runner import run
    from idtool.log import Log
    from idtool.rig import open_rig

    logs = []
    with open_rig(rig, seed=seed) as axis:
        for name in _RECIPES:
            progress.say(f"running {name}")
            summary = run(read_recipe(name), axis, folder / f"{name}.csv", force=True)
            if summary.interrupted:
                raise KeyboardInterrupt
            logs.append(Log.read(summary.file))
    return logs


def _guide(rig: str, result: Identification, seed: int) -> dict[str, dict[str, Any]]:
    """Hand guiding with the model without the effect and with it, on the same axis."""
    from idtool.control import ForceFreeController
    from idtool.guiding import ImpedanceHand
    from idtool.guiding.session import limits_of, teach
    from idtool.rig import open_rig
    from idtool.rig.base import TrialSetup
    from idtool.verbs.identification import parameters_of

    extended = result.parameters
    base = replace(parameters_of(result.evidence.base), effects=())
    guided = {}
    for name, parameters in (("base model", base), ("extended model", extended)):
        with open_rig(rig, seed=seed) as axis:
            controller = ForceFreeController(parameters, 0.01, limits=limits_of(axis))
            hand = ImpedanceHand.at_slide(parameters, speed_mm_s=19.2)
            setup = TrialSetup(payload_kg=0.4, start_position=0.0)
            run = teach(parameters, controller, axis, setup, hand=hand)
        assert run.figures is not None
        guided[name] = run.figures.to_document()
    return guided


def _recovered(parameters: Parameters) -> list[dict[str, Any]]:
    from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC

    parts = {
        "gravity": (parameters.gravity, GRAVITY_MODELS["slide"]),
        "static": (parameters.static, STATIC),
        "dynamic": (parameters.dynamic, DYNAMIC),
    }
    rows = []
    for part, (values, dimensions) in parts.items():
        for name, published in _PUBLISHED[part].items():
            found = values[name]
            rows.append(
                {
                    "parameter": name,
                    "dimension": dimensions[name],
                    "published": published,
                    "recovered": found.value,
                    "stderr": found.stderr,
                    "off_percent": 100.0 * (found.value / published - 1.0),
                }
            )
    return rows


def _show(screen: Screen, document: dict[str, Any]) -> None:
    from idtool.model.units import unit_text
    from idtool.presentation.text import quantity

    from .diagnose import print_verdict
    from .tables import print_table

    print_table(
        screen,
        ("parameter", ">published", ">recovered", ">std error", ">off", "unit"),
        [
            (
                quantity(row["parameter"]),
                f"{row['published']:.4g}",
                f"{row['recovered']:.4g}",
                "" if row["stderr"] is None else f"{row['stderr']:.1g}",
                f"{row['off_percent']:+.1f} %",
                unit_text(row["dimension"], "rotary"),
            )
            for row in document["recovered"]
        ],
        title="recovered against published",
    )
    print_verdict(screen, document["diagnosis"])
    screen.print("\nhand guiding (published: 5.56 N, 19.20 mm/s, stop within 48 ms)", bold=True)
    for name, figures in document["teach"].items():
        click.echo(
            f"  {name}: {figures['force_n']:.2f} ± {figures['uneven_n']:.2f} N at"
            f" {figures['speed_mm_s']:.2f} mm/s, stop {figures['stop_ms']:.0f} ms,"
            f" overshoot {figures['overshoot_counts']:.1f} counts"
        )
    click.echo(f"\nreport: {document['report']}   ({document['seconds']:.0f} s)")
