"""Tables that several commands print."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

    from idtool.parameters import Parameter, Parameters


def rows_of(parameters: Parameters, parts: tuple[str, ...]) -> list[tuple[str, str, Parameter]]:
    """(name, unit, parameter) of the named parts: "gravity", "static", "dynamic", "effects"."""
    from idtool.effects import registry
    from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC
    from idtool.units import unit_text

    kind = parameters.axis.kind
    rows = []
    tables: dict[str, tuple[dict[str, Parameter], dict[str, str]]] = {
        "gravity": (parameters.gravity, GRAVITY_MODELS.get(parameters.gravity_model or "", {})),
        "static": (parameters.static, STATIC),
        "dynamic": (parameters.dynamic, DYNAMIC),
    }
    for part in parts:
        if part in tables:
            values, dimensions = tables[part]
            rows += [
                (name.replace("_", " "), unit_text(dimensions[name], kind), p) for name, p in values.items()
            ]
    if "effects" in parts:
        for entry in parameters.effects:
            dimensions = {p.name: p.dimension for p in registry.get(entry.name).parameters}
            rows += [
                (f"{entry.name}: {name.replace('_', ' ')}", unit_text(dimensions[name], kind), p)
                for name, p in entry.parameters.items()
            ]
    return rows


def print_parameters(console: Console, parameters: Parameters, parts: tuple[str, ...]) -> None:
    """Value, unit, standard error, 95 % interval, and what to think of it."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("parameter", overflow="fold")
    for heading in ("value", "std error", "95 % interval"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("")
    for name, unit, parameter in rows_of(parameters, parts):
        interval = f"{parameter.ci95[0]:.5g} to {parameter.ci95[1]:.5g}" if parameter.ci95 else ""
        error = f"{parameter.stderr:.2g}" if parameter.stderr is not None else ""
        table.add_row(name, f"{parameter.value:.5g}", error, interval, unit, flag(parameter))
    console.print(table)


def flag(parameter: Parameter) -> str:
    """What a reader must know before using the number; empty if nothing."""
    if parameter.at_bound:
        return "at its bound: not found"
    if not parameter.identified:
        return "not determined by these data"
    return ""


def document_of(parameters: Parameters, part: str) -> Any:
    """A part of the parameter file as JSON."""
    document = parameters.to_document()
    if part in ("static", "dynamic"):
        return document["friction"][part]
    return document[part]
