"""The report: one HTML page that holds everything, and its figures beside it.

    write_report(Path("result"))    # result/report.html, result/figures/*.png

The page needs no network and no other file: figures are inside it, and a content policy forbids it to
load anything. Everything that comes from files is escaped by the template.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from idtool.diagnosis.summary import share
from idtool.effects import registry
from idtool.io.atomic import cannot_write, write_whole
from idtool.model.units import torque_name, unit_text
from idtool.presentation import style, text
from idtool.presentation.html import embedded, environment, resource
from idtool.presentation.mathml import typeset
from idtool.report import tables
from idtool.report.effect_pictures import found_picture, typical_picture
from idtool.report.evidence import Evidence, read_evidence
from idtool.report.facts import Found, Pair
from idtool.report.folding import quiet
from idtool.report.gallery import Plate, model_plates, uncertainty_plates
from idtool.report.guiding import read_guiding
from idtool.report.next_step import next_step
from idtool.report.residual_gallery import residual_plates
from idtool.report.verdict import left_sentence, sentence, summarise
from idtool.version import __version__

PAGE = "report.html"
FIGURES = "figures"
#: What of the provenance the page shows in words of its own.
_SHOWN = (
    "tool", "logs", "seed", "friction", "friction_law", "filter_hz", "verdict", "left_percent_of_torque",
    "depends_on",
)  # fmt: skip
#: Names of every figure that a report may have; those of an earlier report that this one lacks go.
_KNOWN = (
    "stribeck", "gravity", "loops_velocity", "loops_position", "prediction", "residual_time",
    "residual_position", "residual_velocity", "residual_acceleration", "residual_load", "residual_payload",
    "residual_temperature", "residual_histogram", "residual_autocorrelation", "spectrum_time",
    "spectrum_angle", "cumulative_periodogram", "candidates", "correlation", "bristle_stiffness",
)  # fmt: skip


@dataclass(frozen=True)
class Picture:
    """A figure as the page holds it: data address, size in pixels, words; `quiet` if it holds no finding."""

    plate: Plate
    address: str
    width: int
    height: int
    quiet: bool


def write_report(
    folder: Path, *, svg: bool = False, progress: Callable[[int, int], None] = lambda done, of: None
) -> Path:
    """Draw the report of a result folder into it; returns the page.

    Writes `report.html` and `figures/NAME.png`, each whole or not at all, and removes figures of an earlier
    report that this one does not have. With `svg` each figure comes as `figures/NAME.svg` too, which
    takes half as long again. `progress` is called with how many figures are drawn, and of how many.

    Raises:
        InputError: the folder's files are missing or broken, or it cannot be written.
    """
    evidence = read_evidence(folder)
    plates = all_plates(evidence)
    pictures = _draw(evidence, plates, folder / FIGURES, ("png", "svg") if svg else ("png",), progress)
    write_whole(folder / PAGE, _render(evidence, pictures))
    return folder / PAGE


def all_plates(evidence: Evidence) -> list[Plate]:
    """The figures that these data give, in their order."""
    return [*model_plates(evidence), *residual_plates(evidence), *uncertainty_plates(evidence)]


def _draw(
    evidence: Evidence,
    plates: list[Plate],
    folder: Path,
    forms: tuple[str, ...],
    progress: Callable[[int, int], None],
) -> list[Picture]:
    drawn = {f"{plate.name}.{form}" for plate in plates for form in forms}
    try:
        folder.mkdir(exist_ok=True)
        for name in _KNOWN:
            for form in ("png", "svg"):
                if f"{name}.{form}" not in drawn:
                    (folder / f"{name}.{form}").unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(folder, error) from error
    pictures = []
    for number, plate in enumerate(plates):
        progress(number, len(plates))
        figure = plate.draw()
        content = {form: style.render(figure, form) for form in forms}
        for form in forms:
            write_whole(folder / f"{plate.name}.{form}", content[form])
        pictures.append(Picture(plate, *embedded(content["png"]), quiet(evidence, plate.name)))
    return pictures


def _render(evidence: Evidence, pictures: list[Picture]) -> str:
    from markupsafe import Markup

    pages = environment()
    pages.filters |= {"code": _code, "sentence": sentence, "command": _command}
    pages.filters["typeset"] = lambda formula: Markup(typeset(formula))
    template = pages.from_string(resource("idtool.report", "page.html.jinja"))
    diagnosis, facts = evidence.diagnosis, evidence.facts
    error = diagnosis.error
    return template.render(
        style=resource("idtool.report", "page.css"),
        name=evidence.folder.resolve().name,
        version=__version__,
        kind=evidence.parameters.axis.kind,
        effort=torque_name(evidence.kind),
        unit=unit_text("torque", evidence.kind),
        summary=summarise(evidence),
        bars=_bars(evidence),
        error_change=_headline(evidence),
        extended=evidence.rows.extended,
        held_out=error.held_out.after is not None,
        effects=[_card(evidence, effect) for effect in diagnosis.effects],
        left=left_sentence(evidence),
        step=next_step(diagnosis, facts, evidence.parameters, Path(evidence.folder.resolve().name)),
        next_experiment=_next(evidence),
        groups=list(tables.parameter_groups(evidence)),
        errors=_errors(evidence),
        validation=_validation(evidence),
        position=_position(evidence),
        dependences=tables.dependence_rows(evidence),
        candidates=_candidates(evidence),
        guiding=read_guiding(evidence.folder),
        sections={
            section: [picture for picture in pictures if picture.plate.section == section]
            for section in ("model", "prediction", "residual", "uncertainty")
        },
        facts=facts,
        constant=_constant(evidence),
        provenance=_flat(
            {k: v for k, v in evidence.parameters.provenance.items() if k not in _SHOWN or not facts.logs}
        ),
    )


def _code(sentence: str) -> str:
    """The sentence as HTML; what stands in backticks is a command."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(sentence))))


