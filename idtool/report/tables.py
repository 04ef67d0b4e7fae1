"""The tables of a report: parameters, errors, tests, candidates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from idtool.effects import registry
from idtool.model.units import Units, file_key, is_linear, unit_text
from idtool.parameters import CONTROLLER_KEYS, DYNAMIC, GRAVITY_MODELS, STATIC, Parameter
from idtool.presentation import text
from idtool.report.evidence import Evidence
from idtool.report.facts import ResidualTest
from idtool.report.residual_gallery import depends

#: base name -> (symbol, meaning)
_MEANINGS = {
    "base": ("", "carried weight without payload"),
    "per_payload": ("", "payload coefficient"),
    "sin": ("A", "factor of sin q"),
    "cos": ("B", "factor of cos q"),
    "coulomb": ("τc", "Coulomb level: friction while moving"),
    "static": ("τs", "stiction: friction near standstill"),
    "stribeck_velocity": ("ωs", "Stribeck velocity: where one goes over into the other"),
    "viscous": ("σ2", "viscous coefficient: growth with speed"),
    "bristle_stiffness": ("σ0", "bristle stiffness: spring before it slides"),
    "bristle_damping": ("σ1", "bristle damping"),
}
_CONTROLLER = {
    "command_gain": ("Kr", "command gain"),
    "start_torque": ("", "a hand below this starts no motion"),
    "loop_gain": ("Kc", "loop gain"),
    "period": ("", "control period"),
}


@dataclass(frozen=True)
class ParameterRow:
    """One line of the parameter table, all as text.

    Attributes:
        remark: what to think of it, in words; empty when there is nothing to say.
        grave: the remark is a warning.
    """

    key: str
    symbol: str
    meaning: str
    unit: str
    value: str
    stderr: str
    interval: str
    remark: str
    grave: bool


@dataclass(frozen=True)
class ParameterGroup:
    """Parameters that belong together, with the formula they stand in."""

    title: str
    formula: str
    rows: tuple[ParameterRow, ...]


def parameter_groups(evidence: Evidence) -> Iterator[ParameterGroup]:
    """The parameter table, part by part."""
    parameters, kind = evidence.parameters, evidence.kind
    if parameters.gravity_model:
        formula = {
            "slide": "(base + per payload · m) cos α cos β",
            "arm": "A sin q + B cos q",
        }[parameters.gravity_model]
        dimensions = GRAVITY_MODELS[parameters.gravity_model]
        yield ParameterGroup("Gravity", formula, tuple(_rows(parameters.gravity, dimensions, kind)))
    if parameters.static:
        formula = "g(ω) sgn ω + σ2 ω,  g(ω) = τc + (τs − τc) exp(−(ω/ωs)²)"
        yield ParameterGroup("Friction over speed", formula, tuple(_rows(parameters.static, STATIC, kind)))
    if parameters.dynamic:
        formula = "σ0 z + σ1 dz/dt + σ2 ω,  dz/dt = ω − σ0 |ω| z / g(ω)"
        yield ParameterGroup("Bristle dynamics", formula, tuple(_rows(parameters.dynamic, DYNAMIC, kind)))
    for entry in sorted(parameters.effects, key=lambda entry: entry.name != "inertia"):
        effect = registry.get(entry.name)
        dimensions = {p.name: p.dimension for p in effect.parameters}
        meanings = {p.name: ("", text.meaning_on(kind, p.meaning)) for p in effect.parameters}
        rows = tuple(_rows(entry.parameters, dimensions, kind, meanings))
        base = entry.name == "inertia"  # which every moving axis has
        title = effect.title if base else f"Effect: {text.effect_title(entry.name)}"
        yield ParameterGroup(title, effect.formula, rows)
    if parameters.controller:
        controller = parameters.controller
        rows = tuple(
            ParameterRow(
                key=keys[is_linear(kind)],
                symbol=_CONTROLLER[name][0],
                meaning=_CONTROLLER[name][1],
                unit=_controller_unit(name, kind),
                value=f"{getattr(controller, name):g}",
                stderr="–",
                interval="–",
                remark="a setting, not identified",
                grave=False,
            )
            for name, keys in CONTROLLER_KEYS.items()
            if getattr(controller, name) is not None
        )
        paper = controller.mode == "paper"
        law = "q_d = K_r (K_c τ_ext − dq/dt) + q" if paper else "ω = K_c (τ_ext less its uncertainty)"
        yield ParameterGroup("Controller" if paper else "Controller, light mode", law, rows)


def _controller_unit(name: str, kind: Units) -> str:
    if name == "loop_gain":
        return f"{unit_text('velocity', kind)} per {unit_text('torque', kind)}"
    return unit_text("torque" if name == "start_torque" else "time", kind)


def _rows(
    values: Mapping[str, Parameter],
    dimensions: Mapping[str, str],
    kind: Units,
    meanings: Mapping[str, tuple[str, str]] = _MEANINGS,
) -> Iterator[ParameterRow]:
    for name, parameter in values.items():
        dimension = dimensions.get(name, "number")
        symbol, meaning = meanings.get(name, ("", text.words(name)))
        value, stderr, interval = text.uncertain(parameter.value, parameter.stderr, parameter.ci95)
        interval = parameter.limits(lambda end: text.number(end, 2)) or interval
        remark, grave = remark_on(parameter)
        key, unit = file_key(name, dimension, kind), unit_text(dimension, kind)
        yield ParameterRow(key, symbol, meaning, unit, value, stderr, interval, remark, grave)


def remark_on(parameter: Parameter) -> tuple[str, bool]:
    """What to think of a parameter, in words, and whether that is a warning."""
    if parameter.at_bound:
        return "at its bound, and the data do not determine it", True
    if not parameter.identified:
        return "the data do not determine it", True
    if parameter.stderr is None:
        return "declared, not identified", False
    if parameter.ci95 and parameter.ci95[0] <= 0.0 <= parameter.ci95[1]:
        return "could be zero", False
    return "", False


def dependence_rows(evidence: Evidence) -> list[dict[str, object]]:
    """What the residual tests found for each variable, before and after, in the order of the file."""
    tests = evidence.facts.residual_tests
    if tests is None:
        return []
    before = {test.variable: test for test in tests.before}
    after = {test.variable: test for test in tests.after}
    untested = ResidualTest("")
    rows = []
    for variable in dict.fromkeys([*before, *after]):
        first, second = before.get(variable, untested), after.get(variable, untested)
        rows.append(
            {
                "variable": text.quantity(variable),
                "before": text.p_text(first.p_value),
                "share_before": text.percent(first.share),
                "after": text.p_text(second.p_value),
                "share_after": text.percent(second.share),
                "left": depends(second),
            }
        )
    return rows
