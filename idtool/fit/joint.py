"""The joint fit: every parameter on all logs at once, by bounded least squares."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, wraps
from typing import Any, Concatenate, ParamSpec, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import Effect
from idtool.errors import InputError
from idtool.fit.basis import orthonormal
from idtool.fit.covariance import Uncertainty, correlation_rows, uncertainty
from idtool.fit.levenberg import minimise
from idtool.fit.model import Evaluation, JointModel
from idtool.fit.outcome import Outcome
from idtool.fit.starts import free_starts, settled
from idtool.model.motion import Array
from idtool.model.torque import predict

#: A coordinate closer to its bound than this share of the range (or of 1, if open) sits at it.
_AT_BOUND = 1e-4
#: Stands for the fit itself in what is kept of it.
_ITSELF = object()
_P = ParamSpec("_P")
_T = TypeVar("_T")

#: How often the starts of effects with memory and the parameters are fitted in turn.
_SETTLING = 2
#: A fit is taken up again with the prior that fits what it found, so many times at most, until that keeps
#: within this share: what a start may be must not depend on where the fit began.
_SCALINGS, _SAME_SCALE = 3, 0.05


@dataclass(frozen=True)
class JointFit:
    """A fitted model.

    Attributes:
        model: what was fitted.
        x: coordinates.
        bend: scale of the prior of the start deflections.
        start: start deflection of each stretch, (stretches,).
        residual: of the filtered rows.
        penalty: of the start deflections, (stretches,).
        evaluations: how often the model was evaluated.
        held: coordinates that were not varied.
        ended: how the search ended; see `outcome`.
        pull: by how much an effect that the model lacks can have moved each coordinate; None if nothing is
            known to be lacking.
        unsure: standard error of each coordinate that was held; None if they are known exactly.
    """

    model: JointModel
    x: Array
    bend: float
    start: Array
    residual: Array
    penalty: Array
    evaluations: int
    held: frozenset[str] = frozenset()
    ended: Outcome = Outcome.CONVERGED
    pull: Array | None = None
    unsure: Array | None = None

    @property
    def presliding_scale(self) -> float:
        """How far the bristle bends before it slides, rad (m)."""
        return self.model.presliding_scale(self.x)

    @property
    def outcome(self) -> Outcome:
        """How the fit ended, a coordinate that sits at a bound counted as such."""
        stuck = any(at and name not in self.held for name, at in self.at_bound.items())
        return self.ended.at(bound=stuck)

    @property
    def sse(self) -> float:
        """Sum of squared residuals of the filtered rows."""
        return float(self.residual @ self.residual)

    @property
    def rmse(self) -> float:
        """Root-mean-square residual of the filtered rows."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def relative(self) -> float:
        """Norm of the residual over the norm of the torque, filtered rows."""
        return float(np.linalg.norm(self.residual) / np.linalg.norm(self.model.measured))

    @cached_property
    def values(self) -> dict[str, float]:
        """Physical value of each coordinate."""
        return self.model.values(self.x)

    @cached_property
    def jacobian(self) -> Array:
        """Derivative of -residual and -penalty, projected, (filtered rows + stretches, coordinates)."""
        jacobian = self.model.differentiate(self.x, self.bend, self.start)
        self.model.forget()  # of most fits nothing more is asked
        return jacobian

    @cached_property
    def basis(self) -> Array:
        """Orthonormal basis of the Jacobian's free columns, (filtered rows + stretches, rank)."""
        return orthonormal(self.jacobian[:, self.free])

    @cached_property
    def known(self) -> dict[object, Any]:
        """What was computed of the fit and is asked for again, by what it is."""
        return {}

    @cached_property
    def full_residual(self) -> Array:
        """Measured minus predicted torque of every row, unfiltered."""
        return self.model.recording.torque - self.predicted

    @cached_property
    def predicted(self) -> Array:
        """Predicted torque of every row, as the logs would show it."""
        return self.model.recording.logged(self.unfiltered)

    @cached_property
    def unfiltered(self) -> Array:
        """Predicted torque of every row, as it acts."""
        model = self.model
        motion = model.recording.motion
        return predict(motion, model.friction(self.x), model.contribution(self.x), self.start).torque

    @cached_property
    def at_bound(self) -> dict[str, bool]:
        """Whether each coordinate sits at a bound."""
        low, high = self.model.bounds
        # an open range is as long as what would make all of the measured torque
        slope = np.linalg.norm(self.jacobian, axis=0)
        alone = np.linalg.norm(self.model.measured) / np.where(slope > 0.0, slope, np.inf)
        margin = _AT_BOUND * np.where(np.isfinite(high - low), high - low, alone)
        at = (self.x - low <= margin) | (high - self.x <= margin)
        found = dict(zip(self.model.names, at.tolist(), strict=True))
        return found | {"static": True} if self.model.flat(self.x) else found

    @property
    def rigid(self) -> bool:
        """Whether the bristle is as stiff as the fit lets it be; it may be as soft instead."""
        low, high = self.model.bounds
        i = self.model.names.index("bristle_stiffness")
        return self.at_bound["bristle_stiffness"] and bool(self.x[i] > 0.5 * (low[i] + high[i]))

    def reach_from_bound(self, name: str) -> float:
        """How far a coordinate may be from the bound that it sits at: 95 %, linearised, inf if unknown."""
        i = self.model.names.index(name)
        tried = self.free.copy()
        tried[i] = True
        place = int(np.count_nonzero(tried[:i]))
        trial = self.model.recording.filtered_trial
        found = uncertainty(self.jacobian[:, tried], self.residual, trial)
        moved = float(np.linalg.norm(self._moved[:, i]))
        reach = float(found.one_sided[place]) * math.hypot(math.sqrt(found.covariance[place, place]), moved)
        return reach if reach > 0.0 else math.inf

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """Mask of coordinates that were varied and are not at a bound."""
        stuck = [self.at_bound[name] or name in self.held for name in self.model.names]
        return ~np.array(stuck, dtype=bool)

    @cached_property
    def uncertainty(self) -> Uncertainty:
        """Covariance and degrees of freedom of the free coordinates."""
        trial = self.model.recording.filtered_trial
        return uncertainty(self.jacobian[:, self.free], self.residual, trial)

    @cached_property
    def _moved(self) -> Array:
        """How far what is not in the residual can have moved each coordinate: an effect that the model lacks,
        and one standard error of each that was held, (causes, coordinates)."""
        moved = np.zeros((0, len(self.x))) if self.pull is None else self.pull[None, :]
        causes = np.flatnonzero(self.unsure) if self.unsure is not None else np.array([], dtype=np.intp)
        if not len(causes) or not self.free.any():
            return moved
        assert self.unsure is not None
        own = self.jacobian[:, self.free]
        size = np.linalg.norm(own, axis=0)
        size[size == 0.0] = 1.0
        torque = self.jacobian[:, causes] * self.unsure[causes]
        carried = np.zeros((len(causes), len(self.x)))
        carried[:, self.free] = -(np.linalg.lstsq(own / size, torque, rcond=1e-6)[0] / size[:, None]).T
        return np.vstack([moved, carried])

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the coordinates, robust against autocorrelated residuals, with `pull` and what those
        that were held may be off by added; those that were held or sit at a bound get zero rows."""
        covariance = np.zeros((len(self.x), len(self.x)))
        covariance[np.ix_(self.free, self.free)] = self.uncertainty.covariance
        return np.asarray(covariance + self._moved.T @ self._moved)

    @cached_property
    def quantile(self) -> Array:
        """Half width of each coordinate's 95 % interval in standard errors."""
        quantile = np.full(len(self.x), 1.96)
        quantile[self.free] = self.uncertainty.quantile
        return quantile

    @cached_property
    def correlation(self) -> Array:
        """Correlation matrix of the coordinates."""
        sd = np.sqrt(np.diag(self.covariance))
        sd = np.where(sd > 0, sd, np.inf)
        matrix = self.covariance / np.outer(sd, sd)
        np.fill_diagonal(matrix, 1.0)
        return np.asarray(matrix)


