"""One thing that data lack: why that matters, and the run that would show it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

#: What is known of a parameter that is not determined: the least and the most that it can be.
Limits = tuple[float | None, float | None]
PARTS = ("gravity", "static", "dynamic", "effects")


@dataclass(frozen=True)
class Shortcoming:
    """One thing that the data lack.

    Attributes:
        code: a word that stays the same ("no_low_speeds", "one_payload", ...).
        parts: parts of the parameter file that it concerns.
        parameters: "part.name" of what is not determined because of it; () where it costs accuracy only.
        why: in words, without a full stop.
        remedy: what to do, without a full stop.
        run: the command that would show what is missing; "" where no single command does.
        by_error: rests on the errors of the fit (or on where it ended), which a model that lacks something
            spoils; the data may show more.
        limits: what is known of some of `parameters` all the same.
    """

    code: str
    parts: tuple[str, ...]
    parameters: tuple[str, ...]
    why: str
    remedy: str
    run: str = ""
    by_error: bool = False
    limits: Mapping[str, Limits] = field(default_factory=dict)

    @property
    def sentence(self) -> str:
        """Why and what to do."""
        return f"{self.why}; {self.remedy}."

    def to_document(self) -> dict[str, object]:
        """A JSON document."""
        return {
            "code": self.code,
            "parameters": list(self.parameters),
            "why": self.why,
            "remedy": self.remedy,
            "run": self.run,
        }
