"""Two parameter files side by side: unit to unit, or before and after maintenance.

A parameter differs when its difference is beyond what the standard errors of both fits allow, after
Holm's correction for how many parameters are compared. On logs, the prediction errors of both files are
compared trial by trial.

    comparison = compare(before, after, [Log.read("validation.csv")])
    comparison.sentence
    [line.name for line in comparison.parameters if line.differs]

Sources: Welch 1947 (unequal errors, few degrees of freedom), Holm 1979.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from scipy import special

from idtool.compare.paired_errors import ErrorLine, paired_errors
from idtool.compare.position_errors import position_errors
from idtool.diagnosis.holm import holm
from idtool.effects import registry
from idtool.errors import InputError
from idtool.fit.model import LOGARITHMIC
from idtool.log import Log
from idtool.model.units import Units, unit_text
from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC, EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis
from idtool.presentation.text import listed, quantity

SCHEMA = "ffc-id/comparison/1"
#: Chance that two fits of one unchanged axis are said to differ, over everything that is compared.
LEVEL = 0.01
#: An amplitude within so many standard errors of zero has no phase to speak of.
_CLEAR = 4.0
#: Constants of an effect (a centre, a reference temperature) are the same within this share.
_SAME_CONSTANT = 0.02


@dataclass(frozen=True)
class ParameterLine:
    """One parameter in both files.

    Attributes:
        part: "gravity", "static", "dynamic" or the name of an effect.
        name: base name.
        unit: as a person reads it.
        a, b: the parameter in each file; None where a file lacks it.
        difference: b - a; a phase by the shorter way round. None where one lacks it.
        stderr: of the difference; None where it was not tested.
        z: difference over its standard error (of the logarithms where the fit estimates those).
        p_value: of no difference, before correction.
        corrected: after Holm's correction.
        why: why it was not tested; "" if it was.
    """

    part: str
    name: str
    unit: str
    a: Parameter | None
    b: Parameter | None
    difference: float | None = None
    stderr: float | None = None
    z: float | None = None
    p_value: float | None = None
    corrected: float | None = None
    why: str = ""

    @property
    def title(self) -> str:
        """What a person calls it."""
        name = quantity(self.name)
        return name if self.part in ("gravity", "static", "dynamic") else f"{self.part}: {name}"

    @property
    def differs(self) -> bool:
        """Beyond the uncertainty of both."""
        return self.corrected is not None and self.corrected < LEVEL

    def to_document(self) -> dict[str, Any]:
        """As JSON."""
        return {
            "part": self.part,
            "name": self.name,
            "unit": self.unit,
            "a": self.a.to_table() if self.a else None,
            "b": self.b.to_table() if self.b else None,
            "difference": self.difference,
            "stderr": self.stderr,
            "z": self.z,
            "p_value": self.p_value,
            "p_corrected": self.corrected,
            "differs": self.differs,
            "not_tested": self.why or None,
        }


@dataclass(frozen=True)
class Comparison:
    """Two parameter files, compared.

    Attributes:
        kind: of both axes.
        parameters: every parameter that either file holds.
        only_a, only_b: effects that one file holds and the other does not.
        errors: prediction errors, all rows first; empty without logs.
        notes: sentences that qualify the result.
        positions: errors of the simulated position with each file (`idtool.compare.position_errors`); None
            without logs, or where one of the files cannot be simulated.
    """

    kind: Units
    parameters: tuple[ParameterLine, ...]
    only_a: tuple[str, ...]
    only_b: tuple[str, ...]
    errors: tuple[ErrorLine, ...]
    notes: tuple[str, ...]
    positions: tuple[dict[str, float | str], dict[str, float | str]] | None = None

    @property
    def differing(self) -> list[ParameterLine]:
        """Parameters that differ, the clearest first."""
        lines = [line for line in self.parameters if line.differs]
        return sorted(lines, key=lambda line: -abs(line.z or 0.0))

    @property
    def tested(self) -> int:
        """How many parameters could be tested."""
        return sum(line.corrected is not None for line in self.parameters)

    @property
    def verdict(self) -> str:
        """ "different", "effects_differ", "no_difference" or "nothing_to_compare"."""
        if self.differing:
            return "different"
        if self.only_a or self.only_b:
            return "effects_differ"
        return "no_difference" if self.tested else "nothing_to_compare"

    @property
    def sentence(self) -> str:
        """The verdict in plain words."""
        return " ".join([*self._about_effects(), self._about_parameters(), *self._about_errors()])

    def _about_parameters(self) -> str:
        found = self.differing
        if not self.tested:
            return "No parameter can be compared: none is determined in both files."
        if not found:
            the = "The" if self.only_a or self.only_b else "No difference: the"
            if self.tested == 1:
                return f"{the} one parameter that both files determine agrees."
            return f"{the} {self.tested} parameters that both files determine agree within their uncertainty."
        shown = ", ".join(_in_words(line) for line in found[:3])
        more = f" and {len(found) - 3} more" if len(found) > 3 else ""
        return (
            f"{len(found)} of {self.tested} parameters differ{'s' if len(found) == 1 else ''} beyond"
            f" {'its' if len(found) == 1 else 'their'} uncertainty: {shown}{more}."
        )

    def _about_effects(self) -> list[str]:
        only = [
            f"only {name} has {listed(list(effects))}"
            for name, effects in (("A", self.only_a), ("B", self.only_b))
            if effects
        ]
        return [f"The effects differ: {' and '.join(only)}."] if only else []

    def _about_errors(self) -> list[str]:
        if not self.errors:
            return []
        total = self.errors[0]
        unit = unit_text("torque", self.kind)
        figures = f"{total.a:.4g} {unit} (A) and {total.b:.4g} {unit} (B)"
        if total.better is None:
            return [f"On these logs neither predicts better beyond chance: {figures}."]
        return [f"On these logs {total.better.upper()} predicts better: {figures}."]

    def to_document(self) -> dict[str, Any]:
        """As JSON."""
        prediction = None
        if self.errors:
            total, *each = self.errors
            prediction = {
                "unit": unit_text("torque", self.kind),
                "all": total.to_document(),
                "by_experiment": {line.experiment: line.to_document() for line in each},
            }
        return {
            "schema": SCHEMA,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "level": LEVEL,
            "parameters": [line.to_document() for line in self.parameters],
            "effects": {"only_a": list(self.only_a), "only_b": list(self.only_b)},
            "prediction": prediction,
            "position": None if self.positions is None else dict(zip("ab", self.positions, strict=True)),
            "notes": list(self.notes),
        }


def compare(a: Parameters, b: Parameters, logs: Sequence[Log] = ()) -> Comparison:
    """Compare two parameter files, and their predictions on logs if there are any.

    Args:
        a: the one, or before.
        b: the other, or after.
        logs: of either axis, best ones that neither file was fitted to.

    Raises:
        InputError: axes of different kinds, or logs that one of the files cannot predict.
    """
    if a.axis.units != b.axis.units:
        raise InputError(
            f"A is of {_axis_in_words(a.axis)} and B of {_axis_in_words(b.axis)}, "
            "so no parameter has the same unit",
            remedy="compare files of the same kind of axis",
        )
    mine, others = ({entry.name for entry in one.effects} for one in (a, b))
    errors, about_logs = paired_errors(a, b, logs) if logs else ((), [])
    return Comparison(
        kind=a.axis.units,
        parameters=_corrected(_lines(a, b)),
        only_a=tuple(name for name in registry.names() if name in mine - others),
        only_b=tuple(name for name in registry.names() if name in others - mine),
        errors=errors,
        notes=(*_notes(a, b, mine ^ others), *about_logs),
        positions=_positions(a, b, logs),
    )


def _positions(
    a: Parameters, b: Parameters, logs: Sequence[Log]
) -> tuple[dict[str, float | str], dict[str, float | str]] | None:
    first, second = (position_errors(logs, one) for one in (a, b))
    return None if first is None or second is None else (first, second)


def _axis_in_words(axis: Axis) -> str:
    counted = f" in {unit_text('torque', axis.units)}" if axis.effort != "torque" else ""
    return f"a {axis.kind} axis{counted}"


def _lines(a: Parameters, b: Parameters) -> list[ParameterLine]:
    kind = a.axis.units
    lines = []
    models = dict.fromkeys(one.gravity_model for one in (a, b) if one.gravity_model is not None)
    tables: list[tuple[str, Mapping[str, Parameter], Mapping[str, Parameter], Mapping[str, str]]] = [
        *(("gravity", _gravity(a, model), _gravity(b, model), GRAVITY_MODELS[model]) for model in models),
        ("static", a.static, b.static, STATIC),
        ("dynamic", a.dynamic, b.dynamic, DYNAMIC),
    ]
    for part, left, right, dimensions in tables:
        for name, dimension in dimensions.items():
            if name in left or name in right:
                unit = unit_text(dimension, kind)
                lines.append(_line(part, name, unit, left.get(name), right.get(name)))
    for effect in registry.names():
        lines += _effect_lines(effect, a.effect(effect), b.effect(effect), kind)
    return lines


def _gravity(parameters: Parameters, model: str) -> Mapping[str, Parameter]:
    return parameters.gravity if parameters.gravity_model == model else {}


def _effect_lines(
    effect: str, a: EffectEntry | None, b: EffectEntry | None, kind: Units
) -> list[ParameterLine]:
    left = a.parameters if a else {}
    right = b.parameters if b else {}
    dimensions = {p.name: p.dimension for p in registry.get(effect).parameters}
    moved = _moved_constant(left, right, dimensions) if a and b else None
    lines = []
    for name, dimension in dimensions.items():
        if name not in left and name not in right:
            continue
        phase = dimension == "phase"
        why = f"the {moved} that it refers to is not the same" if moved and name != moved else ""
        if phase and a and b and not why:
            why = _no_phase(effect, name, left, right)
        lines.append(
            _line(effect, name, unit_text(dimension, kind), left.get(name), right.get(name), phase, why)
        )
    return lines


def _moved_constant(
    left: Mapping[str, Parameter], right: Mapping[str, Parameter], dimensions: Mapping[str, str]
) -> str | None:
    """A constant of an effect (not estimated in either file) that is not the same in both."""
    constants = [
        name
        for name in left
        if name in right and all(one.stderr is None and one.known for one in (left[name], right[name]))
    ]
    for name in constants:
        alike = [
            max(abs(left[other].value), abs(right[other].value))
            for other in constants
            if dimensions[other] == dimensions[name]
        ]
        if abs(left[name].value - right[name].value) > _SAME_CONSTANT * max(alike):
            return name
    return None


def _no_phase(effect: str, name: str, left: Mapping[str, Parameter], right: Mapping[str, Parameter]) -> str:
    """Why a phase cannot be compared; "" if it can."""
    if effect == "external_periodic":
        return "a phase in time, and the clocks began at different times"
    amplitude = name.replace("phase", "amplitude")
    for one in (left.get(amplitude), right.get(amplitude)):
        if one is None or (one.stderr is not None and one.value < _CLEAR * one.stderr):
            return "the phase of an amplitude near zero"
    return ""


def _line(
    part: str,
    name: str,
    unit: str,
    a: Parameter | None,
    b: Parameter | None,
    phase: bool = False,
    why: str = "",
) -> ParameterLine:
    """One line, tested where both files determine the parameter."""
    if a is None or b is None:
        return ParameterLine(part, name, unit, a, b, why=f"only in {'A' if a is not None else 'B'}")
    difference = b.value - a.value
    if phase:
        difference = math.remainder(difference, 2.0 * math.pi)
    why = why or _untestable(a, b)
    if why:
        return ParameterLine(part, name, unit, a, b, difference, why=why)
    # what is fitted as a logarithm is nearly normal as one
    logarithmic = name in LOGARITHMIC and part in ("static", "dynamic") and min(a.value, b.value) > 0.0
    sa, sb = (one.stderr or 0.0 for one in (a, b))
    stderr = math.hypot(sa, sb)
    if logarithmic:
        sa, sb = sa / a.value, sb / b.value
        z = math.log(b.value / a.value) / math.hypot(sa, sb)
    else:
        z = difference / stderr
    freedom = _welch(sa, sb, _freedom(a, logarithmic), _freedom(b, logarithmic))
    p_value = float(2.0 * special.stdtr(freedom, -abs(z)))
    return ParameterLine(part, name, unit, a, b, difference, stderr, z, p_value)


def _untestable(a: Parameter, b: Parameter) -> str:
    for name, one in (("A", a), ("B", b)):
        if one.at_bound:
            return f"at its bound in {name}"
    for name, one in (("A", a), ("B", b)):
        if not one.identified:
            return f"not determined in {name}"
    return "" if (a.stderr or 0.0) + (b.stderr or 0.0) > 0.0 else "no standard error in either"


def _freedom(parameter: Parameter, logarithmic: bool) -> float:
    """Degrees of freedom of a standard error, from how much wider its 95 % interval is than a normal one."""
    if not parameter.stderr or parameter.ci95 is None:
        return math.inf
    high = parameter.ci95[1]
    if logarithmic:
        quantile = math.log(high / parameter.value) / (parameter.stderr / parameter.value)
    else:
        quantile = (high - parameter.value) / parameter.stderr
    most, least = 1e4, 1.0
    if not math.isfinite(quantile) or quantile <= float(special.stdtrit(most, 0.975)):
        return math.inf
    if quantile >= float(special.stdtrit(least, 0.975)):
        return least
    return float(special.stdtridf(0.975, quantile))


def _welch(sa: float, sb: float, na: float, nb: float) -> float:
    """Degrees of freedom of a difference (Welch-Satterthwaite)."""
    spread = sa**4 / na + sb**4 / nb
    return (sa**2 + sb**2) ** 2 / spread if spread > 0.0 else math.inf


def _corrected(lines: list[ParameterLine]) -> tuple[ParameterLine, ...]:
    tested = {str(i): line.p_value for i, line in enumerate(lines) if line.p_value is not None}
    corrected = holm(tested)
    return tuple(replace(line, corrected=corrected.get(str(i))) for i, line in enumerate(lines))


def _in_words(line: ParameterLine) -> str:
    assert line.a is not None
    assert line.b is not None
    assert line.difference is not None
    unit = f" {line.unit}" if line.unit else ""
    values = f"{line.a.value:.4g} to {line.b.value:.4g}{unit}"
    if line.a.value == 0.0 or line.unit == "rad":
        return f"{line.title} ({values}, {line.difference:+.3g})"
    share = 100.0 * abs(line.difference / line.a.value)
    way = "higher" if line.difference * line.a.value > 0.0 else "lower"
    return f"{line.title} is {share:.3g} % {way} in B ({values})"


def _notes(a: Parameters, b: Parameters, unshared: set[str]) -> list[str]:
    notes = []
    ka, kb = a.axis.torque_constant, b.axis.torque_constant
    if ka is not None and kb is not None and not math.isclose(ka, kb, rel_tol=1e-9):
        notes.append(
            f"the torque constants differ ({ka:g} and {kb:g}); every torque is in proportion to them."
        )
    if a.gravity_model != b.gravity_model and a.gravity_model and b.gravity_model:
        notes.append(f"A has the gravity model {a.gravity_model} and B {b.gravity_model}.")
    if unshared:
        notes.append(
            f"{' and '.join(sorted(unshared))} in one file only can shift the other parameters of that file."
        )
    return notes