def kept(function: Callable[Concatenate[JointFit, _P], _T]) -> Callable[Concatenate[JointFit, _P], _T]:
    """A function of a fit, and of what can be a key, that is computed once: a search comes by the same fit
    again and again. What it returns is nobody's to change."""

    @wraps(function)
    def asked(fit: JointFit, /, *args: _P.args, **options: _P.kwargs) -> _T:
        key = (function, args, tuple(options.items()))
        if key not in fit.known:
            found = function(fit, *args, **options)
            fit.known[key] = _ITSELF if found is fit else found  # or it would never be let go
        known: Any = fit.known[key]
        return cast("_T", fit if known is _ITSELF else known)

    return asked


def solve(
    model: JointModel,
    x: Array,
    *,
    bend: float | None = None,
    most: int = 60,
    tolerance: float = 1e-7,
    held: frozenset[str] = frozenset(),
) -> JointFit:
    """Least squares from coordinates `x`.

    Args:
        model: what to fit.
        x: start.
        bend: scale of the prior of the start deflections; that of what is found if not given.
        most: how many evaluations to spend at most.
        tolerance: share of the sum of squares, or of the coordinates, that is not worth another step.
        held: coordinates to leave at their start.

    Raises:
        InputError: fewer rows than parameters.
    """
    low, high = model.bounds
    if len(model.measured) < 2 * len(x):
        raise InputError(
            f"{len(model.measured)} filtered rows cannot determine {len(x)} parameters",
            file=", ".join(model.recording.sources),
            remedy="record for longer, or choose a simpler --friction",
        )
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    varied = np.array([name not in held for name in model.names])
    inside = np.where(varied, np.clip(x, low + 2e-6 * span, high - 2e-6 * span), x)
    scale = model.presliding_scale(inside) if bend is None else bend
    scale = min(scale, model.longest_bend)
    cache: dict[bytes, Evaluation] = {}  # the point that the search is at, and those tried from there

    def whole(part: Array) -> Array:
        full = inside.copy()
        full[varied] = part
        return full

    def residual(part: Array) -> Array:
        evaluation = cache[part.tobytes()] = model.evaluate(whole(part), scale)
        return -evaluation.stacked

    def jacobian(part: Array) -> Array:
        here = cache[part.tobytes()]
        cache.clear()
        cache[part.tobytes()] = here
        return model.differentiate(whole(part), scale, here.start, varied)

    part, evaluations = inside[varied], 0
    for _ in range(_SCALINGS):
        found = minimise(residual, jacobian, part, low[varied], high[varied], most=most, tolerance=tolerance)
        part, evaluations = found.x, evaluations + found.evaluations
        best = whole(part)
        now = min(model.presliding_scale(best), model.longest_bend)
        if bend is not None or abs(now - scale) < _SAME_SCALE * scale:
            break
        scale = now
        cache.clear()
    evaluation = cache.get(part.tobytes()) or model.evaluate(best, scale)
    return JointFit(
        model,
        best,
        scale,
        evaluation.start,
        evaluation.residual,
        evaluation.penalty,
        evaluations,
        held,
        Outcome.CONVERGED if found.outcome.converged else found.outcome,
    )


