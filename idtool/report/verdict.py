"""The result in a few sentences: what was found, how much it helps, and whether to trust it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from idtool.diagnosis.summary import LOOKS_LIKE, share
from idtool.effects import registry
from idtool.model.units import torque_name, unit_text
from idtool.parameters.rows import rows_of
from idtool.presentation import text
from idtool.report.evidence import Evidence
from idtool.report.residual_gallery import SIGNIFICANT, depends

Mark = Literal["good", "doubt", "care", "bad"]

#: A held-out error up to this many times the noise floor counts as reaching it.
_NEAR_FLOOR = 1.3
#: Findings that the head of the page tells; the rest stand below.
_MOST_FINDINGS = 3
#: Effects that a doubt names, the least likely to be chance first.
_MOST_HIDDEN = 3


@dataclass(frozen=True)
class Check:
    """One reason to trust the result, or not to."""

    mark: Mark
    sentence: str


@dataclass(frozen=True)
class Finding:
    """One number of a found effect, as text."""

    meaning: str
    value: str


@dataclass(frozen=True)
class Summary:
    """The top of the page.

    Attributes:
        mark: colour of the verdict.
        headline: what was found.
        story: one or two sentences on it.
        findings: how strong the found effects are, a number each.
        trust: "Yes", "Yes, with one doubt", "With care" or "Not yet".
        checks: the reasons, the gravest first.
    """

    mark: Mark
    headline: str
    story: str
    trust: str
    trust_mark: Mark
    findings: tuple[Finding, ...]
    checks: tuple[Check, ...]


def summarise(evidence: Evidence) -> Summary:
    """The verdict, and whether it deserves trust."""
    order = {"bad": 0, "care": 1, "doubt": 2, "good": 3}
    checks = sorted(_checks(evidence), key=lambda check: order[check.mark])
    gravest = checks[0].mark
    trust = {"good": "Yes", "doubt": "Yes, with one doubt", "care": "With care", "bad": "Not yet"}[gravest]
    headline, story = _headline(evidence), _story(evidence)
    mark: Mark = {"adequate": "good", "effect_found": "good", "ambiguous": "care", "unexplained": "bad"}[
        evidence.diagnosis.verdict
    ]  # type: ignore[assignment]
    return Summary(mark, headline, story, trust, gravest, tuple(_findings(evidence)), tuple(checks))


def _shared(evidence: Evidence) -> list[str]:
    """The found effects, the largest first, each with its share where known; of what, is said once."""
    found = sorted(evidence.diagnosis.effects, key=lambda effect: -(effect.percent_of_torque or 0.0))
    said: list[str] = []
    for effect in found:
        of = "" if any("of the torque" in one for one in said) else " of the torque"
        size = effect.percent_of_torque
        said.append(text.effect_title(effect.name) + ("" if size is None else f" ({share(size)}{of})"))
    return said


def left_sentence(evidence: Evidence) -> str:
    """What is left on the held-out rows, in per cent of the torque; empty where nobody computed it."""
    left, noise = evidence.diagnosis.left.percent_of_torque, evidence.diagnosis.left.noise_percent
    if left is None:
        return ""
    unexplained = evidence.diagnosis.unexplained
    depends = [text.quantity(name) for name in unexplained.depends_on] if unexplained else []
    on = f"; it depends on {text.listed(depends)}" if depends else ""
    floor = "" if noise is None else f" (sensor noise {share(noise)})"
    return f"{share(left)} of the {torque_name(evidence.kind)} is left{floor}{on}."


def _findings(evidence: Evidence) -> Iterator[Finding]:
    """The leading parameters of the found effects, so many that the tile stays a tile."""
    names = [effect.name for effect in evidence.diagnosis.effects]  # the file holds what is no finding too
    found = [entry for entry in evidence.parameters.effects if entry.name in names]
    each = 3 if len(found) == 1 else 1
    for entry in found[:_MOST_FINDINGS]:
        effect = registry.get(entry.name)
        of = "" if each > 1 else f"{text.effect_title(entry.name)}: "
        together = effect.together({name: one.value for name, one in entry.parameters.items()})
        if together is not None:
            yield Finding(f"{of}{together[0]}", f"{100.0 * together[1]:.3g} %")
        for known in effect.parameters[: each - (together is not None)]:
            parameter = entry.parameters.get(known.name)
            if parameter is None or known.dimension == "phase":
                continue
            value, stderr, _ = text.uncertain(parameter.value, parameter.stderr, None)
            unit = unit_text(known.dimension, evidence.kind)
            spread = "" if stderr == "–" else f" ± {stderr}"
            yield Finding(
                f"{of}{text.meaning_on(evidence.kind, known.meaning)}", f"{value}{spread} {unit}".strip()
            )


def _headline(evidence: Evidence) -> str:
    found = text.listed(_shared(evidence))
    verdict = evidence.diagnosis.verdict
    if verdict == "adequate":
        return "The model is adequate"
    if verdict == "effect_found":
        return f"Found: {found}" if found else "An effect was found"
    if verdict == "ambiguous":
        ties = _ties(evidence)
        return f"A tie: {text.listed(ties, 'or')}" if ties else "Two explanations tie"
    if found:
        return f"Found: {found}; but structure is left"
    left = "Structure is left"
    return left if evidence.diagnosis.textbook else f"{left} that no effect explains"


def _ties(evidence: Evidence) -> list[str]:
    for effect in evidence.diagnosis.effects:
        if effect.alternatives:
            return [text.effect_title(name) for name in (effect.name, *effect.alternatives)]
    proposed = evidence.diagnosis.next_experiment
    return [text.effect_title(name) for name in proposed.separates] if proposed else []


def _story(evidence: Evidence) -> str:
    diagnosis, kind = evidence.diagnosis, evidence.kind
    friction = {
        "lugre": "LuGre friction",
        "stribeck": "Stribeck friction",
        "coulomb": "Coulomb and viscous friction",
    }.get(evidence.facts.friction, f"{evidence.facts.friction} friction")
    base = f"gravity and {friction}" if evidence.parameters.gravity_model else friction
    explain = "explain" if evidence.parameters.gravity_model else "explains"
    effort = torque_name(kind)
    if diagnosis.verdict == "adequate":
        with_inertia = " with inertia" if evidence.parameters.effect("inertia") else ""
        return f"{_capital(base)}{with_inertia} {explain} the measured {effort}; nothing further is needed."
    if diagnosis.verdict == "effect_found":
        them = "it" if len(diagnosis.effects) == 1 else "them"
        return f"With {them}, {base} {explain} the measured {effort}."
    if diagnosis.verdict == "ambiguous":
        return "These data cannot tell them apart. The run proposed below would."
    left = diagnosis.unexplained
    why = "no effect in the library accounts for it"
    if diagnosis.textbook:
        why = "no effect was looked for, as the textbook model was asked for"
    if left is None:
        return f"What is left of the {effort} is not noise, and {why}."
    share = "" if left.share is None else f" ({text.percent(left.share)} of its variance)"
    on = f" with {text.listed([text.quantity(name) for name in left.depends_on])}" if left.depends_on else ""
    more = next((note for note in evidence.facts.notes if note.startswith(LOOKS_LIKE)), "")
    if not left.depends_on:
        more = left.note
    still = f"What is left of the {effort} still varies{on}{share}"
    also = f" {_capital(sentence(more))}" if more else ""
    return f"{still}, and {why}.{also}"


def _checks(evidence: Evidence) -> Iterator[Check]:
    yield _verdict_check(evidence)
    yield from _hidden_check(evidence)
    yield _held_out_check(evidence)
    yield from _floor_check(evidence)
    yield _parameter_check(evidence)
    yield from _residual_check(evidence)
    yield from _passive_check(evidence)


def _verdict_check(evidence: Evidence) -> Check:
    verdict = evidence.diagnosis.verdict
    if verdict == "unexplained":
        unnamed = "" if evidence.diagnosis.textbook else " that no effect accounts for"
        return Check("bad", f"Structure is left{unnamed}: the model is not complete.")
    if verdict == "ambiguous":
        return Check("care", "Two explanations fit equally well: the prediction holds, the cause is open.")
    return Check("good", "The diagnosis asks for no further effect.")


def _hidden_check(evidence: Evidence) -> Iterator[Check]:
    """Effects that were turned down though they are no chance."""
    names = [text.effect_title(name) for name in evidence.diagnosis.hidden[:_MOST_HIDDEN]]
    if names:
        yield Check(
            "doubt",
            f"{_capital(text.listed(names, 'or'))} would explain a part of what looks like "
            "noise, and that is no chance; the intervals allow for it.",
        )


def _held_out_check(evidence: Evidence) -> Check:
    spans, rows = evidence.rows.held_out_spans, evidence.rows
    error = evidence.diagnosis.error.held_out
    if not spans or error.after is None:
        return Check("bad", "Nothing was held out: the errors are those of the fit itself.")
    whole = {(segment.rows.start, segment.rows.stop) for segment in rows.segments}
    blocks = evidence.diagnosis.error.blocks_stand_in_for_trials
    in_trials = not blocks and all((span.rows.start, span.rows.stop) in whole for span in spans)
    if in_trials:
        what = text.counted(len(spans), "whole trial")
    else:
        what = text.counted(len(spans), "block of time", "blocks of time")
    verb = "was" if len(spans) == 1 else "were"
    if error.before is not None and error.after > 1.02 * error.before:
        return Check(
            "bad", f"On {what} that {verb} held out, the extended model is worse than the base model."
        )
    if not in_trials:
        return Check("care", f"Too few trials to hold some out: the errors are from {what} inside trials.")
    return Check(
        "good", f"The errors are from {what} that neither the parameters nor the choice of effects saw."
    )


def _floor_check(evidence: Evidence) -> Iterator[Check]:
    error = evidence.diagnosis.error
    after, floor = error.held_out.after, error.noise_floor
    if after is None or floor is None or floor <= 0:
        return
    unit = unit_text("torque", evidence.kind)
    noise = f"the measurement noise ({text.number(floor, 2)} {unit})"
    if after <= _NEAR_FLOOR * floor:
        yield Check("good", f"The error has reached {noise}.")
    else:
        yield Check("care", f"The error is {text.number(after / floor, 2)} times {noise}.")


def _parameter_check(evidence: Evidence) -> Check:
    named = [(text.quantity(row.name), row.parameter) for row in rows_of(evidence.parameters)]
    at_bound = [name for name, p in named if p.at_bound]
    unknown = [name for name, p in named if not (p.identified or p.at_bound)]
    if not any(p.identified for _, p in named):
        return Check("bad", "The data determine no parameter at all.")
    if at_bound or unknown:
        parts = []
        if at_bound:
            parts.append(f"{text.listed(at_bound)} {'sits' if len(at_bound) == 1 else 'sit'} at a bound")
        if unknown:
            parts.append(f"the data do not determine {text.listed(unknown)}")
        return Check("care", f"{_capital('; '.join(parts))}.")
    return Check("good", f"The data determine all {len(named)} parameters, none at a bound.")


def _residual_check(evidence: Evidence) -> Iterator[Check]:
    tests = evidence.facts.residual_tests
    if tests is None or not tests.after:
        return
    left = [text.quantity(t.variable) for t in tests.after if depends(t)]
    unexplained = evidence.diagnosis.unexplained
    if left and evidence.diagnosis.verdict == "unexplained":
        yield Check("care", f"The residual still depends on {text.listed(left)} (p below {SIGNIFICANT}).")
    elif unexplained and unexplained.depends_on:  # a shape over it was found, by no test of smoothness
        followed = text.listed([text.quantity(name) for name in unexplained.depends_on])
        yield Check("care", f"What is left follows {followed}.")
    elif left:  # tested by itself, one variable is clearer than structure that the verdict takes for such
        depends_on = f"The residual still depends on {text.listed(left)} (p below {SIGNIFICANT})"
        yield Check("good", f"{depends_on}, but by less than the verdict counts as structure.")
    else:
        tested = text.listed([text.quantity(test.variable) for test in tests.after], "or")
        yield Check("good", f"The residual does not depend on {tested}.")


def _passive_check(evidence: Evidence) -> Iterator[Check]:
    """Passivity of the bristle, which a controller that compensates it relies on."""
    static, dynamic = evidence.parameters.static, evidence.parameters.dynamic
    if not static or not dynamic or static["coulomb"].value <= 0:
        return
    drop = (static["static"].value - static["coulomb"].value) / static["coulomb"].value
    if static["viscous"].value > dynamic["bristle_damping"].value * drop:
        yield Check("good", "The friction model is passive: it cannot feed energy into the axis.")
    else:
        yield Check(
            "care",
            "The friction model is not passive (σ2 is below σ1 (τs − τc)/τc): compensate it with a margin, "
            "or hand guiding may vibrate.",
        )


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def sentence(note: str) -> str:
    """A note with a capital and a full stop."""
    note = _capital(note.strip())
    return note if note.endswith((".", "!", "?")) else f"{note}."
