"""What every target of an export is: the model that its file computes, what that lacks, and the text."""

from __future__ import annotations

import textwrap
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from idtool.log import Log
from idtool.parameters import Parameters

#: What no target but JSON carries.
UNCERTAINTY = "standard errors and intervals of the parameters"


@dataclass(frozen=True)
class Plan:
    """What a target's file will hold.

    Attributes:
        model: the model that a program computes from the file; gravity in it is that of the parameter
            file even where the program takes it from the masses of its own bodies.
        lost: what the file cannot carry, one sentence each.
        notes: what a reader of the file must know.
        copied: where `model` was fitted anew to the logs, the model with the values as they stood.
    """

    model: Parameters
    lost: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    copied: Parameters | None = None


@dataclass(frozen=True)
class Exported:
    """An export, not written.

    Attributes:
        target: its name in `idtool.export.targets.TARGETS`.
        text: content of the file.
        plan: what it holds and what not.
        errors: model -> experiment -> {"rmse", "relative_percent", "rows"}; empty without logs. Models are
            "full", "exported" where the file cannot hold all of that, and "copied" where the exported
            values were fitted anew.
    """

    target: str
    text: str
    plan: Plan
    errors: dict[str, dict[str, dict[str, Any]]] = field(default_factory=dict)


class Target(ABC):
    """A kind of file. Sub-classes are final and hold no state.

    Attributes:
        name: as the command line calls it.
        title: as a person does.
    """

    name: ClassVar[str]
    title: ClassVar[str]

    @abstractmethod
    def plan(self, parameters: Parameters, logs: Sequence[Log], friction: str) -> Plan:
        """The model of the file.

        Args:
            parameters: the whole model.
            logs: what a simplified model is fitted to; may be empty.
            friction: "auto" for the richest law that the file can hold, "coulomb" for Coulomb and viscous.

        Raises:
            InputError: the parameter file lacks what the target needs.
        """

    @abstractmethod
    def render(self, plan: Plan, remarks: Sequence[str], joint: str) -> str:
        """The text of the file; `remarks` go into it as comments."""


def comment_lines(remarks: Sequence[str]) -> list[str]:
    """Remarks as comments of Python or YAML, wrapped."""
    return [f"# {line}".rstrip() for remark in remarks for line in textwrap.wrap(remark, 100) or [""]]


def number(value: float) -> str:
    """A number with all the digits that matter, read as a float by every program (1.0e-05, never 1e-05).

    >>> number(1.0), number(1e-5)
    ('1.0', '1.0e-05')
    """
    text = f"{value:.9g}"
    mantissa, e, exponent = text.partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + (f"e{exponent}" if e else "")
