"""The rows that a fit works on.

A `Recording` holds several logs as one set of arrays: the smoothed motion at full rate (the bristle
needs every row), the measured torque, which rows are fit to be compared, and one linear operator that
filters and decimates. That operator acts once on the torque and once on every regressor, so it biases
nothing; see docs and `Recording.filtered`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log.repair import Reading
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion
from idtool.parameters.axis import Axis
from idtool.signals import lowpass
from idtool.signals.lowpass import Filter
from idtool.signals.own_filter import OwnFilter, noise_before
from idtool.signals.sparse_rows import SparseRows

#: An axis moves for certain above this share of the top speed.
_MOVING = 0.02
#: Rows that a filter makes useless are done without up to this share of them.
_REMEMBERED = 0.3


@dataclass(frozen=True)
class Recording:
    """Logs of one axis, ready to fit.

    Attributes:
        axis: kind of axis, torque constant, and what the torque is counted in (`Axis.effort`).
        motion: smoothed motion, every row.
        torque: measured torque K i, or what stands for it (`idtool.log.effort`), every row.
        usable: rows fit to be compared (not at rest, not saturated, no outlier, not faster than the
            sampling).
        at_rest: rows at which the axis stands: friction there is any torque below break-away, which no model
            predicts; they are bounds on it.
        experiment: name of the experiment of each trial.
        source: index of the log that each trial came from.
        noise: standard deviation of the torque's white noise at full rate, before `own_filter`.
        filter: what the low-pass is.
        position_resolution: smallest step of the position reading, 0 without one.
        lost: reason -> rows that it cost.
        remarks: sentences on what was repaired, missing or left out whole.
        sources: file of each log.
        impossible: of each log, the readings that cannot be and were left out.
        wiring: of each log, sentences on columns that contradict each other.
        fold: what is left out together when a model is judged on what it did not see, (rows,); None is the
            trial.
        unseen: how far the axis may move in a rest without its position showing it, rad (m).
        by_voltage: the torque is what the motor's voltage would make of it at a stand.
        rig: the word that opens the rig that ran all the logs (`--rig`), "" where they do not say one.
        weight: of each row in a fit, one over what models leave there, (rows,); None is the same for all.
        unsure: standard deviation of the acceleration, rad/s^2 (m/s^2), (rows,); None where nobody knows it.
        own_filter: the low-pass that the torque went through before it was logged, None for none.
    """

    axis: Axis
    motion: Motion
    torque: Array
    usable: NDArray[np.bool_]
    at_rest: NDArray[np.bool_]
    experiment: tuple[str, ...]
    source: tuple[int, ...]
    noise: float
    filter: Filter
    position_resolution: float
    lost: dict[str, int] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    impossible: tuple[tuple[Reading, ...], ...] = ()
    wiring: tuple[tuple[str, ...], ...] = ()
    fold: NDArray[np.intp] | None = None
    unseen: float = 0.0
    by_voltage: bool = False
    rig: str = ""
    weight: Array | None = None
    unsure: Array | None = None
    own_filter: OwnFilter | None = None

    @cached_property
    def torque_size(self) -> float:
        """Root mean square of the measured torque, rows that a fit uses."""
        return float(np.sqrt(np.mean(self.torque[self.usable] ** 2)))

    @cached_property
    def floor(self) -> float:
        """Standard deviation of the noise that the logs show."""
        return self.noise * (1.0 if self.own_filter is None else self.own_filter.noise_gain(self.motion))

    @cached_property
    def operator(self) -> SparseRows:
        """The filter and decimation as a matrix, shape (filtered rows, rows); a weight is in it."""
        matrix = lowpass.operator(self.motion, self.usable, self.filter)
        if not len(matrix) and not self.motion.velocity.any():
            raise InputError(
                "nothing moves", file=", ".join(self.sources), remedy="record the axis while it moves"
            )
        if not len(matrix):
            reasons = "".join(f", {reason}: {count}" for reason, count in self.lost.items())
            rate = 1.0 / self.motion.period
            raise InputError(
                f"no row is left to be compared ({len(self.torque)} rows at {rate:.3g} Hz{reasons})",
                file=", ".join(self.sources),
                remedy="record at a higher rate, for longer, or move more slowly",
            )
        return matrix if self.weight is None else matrix.weighted(self.weight[_middle(matrix)])

    @cached_property
    def model_operator(self) -> SparseRows:
        """The same for what a model predicts: it goes through the log's own filter first."""
        return self.operator if self._own is None else self.operator.after(self._own)

    @cached_property
    def _own(self) -> SparseRows | None:
        return None if self.own_filter is None else self.own_filter.matrix(self.motion)

    @cached_property
    def row_weight(self) -> Array:
        """Weight of each filtered row; `filtered` has it in it."""
        return np.ones(len(self.row)) if self.weight is None else self.weight[self.row]

    @cached_property
    def row(self) -> NDArray[np.intp]:
        """The full-rate row at the middle of each filtered row."""
        return _middle(self.operator)

    @cached_property
    def filtered_trial(self) -> NDArray[np.intp]:
        """Trial of each filtered row."""
        return self.motion.trial[self.row]

    @cached_property
    def filtered_stretch(self) -> NDArray[np.intp]:
        """Stretch of each filtered row (`Motion.stretch`)."""
        return self.motion.stretch[self.row]

    @cached_property
    def filtered_fold(self) -> NDArray[np.intp]:
        """Fold of each filtered row."""
        return self.filtered_trial if self.fold is None else self.fold[self.row]

    @cached_property
    def entering(self) -> Array:
        """Velocity at the start of each trial that begins in motion, 0 for other stretches, (stretches,)."""
        begins = np.flatnonzero(self.motion.begins)
        moves = self.motion.first[begins] & ~self.at_rest[begins] & self.moving[begins]
        return np.asarray(np.where(moves, self.motion.velocity[begins], 0.0))

    @cached_property
    def goes_on(self) -> Array:
        """How far each trial that begins in motion goes before it turns, rad (m); 0 for other stretches,
        shape (stretches,)."""
        motion, far = self.motion, np.zeros(self.motion.stretches)
        edges = np.append(np.flatnonzero(motion.begins), len(motion))
        for k in np.flatnonzero(self.entering):
            rows = slice(edges[k], edges[k + 1])
            on = np.cumprod(motion.velocity[rows] * self.entering[k] > 0.0)
            far[k] = np.abs(np.diff(motion.position[rows])) @ on[1:]
        return far

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Rows that are faster than the noise of a standing axis, for certain, (rows,)."""
        speed = np.abs(self.motion.velocity)
        return np.asarray(speed > _MOVING * np.quantile(speed, 0.999))

    @cached_property
    def stretch_pointer(self) -> NDArray[np.intp]:
        """First filtered row of each stretch, and the number of rows at its end, (stretches + 1,)."""
        return np.searchsorted(self.filtered_stretch, np.arange(self.motion.stretches + 1))

    @cached_property
    def _kept(self) -> dict[object, Any]:
        return {}

    def once(self, key: object, compute: Callable[[], Any]) -> Any:
        """What `compute` returned when it was asked for by that key first: many models are tried on the same
        rows."""
        if key not in self._kept:
            self._kept[key] = compute()
        return self._kept[key]

    @cached_property
    def of_rows(self) -> dict[object, Any]:
        """What was computed of the rows, whatever their load is: copies with another load have it too."""
        return {}

    @cached_property
    def filtered_torque(self) -> Array:
        """Measured torque, filtered."""
        return np.asarray(self.operator @ self.torque)

    @cached_property
    def added(self) -> dict[object, tuple[object, Array]]:
        """Filtered columns that a fit computed last, by name, with what each depends on."""
        return {}

    @cached_property
    def derivatives(self) -> dict[str, tuple[object, Contribution]]:
        """The same at full rate."""
        return {}

    def filtered(self, values: Array) -> Array:
        """Filter what a model predicts, one column or several, shape (rows,) or (rows, n)."""
        return np.asarray(self.model_operator @ values)

    def logged(self, torque: Array) -> Array:
        """A predicted torque as these logs would show it, shape (rows,)."""
        return torque if self._own is None else np.asarray(self._own @ torque)

    def told_of_rows(self) -> list[str]:
        """Sentences on rows that were in the logs and are not compared, and on what was repaired."""
        lost = sum(self.lost.values())
        if not lost:
            return list(self.remarks)
        reasons = ", ".join(f"{reason} {count}" for reason, count in self.lost.items())
        rows = "row was" if lost == 1 else "rows were"
        return [*self.remarks, f"{lost} {rows} left out of the comparison ({reasons})."]

    @property
    def contradictions(self) -> list[str]:
        """Sentences on columns that contradict each other, to be read before any number."""
        return [sentence for log in self.wiring for sentence in log]

    @property
    def odd(self) -> list[str]:
        """The logs whose columns do."""
        return [source for source, said in zip(self.sources, self.wiring, strict=True) if said]

    @property
    def trials(self) -> int:
        """Number of trials."""
        return self.motion.trials

    def subset(self, trials: Sequence[int] | NDArray[np.intp]) -> Recording:
        """Only these trials, renumbered from 0; filter and noise stay as they are."""
        wanted = np.asarray(sorted(int(t) for t in trials), dtype=np.intp)
        rows = np.isin(self.motion.trial, wanted)
        renumbered = np.searchsorted(wanted, self.motion.trial[rows]).astype(np.intp)
        return replace(
            self,
            motion=replace(self.motion.part(rows), trial=renumbered),
            torque=self.torque[rows],
            usable=self.usable[rows],
            at_rest=self.at_rest[rows],
            fold=None if self.fold is None else self.fold[rows],
            weight=None if self.weight is None else self.weight[rows],
            unsure=None if self.unsure is None else self.unsure[rows],
            experiment=tuple(self.experiment[t] for t in wanted),
            source=tuple(self.source[t] for t in wanted),
        )

    def without_rows(self, rows: NDArray[np.bool_]) -> Recording:
        """The same motion with some rows not compared."""
        return replace(self, usable=self.usable & ~rows)

    def with_load(self, load: Array | None, upright: Array | None) -> Recording:
        """A copy whose motion knows the load that gravity puts on the axis."""
        copy = replace(self, motion=replace(self.motion, load=load, load_upright=upright))
        vars(copy)["of_rows"] = self.of_rows
        return copy

    def through(self, own: OwnFilter) -> Recording:
        """The same, where the torque went through a low-pass before it was logged."""
        noise = noise_before(own, self.torque, self.motion)
        return replace(self, own_filter=own, noise=self.noise if noise is None else noise)

    def without_what_was_before(self) -> Recording:
        """The same without the rows at which a filter that ran forwards alone still knows what was before:
        at rest the torque is the drive's, which no model tells. With all of them where few others are left.
        """
        if self.own_filter is None:
            return self
        known = self.usable & self.own_filter.remembers(self.motion)
        few = np.count_nonzero(known) > _REMEMBERED * np.count_nonzero(self.usable)
        return self if few or not known.any() else self.without_rows(known)


def _middle(operator: SparseRows) -> NDArray[np.intp]:
    first, last = operator.indices[operator.pointer[:-1]], operator.indices[operator.pointer[1:] - 1]
    return np.asarray((first + last) // 2, dtype=np.intp)
