"""Progress on standard error, where that is a terminal and nobody asked for quiet; silence elsewhere."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Self

from .common import Output

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.progress import ProgressColumn, Task

    from idtool.presentation.pace import Pace
    from idtool.verbs.expected import Expected

#: Below so many columns there is room for words only, not for a bar.
_ROOM_FOR_BAR = 70


class Progress:
    """What is being done, for how long already, and where that is known how long it will take.

        with Progress(output, "identifying") as progress:
            identify(logs, tell=progress.say)

    Attributes:
        visible: whether anything is shown.
        narrow: whether words must be few.
    """

    def __init__(self, output: Output, what: str = "", *, timed: bool = True) -> None:
        """`timed`: show the time that has passed, and with `at` the time that is left."""
        self._pace: Pace | None = None
        self.visible = sys.stderr.isatty() and os.environ.get("TERM") != "dumb" and not output.quiet
        self.narrow = False
        if not self.visible:
            return
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            ProgressColumn,
            SpinnerColumn,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
        )
        from rich.progress import Progress as Bar
        from rich.table import Column

        class Known(ProgressColumn):
            """A bar where it is known how much there is to do; its room is left to the words elsewhere."""

            bar = BarColumn(bar_width=24)

            def render(self, task: Task) -> RenderableType:
                return "" if task.total is None else self.bar.render(task)

        screen = Console(stderr=True, highlight=False)
        self.narrow = screen.width < _ROOM_FOR_BAR
        words = Column(overflow="ellipsis", no_wrap=True)
        columns: list[ProgressColumn] = [TextColumn("{task.description}", markup=False, table_column=words)]
        if timed:
            columns = [SpinnerColumn(), *columns, TimeElapsedColumn()]
        if not self.narrow:
            columns.insert(-1 if timed else 0, Known())
        # nothing is shown where nobody knows how much there is to do
        columns.insert(-1, TaskProgressColumn("{task.percentage:.0f} %", text_format_no_percentage=""))
        if timed:
            columns.append(_left_column(self._what_is_left()))
        self._bar = Bar(*columns, console=screen, transient=True)
        self._task = self._bar.add_task(what, total=None)

    def _what_is_left(self) -> Pace | Expected:
        """What says how long it will take yet."""
        from idtool.presentation.pace import Pace

        self._pace = Pace()
        return self._pace

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        """Show it (again)."""
        if self.visible:
            self._bar.start()

    def stop(self) -> None:
        """Take it away, as while a person is asked something."""
        if self.visible:
            self._bar.stop()

    def say(self, what: str) -> None:
        """What is being done now."""
        if self.visible:
            self._bar.update(self._task, description=what, refresh=True)  # it may be over within a tick

    def at(self, done: float, of: float) -> None:
        """How far it is."""
        if self.visible:
            if self._pace is not None:
                self._pace.at(done / of)
            self._bar.update(self._task, completed=done, total=of)


class Identifying(Progress):
    """An identification, of which is known how long it takes at least.

    with Identifying(output) as progress:
        identify(logs, tell=progress.say)
    """

    def say(self, what: str) -> None:
        """What is being done now."""
        super().say(what)
        if self.visible:
            self._expected.hear(what)
            if (share := self._expected.share) is not None:
                self.at(share, 1.0)

    def _what_is_left(self) -> Pace | Expected:
        from idtool.verbs.expected import Expected

        self._expected = Expected()
        return self._expected


def _left_column(left: Pace | Expected) -> ProgressColumn:
    """Shows the words of `left`; rich's own column forgets what took over half a minute."""
    from rich.progress import ProgressColumn
    from rich.text import Text

    class Left(ProgressColumn):
        max_refresh = 0.5

        def render(self, _: Task) -> Text:
            return Text(left.words, style="progress.remaining")

    return Left()
