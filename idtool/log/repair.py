"""What is wrong with the readings of a log, repaired where that is safe, left out or refused where not."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of, impossible, sensor_faults
from idtool.log.clock import doubts, gap_cuts, refuse_odd_clock
from idtool.log.columns import Columns
from idtool.log.contradicting import contradictions_of
from idtool.log.effort import Effort
from idtool.log.row_counter import lost_rows
from idtool.log.slips import continuous
from idtool.log.stale import frozen, stale
from idtool.model.motion import Array
from idtool.presentation.text import counted

Rows = NDArray[np.bool_]

#: Reasons for which rows are not compared, as they are told.
SATURATED = "current saturated"
STUCK = {"position": "position stuck", "velocity": "velocity stuck"}
#: A trial with more of its rows stuck than this is left out whole; a log with more of them is refused.
_MOSTLY = 0.5
#: Reasons for which single readings are left out.
IMPOSSIBLE = {
    "position": "impossible position",
    "velocity": "impossible speed",
    "effort": "impossible torque",
}
_SLIPPED = "position slipped"
_MISDATED = "impossible time"
_FROZEN = "torque not read anew"
#: So many impossible readings of a column are told one by one; the rest are counted.
_TOLD = 3
#: Rows of a trial in which noise can be told from motion: one third difference.
_SHORTEST = 4


@dataclass(frozen=True)
class Reading:
    """A reading that cannot be.

    Attributes:
        row: of the log's frame, from 0.
        column: in which it is.
        value: what was read.
        expected: what the rows around it say.
    """

    row: int
    column: str
    value: float
    expected: float


@dataclass(frozen=True)
class Repaired:
    """The columns of one log, and what was done to them.

    Attributes:
        columns: position and velocity are NaN at rows where their sensor is stuck or what it read cannot be;
            a torque that cannot be is replaced by what the rows around it say.
        faulty: reason -> rows not to be compared, shape (rows,).
        dropped: reason -> rows of whole trials that were left out.
        remarks: sentences for the reader.
        impossible: the readings that cannot be, in the order of the rows.
        wiring: sentences on columns that contradict each other, to be read before any number.
    """

    columns: Columns
    faulty: dict[str, Rows] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    impossible: tuple[Reading, ...] = ()
    wiring: tuple[str, ...] = ()


def repair(log: Log, columns: Columns, effort: Effort, *, every_row: bool = False) -> Repaired:
    """Look for faults of the sensors of one log.

    Args:
        log: where the columns are from.
        columns: as they were read.
        effort: where their effort is from.
        every_row: leave no trials out.

    Raises:
        InputError: a reading of a frame is no number (a file is asked when it is read), a sensor is stuck on
            most of the rows, the axis never moves, or the clock is none of a servo.
    """
    _refuse_no_numbers(log, columns)
    refuse_odd_clock(log, columns.time, columns.first)
    work = _Repair(log, columns, effort)
    work.refuse_dead_encoder()
    work.set_clock()
    work.cut_at_gaps()
    short, twice = work.too_short(), work.there_twice()
    for sentence in doubts(work.columns.time, work.first):
        work.remark(sentence)
    work.put_in_lost_periods()
    work.unwrap()
    work.leave_out_stale()
    work.leave_out_impossible()
    work.faulty |= effort.unfit
    contradictions = contradictions_of(log, work.columns, work.first, effort)
    work.faulty[SATURATED] = sensor_faults.clipped(work.columns.effort)
    work.leave_out_frozen()
    return work.finished(short, twice, contradictions, every_row=every_row)


def _refuse_no_numbers(log: Log, columns: Columns) -> None:
    """What was read from a file holds numbers alone; a frame of one's own may not.

    Raises:
        InputError: time, position, velocity or effort of a row is none.
    """
    for role in ("time", "position", "velocity", "effort"):
        values = getattr(columns, role)
        if values is not None and len(bad := np.flatnonzero(~np.isfinite(values))):
            raise InputError(
                f"{len(bad)} of its rows hold no number as {role}, this one first",
                file=log.source,
                place=log.place(int(bad[0])),
                remedy="correct or delete those rows",
            )


def _such(rows: Rows) -> str:
    """How many stretches of rows there are, and rows in them."""
    begins = np.count_nonzero(rows & ~np.insert(rows[:-1], 0, False))
    return f"({begins} such, {counted(int(rows.sum()), 'row')} in all)"


class _Repair:
    """A log while it is repaired.

    Attributes:
        columns, faulty, remarks, readings: as `Repaired` will hold them.
        first: True at the first row of each trial, (rows,).
        stale: role -> rows at which it was not read anew though the axis went on, (rows,).
    """

    def __init__(self, log: Log, columns: Columns, effort: Effort) -> None:
        self.log, self.effort = log, effort
        self.columns = replace(columns)
        self.first = columns.first
        self.names = columns_of(log.axis.kind) | {"effort": effort.column}
        self.faulty: dict[str, Rows] = {}
        self.remarks: list[str] = []
        self.readings: list[Reading] = []
        self.stale: dict[str, Rows] = {}

    def remark(self, sentence: str, row: int | None = None) -> None:
        """Say something of the log, or of one of its rows."""
        place = "" if row is None else f", {self.log.place(row)}"
        self.remarks.append(f"{self.log.source}{place}: {sentence}")

    def refuse_dead_encoder(self) -> None:
        there = {role: values for role in STUCK if (values := getattr(self.columns, role)) is not None}
        still = [
            role
            for role, values in there.items()
            if np.ptp(values) == 0.0 and (role == "position" or values[0] == 0)
        ]
        if len(still) == len(there):
            listed = " and ".join(f'"{self.names[role]}"' for role in still)
            never = f"columns {listed} never change" if len(still) > 1 else f"column {listed} never changes"
            raise InputError(
                f"{never}: the axis was held, or its encoder is dead",
                file=self.log.source,
                remedy="check the encoder and its cable and record again, or leave this log out",
            )

    def set_clock(self) -> None:
        """Put the clock of the rows around it in the place of a time that is none of a reading."""
        time = self.columns.time
        if self.columns.position is None:
            return
        rows, even = impossible.stamps(time, self.first, self.columns.position)
        if not rows.any():
            return
        self.columns.time = even
        self.faulty[_MISDATED] = rows
        self._leave_out("time", rows, time, even)
        worst = int(np.argmax(np.abs(time - even)))
        self.remark(
            f"{self.names['time']} is {1e3 * (time - even)[worst]:+.3g} ms off the clock of the rows around "
            f"it, and the axis was where that clock says ({int(rows.sum())} such); left out.",
            worst,
        )

    def put_in_lost_periods(self) -> None:
        """Make room in the time of a row counter for the rows that it lost."""
        columns = self.columns
        if columns.position is None:
            return
        lost = lost_rows(columns.time, self.first, columns.position)
        if not lost.any():
            return
        period = float(np.median(np.diff(columns.time)[~self.first[1:]]))
        columns.time = columns.time + period * np.cumsum(lost)
        places = np.flatnonzero(lost)
        first, *others = (self.log.place(int(row)) for row in places[:_TOLD])
        rows = ", ".join([first, *(place.split()[-1] for place in others)])
        more = ", ..." if len(places) > _TOLD else ""
        name, told = self.names["position"], self.names["time"]
        self.remark(
            f"{name} goes on by two steps or more at once before {counted(len(places), 'row')} "
            f"({rows}{more}) while {told} steps evenly: {counted(int(lost.sum()), 'row was', 'rows were')} "
            f"lost and {told} counts those that are left. The lost periods were put in; where the axis moves "
            "too slowly to tell, they are still missing, so log the time of each measurement."
        )

    def cut_at_gaps(self) -> None:
        """Begin a trial where a gap in time may hide a reversal."""
        columns = self.columns
        cuts = gap_cuts(columns.time, self.first, columns.position, columns.velocity)
        if cuts.any():
            self.remark(
                f"{counted(int(cuts.sum()), 'gap')} in time, the first before "
                f"{self.log.place(int(np.argmax(cuts)))}, may hide a reversal, or the axis can go all its "
                "way meanwhile; a new trial begins after each."
            )
            self.first = self.first | cuts
        columns.trial = np.cumsum(self.first) - 1

    def too_short(self) -> Rows:
        """Rows of the trials that are too short to tell a motion from noise."""
        rows = np.bincount(self.columns.trial)
        if np.max(rows) < _SHORTEST:
            raise InputError(
                f"none of its {len(rows)} trials has {_SHORTEST} rows, as a motion needs to be told from "
                "noise",
                file=self.log.source,
                remedy='a trial is one run of the axis: look at column "trial", and whether the clock rises',
            )
        return np.asarray((rows < _SHORTEST)[self.columns.trial])

    def there_twice(self) -> Rows:
        """Rows of the trials whose readings are those of an earlier one, to the last digit."""
        starts = np.flatnonzero(self.first)
        readings = [self.columns.position, self.columns.velocity, self.columns.effort]
        table = np.column_stack([column for column in readings if column is not None])
        seen: set[bytes] = set()
        again = []
        for begin, end in zip(starts, np.append(starts[1:], len(table)), strict=True):
            rows = table[begin:end].tobytes()
            again.append(rows in seen)
            seen.add(rows)
        return np.asarray(np.array(again)[self.columns.trial])

    def unwrap(self) -> None:
        """Make an angle continuous."""
        if self.columns.position is None or self.log.axis.kind != "rotary":
            return
        self.columns.position, wraps = sensor_faults.unwrap(self.columns.position, self.first)
        if wraps:
            self.remark(f"the position wraps {wraps} times by whole turns; it was made continuous.")

    def leave_out_stale(self) -> None:
        """Put what the rows around say in the place of readings that stayed while the axis went on."""
        columns = self.columns
        if columns.position is None or not (rows := stale(self.first, columns.position)).any():
            return
        self.remark(
            f"{self.names['position']} repeats its last reading while the axis moves on {_such(rows)}, and "
            "then catches up at once; they were left out: look whether the bus answers in each period.",
            int(np.argmax(rows)),
        )
        for role in (*STUCK, "effort"):
            values = getattr(columns, role)
            if values is not None:
                same = rows & (np.diff(values, prepend=np.nan) == 0.0)
                self.stale[role] = same
                filled = np.interp(columns.time, columns.time[~same], values[~same])
                setattr(columns, role, np.where(same, filled, values))

    def leave_out_frozen(self) -> None:
        """Put what the rows around say in the place of an effort that stayed while the axis moved."""
        columns = self.columns
        if columns.position is None:
            return
        # where all stayed, what was put in its place is no reading
        read = np.where(self.stale.get("effort", False), np.nan, columns.effort)
        rows = frozen(self.first, columns.position, read)
        if not rows.any():
            return
        if (share := float(np.mean(rows))) > _MOSTLY:
            self.remark(
                f"{self.names['effort']} repeats its last reading on {100.0 * share:.0f} % of the rows while "
                "the axis moves: it is read anew more slowly than it is logged, or commanded in steps."
            )
            return
        self.faulty[_FROZEN] = rows
        self.remark(
            f"{self.names['effort']} repeats its last reading for longer than chance while the axis moves "
            f"{_such(rows)}: it was not read anew there; they were left out.",
            int(np.argmax(rows)),
        )
        columns.effort = np.interp(columns.time, columns.time[~rows], columns.effort[~rows])

    def leave_out_impossible(self) -> None:
        """Put what the rows around say in the place of a reading that cannot be."""
        columns = self.columns
        found = impossible.find(columns.time, self.first, columns.position, columns.velocity, columns.effort)
        for role, reason in IMPOSSIBLE.items():
            rows = getattr(found, role)
            if not rows.any():
                continue
            self.faulty[reason] = rows
            expected = found.expected[role]
            raw = self.log.values_of(self.names[role])
            scale = self.effort.scale if role == "effort" else 1.0
            self._tell(self._leave_out(role, rows, raw, expected / scale))
            setattr(columns, role, np.where(rows, expected, getattr(columns, role)))
        if found.slips:
            self.faulty[_SLIPPED] = self._undo_slips(found.slips, found.wraps)

    def _leave_out(self, role: str, rows: Rows, values: Array, expected: Array) -> list[Reading]:
        several = [
            Reading(int(k), self.names[role], float(values[k]), float(expected[k]))
            for k in np.flatnonzero(rows)
        ]
        self.readings += several
        return several

    def _tell(self, several: list[Reading]) -> None:
        for one in several[:_TOLD]:
            self.remark(
                f"{one.column} {one.value:.6g} cannot be (the rows around it say {one.expected:.4g}); "
                "it was left out.",
                one.row,
            )
        if len(several) > _TOLD:
            more = len(several) - _TOLD
            self.remark(
                f"{more} more of {several[0].column} cannot be, from {self.log.place(several[_TOLD].row)} to "
                f"{self.log.place(several[-1].row)}; they were left out."
            )

    def _undo_slips(self, slips: dict[int, float], wraps: bool) -> Rows:
        """Make the position continuous where it jumps for good; rows whose place is not known then."""
        assert self.columns.position is not None
        self.columns.position, unknown = continuous(
            self.columns.time, self.first, self.columns.position, slips, wraps
        )
        sizes, name, row = np.abs(list(slips.values())), self.names["position"], next(iter(slips))
        if wraps:
            self.remark(
                f"{name} wraps {len(slips)} times by {float(np.median(sizes)):.3g}; it was made continuous."
            )
            return unknown
        left = f"; {counted(int(unknown.sum()), 'row')} on the shorter side left out" if unknown.any() else ""
        self.remark(
            f"{name} jumps by {slips[row]:.4g}, which no motion of this log comes near, and stays there "
            f"({len(slips)} such): counts were lost, or the coupling slips; it was made continuous{left}.",
            row,
        )
        return unknown

    def finished(
        self, short: Rows, twice: Rows, contradictions: tuple[str, ...], *, every_row: bool
    ) -> Repaired:
        """Without what a sensor that was stuck read, and without trials that say nothing, or that again."""
        columns, faulty = self.columns, self.faulty
        dropped: dict[str, int] = {}
        whole = np.zeros(len(columns), dtype=bool)
        idle = {f"trial of fewer than {_SHORTEST} rows": short, "trial that is there already": twice & ~short}
        for reason, mask in idle.items():
            if mask.any() and not every_row:
                whole, dropped[reason] = whole | mask, int(mask.sum())
        for role, mask in self._stuck().items():
            if not every_row:
                mostly = np.bincount(columns.trial, mask) / np.bincount(columns.trial) > _MOSTLY
                if mostly.any():
                    dropped[STUCK[role]] = int(mostly[columns.trial].sum())
                whole |= mostly[columns.trial]
            faulty[STUCK[role]] = mask
        for role in STUCK:
            unread = [faulty[why] for why in (IMPOSSIBLE[role], STUCK[role]) if why in faulty]
            if unread:  # a trial starts from a number
                rows = np.logical_or.reduce(unread) & ~self.first
                setattr(columns, role, np.where(rows, np.nan, getattr(columns, role)))
        if whole.all():
            raise InputError(
                "every trial is too short, or its position or velocity is stuck",
                file=self.log.source,
                remedy="record again",
            )
        if whole.any():
            columns = columns.picked(~whole)
            faulty = {reason: mask[~whole] for reason, mask in faulty.items()}
            for reason, rows in dropped.items():
                self.remark(f"{rows} rows of whole trials were left out ({reason}).")
        self.readings.sort(key=lambda one: one.row)
        return Repaired(columns, faulty, dropped, tuple(self.remarks), tuple(self.readings), contradictions)

    def _stuck(self) -> dict[str, Rows]:
        """Role -> rows on which its sensor is stuck, of those that are anywhere."""
        columns, found = self.columns, {role: self.stale[role] for role in STUCK if role in self.stale}
        if columns.position is None or columns.velocity is None:
            return found
        masks = sensor_faults.stuck(columns.time, columns.position, columns.velocity, self.first)
        found |= {
            role: mask | found.get(role, False) for role, mask in zip(STUCK, masks, strict=True) if mask.any()
        }
        for role, mask in found.items():
            if np.mean(mask) > _MOSTLY:
                name, other = self.names[role], self.names["velocity" if role == "position" else "position"]
                raise InputError(
                    f'column "{name}" stands still on {int(mask.sum())} of {len(mask)} rows while "{other}" '
                    "moves on: the sensor is stuck",
                    file=self.log.source,
                    place=f"from row {int(np.argmax(mask)) + 1} of the data",
                    remedy=f'remove column "{name}" or record again',
                )
        return found