def _command(words: Sequence[str]) -> str:
    return shlex.join(["ffc-id", *words])


def _position(evidence: Evidence) -> str:
    """The error of the simulated position, as a sentence; empty where there is none."""
    found = evidence.facts.position
    if found is None or found.rms_1s_windows is None:
        return ""
    return (
        f"Simulated from the logged {torque_name(evidence.kind)}, the position is off by "
        f"{text.number(found.rms_1s_windows, 3)} {found.unit} (rms over windows of one second, each from the "
        "measured state), on the logs that were identified."
    )


def _headline_pair(evidence: Evidence) -> tuple[float | None, float | None]:
    error = evidence.diagnosis.error
    pair = error.held_out if error.held_out.after is not None else error.training
    return pair.before, pair.after


def _headline(evidence: Evidence) -> str:
    """How much smaller the error became; the error itself where nothing was added."""
    before, after = _headline_pair(evidence)
    return text.change(before, after) if evidence.rows.extended else text.number(after, 3)


def _bars(evidence: Evidence) -> list[dict[str, Any]]:
    """The verdict's little chart: `length` is the share of the longest bar, 0 to 100."""
    before, after = _headline_pair(evidence)
    if evidence.rows.extended:
        values = [("base model", before, "before"), ("with what was found", after, "after")]
    else:
        values = [("model", after, "after")]
    values.append(("measurement noise", evidence.diagnosis.error.noise_floor, "floor"))
    longest = max((value for _, value, _ in values if value is not None), default=0.0) or 1.0
    return [
        {
            "name": name,
            "value": text.number(value, 3),
            "length": round(100.0 * value / longest, 1),
            "kind": kind,
        }
        for name, value, kind in values
        if value is not None
    ]


def _errors(evidence: Evidence) -> list[dict[str, str]]:
    error, validation = evidence.diagnosis.error, evidence.diagnosis.validation
    pairs: dict[str, Pair] = {"held out": error.held_out, "training": error.training}
    pairs |= {text.words(name): pair for name, pair in error.by_experiment.items()}
    rows = [(name, pair) for name, pair in pairs.items() if (pair.before, pair.after) != (None, None)]
    for name, one in (validation.errors if validation else {}).items():
        own = f"validation: {text.words(name)}" if name not in ("", "validation") else "validation"
        rows.append((own, Pair(after=one.rmse)))
    return [
        {
            "name": name,
            "before": text.number(pair.before, 3),
            "after": text.number(pair.after, 3),
            "change": text.change(pair.before, pair.after),
        }
        for name, pair in rows
    ]


def _validation(evidence: Evidence) -> str:
    """What the rows of validation are, as a sentence; empty where no log was given for it."""
    validation = evidence.diagnosis.validation
    if validation is None:
        return ""
    errors = validation.errors.values()
    sizes = text.listed([share(e.relative_percent) for e in errors if e.relative_percent is not None])
    rows = sum(e.rows or 0 for e in errors)
    model = "the extended model" if evidence.rows.extended else "the model"
    logs = text.listed([Path(log).name for log in validation.logs])
    return (
        f"Validation is every row ({rows}) of {logs}, which no fit saw, predicted with {model}: off "
        f"by {sizes} of the {torque_name(evidence.kind)}."
    )


def _card(evidence: Evidence, effect: Found) -> dict[str, Any]:
    """An accepted effect: what it is, how sure, and what looks like it."""
    known = registry.get(effect.name) if registry.knows(effect.name) else None
    pictures = (found_picture(evidence, known), typical_picture(known)) if known else ()
    return {
        "title": text.effect_title(effect.name),
        "formula": known.formula if known else "",
        "share": "" if effect.percent_of_torque is None else share(effect.percent_of_torque),
        "p_value": text.p_text(effect.p_value),
        "alternatives": text.listed([text.effect_title(name) for name in effect.alternatives], "or"),
        "reveals": known.reveals if known else "",
        "page": known.page if known else "",
        "pictures": list(filter(None, pictures)),
    }


def _candidates(evidence: Evidence) -> list[dict[str, Any]]:
    return [
        {
            "title": text.effect_title(candidate.name),
            "held_out": text.number(candidate.held_out, 3),
            "p_value": text.p_text(candidate.p_value),
            "accepted": candidate.accepted,
            "why": candidate.why,
        }
        for candidate in evidence.diagnosis.tried
    ]


def _next(evidence: Evidence) -> dict[str, str] | None:
    proposed = evidence.diagnosis.next_experiment
    if proposed is None:
        return None
    separates = text.listed([text.effect_title(name) for name in proposed.separates], "from")
    return {"separates": separates, "recipe": _toml(proposed.recipe)}


def _toml(document: Mapping[str, Any]) -> str:
    try:
        return tomli_w.dumps(document)
    except (TypeError, ValueError):  # a null inside, which TOML has no word for
        return json.dumps(document, indent=1)


def _constant(evidence: Evidence) -> str:
    constant = evidence.parameters.axis.torque_constant
    return (
        "" if constant is None else f"{text.number(constant)} {unit_text('torque_constant', evidence.kind)}"
    )


def _flat(table: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    """A table as (dotted key, text); what is nested deeper than the page can show is written as JSON."""
    rows: list[tuple[str, str]] = []
    for key, value in table.items():
        if isinstance(value, dict):
            rows += _flat(value, f"{prefix}{key}.")
        else:
            rows.append(
                (f"{prefix}{key}", value if isinstance(value, str) else json.dumps(value, default=str))
            )
    return rows
