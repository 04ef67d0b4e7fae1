"""The outcome of `identify`, with what a person at a notebook asks of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from idtool.api.logs import Logs, read_logs
from idtool.api.progress import by_count, told
from idtool.diagnosis.summary import found, summary_lines
from idtool.errors import InputError, nearest
from idtool.parameters import EffectEntry
from idtool.simulation.stage import Source
from idtool.verbs.identification import Identification
from idtool.verbs.predict import Prediction, predict
from idtool.verbs.simulate import Simulation, simulate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from idtool.report.gallery import Plate


@dataclass(frozen=True, repr=False)
class Result(Identification):
    """The outcome of `identify`.

    Attributes:
        parameters: the parameter file (`Parameters`); `parameters.to_frame()` is a table of it.
        diagnosis: the document of diagnosis.json.
        effects: what was found beyond the base model, name -> its entry with the parameters.
        figures: names of the figures that `plot` draws.
        notes: sentences that qualify the result.
    """

    @classmethod
    def of(cls, outcome: Identification) -> Result:
        """The same outcome with everything that a notebook needs."""
        return cls(**{one.name: getattr(outcome, one.name) for one in fields(outcome)})

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        lines = "".join(f"<li>{escape(line)}</li>" for line in summary_lines(self.diagnosis))
        return f"<ul>{lines}</ul>{self.parameters.to_frame().to_html(na_rep='', float_format=_number)}"

    def summary(self) -> str:
        """The parameters with their intervals, the verdict, what was found and what is left, as text."""
        table = self.parameters.to_frame().to_string(na_rep="", float_format=_number)
        return "\n".join([table, "", *summary_lines(self.diagnosis)])

    @property
    def effects(self) -> Mapping[str, EffectEntry]:
        """What was found beyond the base model: name -> entry of the parameter file."""
        names = [effect["name"] for effect in found(self.diagnosis)]
        return {entry.name: entry for entry in self.parameters.effects if entry.name in names}

    @cached_property
    def _plates(self) -> dict[str, Plate]:
        from idtool.report.evidence import evidence_of
        from idtool.report.page import all_plates

        return {plate.name: plate for plate in all_plates(evidence_of(self))}

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the figures that these data give, as `plot` takes them."""
        return tuple(self._plates)

    def plot(self, name: str = "prediction", ax: Axes | None = None) -> Figure:
        """Draw a figure of the report.

        Args:
            name: one of `figures`: "prediction", "stribeck", "residual_position", ...
            ax: axes of matplotlib's `subplots` whose place the picture takes; a new figure if None.

        Returns:
            The figure.

        Raises:
            InputError: these data give no such figure, or `ax` has no cell of a grid or too little room.
        """
        from idtool.presentation.style import placed

        if name not in self._plates:
            raise InputError(
                f"there is no figure {name!r}", argument="name", remedy=nearest(name, self._plates)
            )
        return placed(self._plates[name].draw, ax)

    def predict(self, logs: Logs) -> Prediction:
        """Predict the torque of logs with the result; `frame` holds the rows, `errors` the error.

        Args:
            logs: a log, a path, or several, of the same axis.

        Raises:
            InputError: logs of another axis, or without a column that an effect needs.
        """
        return predict(read_logs(logs), self.parameters)

    def simulate(self, logs: Logs, source: Source = "effort") -> Simulation:
        """The position of logs as the identified axis makes it; `frame` holds the rows, `rms` the error.

        Args:
            logs: a log, a path, or several, of the same axis.
            source: "effort", or "goal" for the logged goal through the position loop, which is identified
                from these logs where the file has none.

        Raises:
            InputError: an unknown source, logs of another axis, no inertia, or no goal in a log.
        """
        return simulate(read_logs(logs), self.parameters, source)

    def report(
        self,
        folder: str | PathLike[str],
        *,
        force: bool = False,
        progress: Callable[[str], None] | bool | None = None,
    ) -> Path:
        """Write the result folder, as `ffc-id identify -o` does; the page in it.

        Args:
            folder: made if missing.
            force: overwrite a result that is there.
            progress: called with a sentence as each figure is drawn; True shows them on one line, None does
                so in a notebook only.

        Raises:
            InputError: it holds a result already and `force` is not given, or it cannot be written.
        """
        from idtool.report.page import write_report
        from idtool.report.result_folder import result_folder, write_results

        place = Path(folder)
        with result_folder(place, force), told(progress) as tell:
            write_results(self, place, command="idtool.identify(...)", seed=int(self.options.get("seed", 0)))
            return write_report(place, progress=by_count(tell, "drawing the figures"))


def _number(value: float) -> str:
    return f"{value:.5g}"