def refit(
    fit: JointFit,
    model: JointModel,
    extra: dict[str, float] | None = None,
    *,
    most: int = 60,
    tolerance: float = 1e-7,
    settling: int = _SETTLING,
) -> JointFit:
    """Fit another model from where `fit` ended; `extra` starts the coordinates it did not have. The starts of
    the memory of an effect that comes in are settled so many times (`settle`)."""
    values = {**fit.values, **(extra or {})}
    known = fit.model.starts if model.recording.trials == fit.model.recording.trials else {}
    names = [effect.name for effect in model.spec.effects if effect.free_start]
    if starts := {name: known[name] for name in names if name in known}:
        model = replace(model, starts=starts)
    x = model.coordinates({name: values[name] for name in model.names})
    new = solve(model, x, most=most, tolerance=tolerance)
    # starts found before hardly move when another effect comes in: they are not worth their time here
    return (
        new if all(name in known for name in names) else settle(new, settling, most=most, tolerance=tolerance)
    )


def settle(fit: JointFit, times: int = 1, *, most: int = 60, tolerance: float = 1e-7) -> JointFit:
    """The fit with the start of every trial of effects with memory found anew."""
    for _ in range(times if free_starts(fit.model) else 0):
        fit = solve(settled(fit.model, fit.x, fit.bend), fit.x, most=most, tolerance=tolerance)
    return fit


def on_recording(fit: JointFit, model: JointModel) -> JointFit:
    """The fitted parameters on other data: only the starts of its trials are new."""
    model = settled(model, fit.x, fit.bend)
    evaluation = model.evaluate(fit.x, fit.bend)
    return replace(
        fit,
        model=model,
        start=evaluation.start,
        residual=evaluation.residual,
        penalty=evaluation.penalty,
        evaluations=1,
    )


def pulled(fit: JointFit, by: Array) -> JointFit:
    """The fit with intervals that cover a move of each number by so much, or by what they cover already if
    that is more; shape (coordinates,)."""
    if fit.pull is not None:
        by = np.where(np.abs(by) > np.abs(fit.pull), by, fit.pull)
    return replace(fit, pull=by)


@kept
def torque_of(fit: JointFit, effect: Effect) -> float:
    """Root mean square of what an effect adds to the predicted torque, rows that a fit uses."""
    own = added_by(fit, effect)[fit.model.recording.usable]
    return float(np.sqrt(np.mean(own**2)))


def added_by(fit: JointFit, effect: Effect) -> Array:
    """What an effect adds to the predicted torque, shape (rows,)."""
    recording = fit.model.recording
    without = JointModel(
        recording, fit.model.spec.without(effect.name), fit.model.constants, fit.model.starts
    )
    x = without.coordinates({name: fit.values[name] for name in without.names})
    torque = predict(recording.motion, without.friction(x), without.contribution(x), fit.start).torque
    return recording.logged(fit.unfiltered - torque)


def gain_in_evidence(smaller: JointFit, larger: JointFit) -> float:
    """By how much the larger of two nested models lowers the Bayesian information criterion.

    Autocorrelated rows count as the fewer that they are worth, in the larger model's residual for
    both, so that the two are compared on the same number of rows. A start of a trial, which only its
    first rows determine, costs what Akaike's criterion asks of a parameter.
    """
    effective = len(larger.residual) / correlation_rows(
        larger.residual, larger.model.recording.filtered_trial
    )
    likelihood = effective * float(np.log(smaller.sse / larger.sse))
    starts = free_starts(larger.model) - free_starts(smaller.model)
    return likelihood - (len(larger.x) - len(smaller.x)) * float(np.log(effective)) - 2.0 * starts
