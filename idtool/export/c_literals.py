"""Numbers and effects as C99 text in single precision."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass, field

import numpy as np

from idtool.effects.base import CForm, Effect
from idtool.errors import InputError


def c_float(value: float, name: str) -> str:
    """The float literal nearest to `value`, with as few digits as tell it from its neighbours.

    Raises:
        InputError: beyond what single precision holds; `name` says which number it was.
    """
    if np.isnan(value):
        raise InputError("is not a number", place=name, remedy="correct the parameter file")
    if np.isinf(value):
        return "INFINITY" if value > 0 else "(-INFINITY)"
    with np.errstate(over="ignore", under="ignore"):
        single = np.float32(value)
    if np.isinf(single):
        raise InputError(
            f"{value:g} does not fit single precision", place=name, remedy="correct the parameter file"
        )
    text = np.format_float_positional(single, unique=True, trim="0")
    if len(text) > 12:
        text = np.format_float_scientific(single, unique=True, trim="0")
    return f"({text}f)" if single < 0 else f"{text}f"


@dataclass(frozen=True)
class EffectInC:
    """One effect, ready for the template.

    Attributes:
        name, title, formula: as of `Effect`.
        memory: how many numbers it remembers.
        code: statements, indented.
        constants: C literals by the name that the code uses.
        adds: fields of the contribution that the code adds to.
        form: where it came from.
    """

    name: str
    title: str
    formula: str
    memory: int
    code: str
    constants: dict[str, str]
    adds: frozenset[str]
    form: CForm = field(repr=False)

    @classmethod
    def build(cls, effect: Effect, form: CForm) -> EffectInC:
        """Literals for the constants that the code names.

        Raises:
            InputError: one of them does not fit single precision.
        """
        words = set(re.findall(r"\b[a-z_]\w*\b", re.sub(r"\b(row|sum)->\w+", "", form.code)))
        constants = {
            name: c_float(value, f"effect {effect.name}, {name}").strip("()")
            for name, value in form.constants.items()
            if name in words
        }
        return cls(
            effect.name,
            effect.title,
            effect.formula,
            effect.memory + form.keeps,
            textwrap.indent(textwrap.dedent(form.code).strip(), "    "),
            constants,
            frozenset(re.findall(r"sum->(\w+)", form.code)),
            form,
        )

    @property
    def reads_row(self) -> bool:
        """Whether the code looks at the motion at all."""
        return "row->" in self.code

    @property
    def follows_time(self) -> bool:
        """Whether the code looks at the clock."""
        return "row->time" in self.code
