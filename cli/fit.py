"""`ffc-id fit-gravity`, `fit-static` and `fit-dynamic`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .axis import Given, axis_options
from .common import (
    PATH,
    Decorator,
    Output,
    defaulted,
    handed,
    logs_argument,
    output_options,
    params_option,
    picture_name,
    seed_option,
)
from .words import Choice

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from idtool.fit.joint import JointFit
    from idtool.parameters import Parameters
    from idtool.signals import Recording

    from .screen import Screen

friction_option = defaulted(
    "--friction",
    type=Choice(("lugre", "stribeck", "coulomb")),
    default="lugre",
    help="Friction law; it steps down by itself where the data cannot determine it.",
)
optimizer_option = defaulted(
    "--optimizer",
    type=Choice(("direct", "crs2", "isres", "esch")),
    default="direct",
    help="NLopt global search: DIRECT-L (deterministic), CRS2, ISRES or the evolutionary ESCH.",
)


#: Experiments of a session, in the order in which their parts are fitted.
EXPERIMENTS = ("gravity", "sweep", "sine")


@dataclass(frozen=True)
class _Part:
    """A fit of one part of a parameter file, as it was asked for."""

    logs: Sequence[Path]
    params: Path
    figure: Path | None
    given: Given
    optimizer: str
    seed: int
    output: Output

    def read(self) -> tuple[Recording, Parameters]:
        """The logs as one, and the parameter file that is there, or a blank one of their axis.

        Raises:
            InputError: logs that cannot be used, or of another axis than the file.
        """
        from idtool.errors import InputError
        from idtool.parameters import Parameters
        from idtool.signals import record

        read = self.given.read(self.logs, self.output)
        recording = record(read)
        self.output.warn(*recording.contradictions)
        if not self.params.exists():
            return recording, Parameters(axis=recording.axis)
        known = Parameters.read(self.params)
        mine, theirs = recording.axis, known.axis
        same = (mine.torque_constant, mine.effort) == (theirs.torque_constant, theirs.effort)
        if not same or not mine.agrees(theirs):
            raise InputError(
                f"is of another axis than {read[0].source} (kind, torque constant or unit of the effort "
                "differs)",
                file=self.params,
                place="[axis]",
                remedy="name another parameter file",
            )
        return recording, known

    def finish(
        self,
        part: str,
        known: Parameters,
        parameters: Parameters,
        fit: JointFit,
        notes: list[str],
        quality: dict[str, Any],
        draw: Callable[[], Figure],
    ) -> None:
        """Write the file and the figure, and tell what came out.

        Args:
            part: "gravity", "static" or "dynamic".
            known: the file as it was read.
            parameters: with that part fitted.
            fit: of which that is a part.
            notes: sentences on it.
            quality: how well it fits.
            draw: makes the figure.
        """
        from idtool.fit.findings import findings
        from idtool.fit.identifiability import shortcomings

        from .tables import document_of, print_parameters

        recording = fit.model.recording
        ended = {f"fit_{part}": fit.outcome.value} | ({"rig": recording.rig} if recording.rig else {})
        parameters = replace(parameters, provenance={**parameters.provenance, **ended})
        parameters.write_over(self.params, known)
        if self.figure is not None:
            from idtool.report import save_figure

            save_figure(draw(), self.figure)
        parts = ("dynamic", "effects") if part == "dynamic" else (part,)
        notes = [*notes, *findings(fit, parts)]

        def show(screen: Screen) -> None:
            print_parameters(screen, parameters, parts)
            for name, value in quality.items():
                if isinstance(value, float) and math.isfinite(value):
                    click.echo(f"{name.replace('_', ' ')}: {value:.5g}")
            for note in notes:
                click.echo(f"note: {note}")
            click.echo(f"written: {self.params}" + (f", figure {self.figure}" if self.figure else ""))

        document = {
            "params": str(self.params),
            "figure": str(self.figure) if self.figure is not None else None,
            "parameters": document_of(parameters, part),
            "quality": quality,
            "fit": fit.outcome.value,
            "notes": [*recording.contradictions, *notes],
            "findings": [one.to_document() for one in shortcomings(fit, parts)],
        }
        self.output.result(document, show)
        self.output.next(*self._following(part, recording), odd=recording.odd)

    def _following(self, part: str, recording: Recording) -> list[str | Path]:
        """The next fit with a log that is there, or the run that makes one."""
        from .onward import ANY_RIG, logs_beside

        here = set(recording.experiment)
        own = here <= set(EXPERIMENTS)  # a log from elsewhere is none of these, and may be all there is
        if part == "dynamic":
            others = logs_beside(self.logs, [name for name in EXPERIMENTS if name not in here]) if own else []
            return ["diagnose", *others, *self.logs, "-p", self.params, "-o", "result"]
        command, experiment = {"gravity": ("fit-static", "sweep"), "static": ("fit-dynamic", "sine")}[part]
        logs = logs_beside(self.logs, [experiment]) if own and experiment not in here else self.logs
        if logs:
            return [command, *logs, "-p", self.params]
        return [f"run-{experiment}", "--rig", recording.rig or ANY_RIG, "-o", f"{experiment}.csv"]


def _shared(params: str) -> Decorator:
    return handed(
        "part",
        _Part,
        logs_argument,
        params_option(params),
        click.option(
            "--figure", type=PATH, callback=picture_name, help="Draw a figure too, to this PNG or SVG."
        ),
        axis_options,
        optimizer_option,
        seed_option,
        output_options,
    )


@click.command("fit-gravity")
@_shared("Parameter file; made if missing.")
def fit_gravity(part: _Part) -> None:
    """Recover the gravity coefficients from payload steps and add them to the parameter file.

    \b
    ffc-id fit-gravity gravity.csv -p params.toml
    """
    from idtool.fit.results import gravity_parameters
    from idtool.fit.staged import fit_gravity as fit
    from idtool.signals.coverage import constant_tilt

    recording, known = part.read()
    result = fit(recording, optimizer=part.optimizer, seed=part.seed)
    spec = result.fit.model.spec
    fitted, notes = _doubted(result.fit)
    parameters = replace(
        known, gravity_model=spec.gravity, gravity=gravity_parameters(fitted), weightless=False
    )
    points = [(p.payload, p) for p in result.points if p.payload is not None]
    if spec.gravity == "slide" and "per_payload" in spec.gravity_columns:
        notes.append("payload steps determine m1 + 2 m2 and the payload slope, not m1 and m2 apart.")
    if spec.gravity == "slide" and "base" in spec.gravity_columns and constant_tilt(recording.motion):
        notes.append(
            "at one tilt the base includes any constant torque of the drive, and both coefficients are as "
            "right as the tilt that was told; `ffc-id identify` with runs at other tilts tells them apart."
        )

    def draw() -> Figure:
        from idtool.report import gravity_figure

        if not points:
            raise click.UsageError("--figure shows payload steps, and these logs have none.")
        return gravity_figure(
            [payload for payload, _ in points],
            [p.torque for _, p in points],
            base=parameters.gravity["base"].value,
            per_payload=parameters.gravity["per_payload"].value,
            kind=recording.axis.units,
            stderr=[p.stderr for _, p in points],
        )

    quality = {"average_error_percent": result.average_error}
    part.finish("gravity", known, parameters, fitted, notes, quality, draw)


@click.command("fit-static")
@friction_option
@_shared("Parameter file; made if missing.")
def fit_static(part: _Part, friction: str) -> None:
    """Recover the static (Stribeck) friction parameters from a velocity sweep.

    The windows of constant speed are checked for being steady; where a soft bristle has not settled,
    the rest of its transient is taken off. Gravity that the file has already is held.

    \b
    ffc-id fit-static sweep.csv -p params.toml
    """
    from idtool.fit.results import static_parameters
    from idtool.fit.staged import fit_static as fit

    recording, known = part.read()
    result = fit(recording, known, law=friction, optimizer=part.optimizer, seed=part.seed)
    fitted, notes = _doubted(result.fit)
    parameters = replace(known, static=static_parameters(fitted))

    def draw() -> Figure:
        from idtool.report import stribeck_figure
        from idtool.report.result_folder import stribeck_curve

        curve = stribeck_curve(fitted)
        return stribeck_figure(
            [w.velocity for w in result.windows],
            [w.friction for w in result.windows],
            kind=recording.axis.units,
            stderr=[w.stderr for w in result.windows],
            steady=[w.steady for w in result.windows],
            curve_velocity=curve["velocity"],
            curve_torque=curve["torque"],
            low=curve["low"],
            high=curve["high"],
        )

    quality = {
        "adjusted_r2": result.adjusted_r2,
        "windows": len(result.windows),
        "curve_fit": result.curve,
        "curve_outcome": result.curve_outcome.value,
    }
    if not result.curve_outcome.converged:
        notes.append(
            f"the curve through the windows: {result.curve_outcome.value}; the joint fit's stands for it."
        )
    part.finish("static", known, parameters, fitted, notes, quality, draw)


@click.command("fit-dynamic")
@_shared("Parameter file with [friction.static], rewritten.")
def fit_dynamic(part: _Part) -> None:
    """Recover sigma0 and sigma1 of the LuGre model from sines, with NLopt's global search.

    The static parameters and the gravity of the file are held. Inertia is estimated along and written
    into the file as an effect.

    \b
    ffc-id fit-dynamic sine.csv -p params.toml
    """
    from idtool.effects import registry
    from idtool.errors import InputError
    from idtool.fit.results import dynamic_parameters, effect_entry
    from idtool.fit.staged import fit_dynamic as fit

    recording, known = part.read()
    if not known.static:
        there = part.params.exists()
        why = "has no [friction.static] yet" if there else "no such file, which holds [friction.static]"
        raise InputError(why, file=part.params, remedy="run ffc-id fit-static first, or ffc-id identify")
    result = fit(recording, known, optimizer=part.optimizer, seed=part.seed)
    fitted, notes = _doubted(result.fit)
    parameters = replace(known, dynamic=dynamic_parameters(fitted))
    if any(effect.name == "inertia" for effect in result.fit.model.spec.effects):
        parameters = parameters.with_effect(effect_entry(fitted, registry.get("inertia")))

    def draw() -> Figure:
        from idtool.report import dynamic_figure

        rows, model = recording.row, result.fit.model
        return dynamic_figure(
            recording.filtered_trial,
            recording.motion.velocity[rows],
            model.measured,
            model.measured - result.fit.residual,
            kind=recording.axis.units,
            time=recording.motion.time[rows],
        )

    quality = {
        "rmse_filtered": result.fit.rmse,
        "relative_percent": 100.0 * result.fit.relative,
        "model_evaluations": result.fit.evaluations,
    }
    part.finish("dynamic", known, parameters, fitted, notes, quality, draw)


def _doubted(fit: JointFit) -> tuple[JointFit, list[str]]:
    """The fit with intervals that allow for what its model lacks, and a sentence on that."""
    from idtool.diagnosis.remainder import remainder
    from idtool.diagnosis.suspects import allowing_for_what_lacks

    left = remainder(fit)
    fit, found = allowing_for_what_lacks(fit, left)
    if left is not None:
        follows = f"follows the {', the '.join(left.depends_on)}" if left.depends_on else "is no noise"
        lacks = f"what it leaves {follows} ({100.0 * left.share:.0f} % of its square)"
    elif found:
        names = " or ".join(one.effect.name for one in found[:3])
        lacks = f"{names} would explain a part of what looks like noise"
    else:
        return fit, []
    return fit, [
        f"the model lacks something: {lacks}. The intervals allow for what that can have done; "
        "ffc-id identify with all logs of the axis looks for it."
    ]
