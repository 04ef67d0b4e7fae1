"""What a benchmark hands back: a table, goals and what must be said about them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from pages.markdown import table


@dataclass(frozen=True)
class Goal:
    """A figure that was aimed at. `met` is None where it could not be measured."""

    what: str
    found: str
    met: bool | None


@dataclass
class Section:
    """One part of the report.

    Attributes:
        title: its heading.
        head, rows: of its table.
        notes: sentences under the table.
        goals: what was aimed at.
    """

    title: str
    head: Sequence[str]
    rows: list[list[str]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    goals: list[Goal] = field(default_factory=list)
    more: list[Section] = field(default_factory=list)

    def add(self, *cells: object) -> None:
        """Append a row."""
        self.rows.append([cell if isinstance(cell, str) else number(cell) for cell in cells])

    def below(self, what: str, took: float, most: float) -> None:
        """Aim at a time, s."""
        self.goals.append(Goal(f"{what}: below {seconds(most)}", seconds(took), took < most))

    def markdown(self, depth: int = 2) -> str:
        """The section as Markdown."""
        lines = [f"{'#' * depth} {self.title}", ""]
        if self.rows:
            lines += [*table(self.head, self.rows, "l" + "r" * (len(self.head) - 1)), ""]
        for note in self.notes:
            lines += [note, ""]
        for part in self.more:
            lines += [part.markdown(depth + 1)]
        return "\n".join(lines)


def goals_table(sections: Sequence[Section]) -> Section:
    """All goals of some sections in one table."""
    result = Section("Goals", ["goal", "found", "met"])
    words = {True: "yes", False: "**no**", None: "not measured"}
    for section in sections:
        for goal in [*section.goals, *(g for part in section.more for g in part.goals)]:
            result.add(goal.what, goal.found, words[goal.met])
    return result


def number(value: object) -> str:
    """A number as a reader wants it: three digits, no exponent where it can be helped."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}"
    size = abs(value)
    if size != 0.0 and (size < 1e-4 or size >= 1e7):
        return f"{value:.2e}"
    return f"{value:,.0f}" if size >= 100 else f"{value:.3g}"


def seconds(value: float) -> str:
    """A duration with its unit."""
    if value < 1e-3:
        return f"{1e6 * value:.3g} µs"
    return f"{1e3 * value:.3g} ms" if value < 1.0 else f"{value:.3g} s"
