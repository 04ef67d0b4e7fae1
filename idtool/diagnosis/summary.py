"""A diagnosis in a few lines of text, as the terminal and a notebook show them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from idtool.presentation.text import listed, words

#: How the note begins that tells a shape without a name.
LOOKS_LIKE = "what is left looks like this"
_VERDICTS = {
    "adequate": "the base model is adequate: no effect is missing",
    "effect_found": "effect found, and nothing structured is left",
    "ambiguous": "ambiguous: two explanations fit these data equally well",
    "unexplained": "something is left that no effect of the library accounts for",
}


def summary_lines(diagnosis: Mapping[str, Any]) -> list[str]:
    """The verdict, each found effect with its share of the torque, what is left, the errors, the notes.

    Args:
        diagnosis: the document of diagnosis.json.

    Returns:
        Lines without indentation; the first is the verdict.
    """
    lines = [f"verdict: {diagnosis['verdict']} ({_VERDICTS[diagnosis['verdict']]})"]
    lines += [_effect_line(effect) for effect in found(diagnosis)]
    lines.append(_left_line(diagnosis))
    error = diagnosis["error"]
    unit, held_out = unit_of(diagnosis), error["held_out"]
    before, after = f"{held_out['before']:.4g} {unit}", f"{held_out['after']:.4g} {unit}"
    lines.append(f"error on held-out trials: {before} before, {after} after")
    for name, validated in diagnosis.get("validation", {}).get("errors", {}).items():
        of = f", {name}" if name not in ("", "validation") else ""
        lines.append(
            f"validation{of}: {validated['rmse']:.4g} {unit}, "
            f"{validated['relative_percent']:.3g} % of the torque, {validated['rows']} rows that no fit saw"
        )
    if diagnosis["unexplained"]:
        lines.append(f"unexplained: {diagnosis['unexplained']['note']}")
    if diagnosis["next_experiment"]:
        lines.append(f"next experiment: {diagnosis['next_experiment']['why']}")
    return [*lines, *(f"note: {note}" for note in diagnosis["notes"])]


def found(diagnosis: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The accepted effects; inertia belongs to the base model."""
    return [effect for effect in diagnosis["effects"] if effect["name"] != "inertia"]


def unit_of(diagnosis: Mapping[str, Any]) -> str:
    """Unit of the errors."""
    return {"n": "N", "a": "A", "v": "V"}.get(diagnosis["error"]["metric"].rpartition("_")[2], "N m")


def share(percent: float) -> str:
    """Per cent of the torque as a person reads it: two digits, no more than one after the point.

    >>> share(23.81), share(2.345), share(0.031)
    ('24 %', '2.3 %', 'below 0.1 %')
    """
    if percent < 0.1:
        return "below 0.1 %"
    return f"{percent:.0f} %" if percent >= 10.0 else f"{percent:.1f} %"


def _effect_line(effect: Mapping[str, Any]) -> str:
    also = f" (or {listed(effect['alternatives'], 'or')})" if effect["alternatives"] else ""
    return f"effect: {effect['name']}, {share(effect['percent_of_torque'])} of the torque{also}"


def _left_line(diagnosis: Mapping[str, Any]) -> str:
    left, noise = (share(diagnosis["left"][key]) for key in ("percent_of_torque", "noise_percent"))
    line = f"left: {left} of the torque; sensor noise {noise}"
    unexplained = diagnosis["unexplained"]
    if unexplained and unexplained["depends_on"]:
        line += f"; depends on {listed([words(name) for name in unexplained['depends_on']])}"
    return line
