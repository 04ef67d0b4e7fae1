"""The base model of logs: gravity, inertia and a friction law, before any further effect is looked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from idtool.diagnosis.acted_once import Stretch, acted_once, joined, without_what_acted
from idtool.diagnosis.weights import weighed
from idtool.effects import registry
from idtool.errors import InputError, nearest
from idtool.fit.choose import CLEAR_EVIDENCE, choose_gravity, first_fit, first_fits, step_down
from idtool.fit.joint import JointFit, gain_in_evidence, refit
from idtool.fit.model import JointModel
from idtool.fit.own_filter import behind_own_filter, filtered_before
from idtool.fit.restart import worth_a_restart
from idtool.fit.shortcoming import Shortcoming
from idtool.fit.spec import FRICTION_KINDS, FrictionKind, Spec
from idtool.signals import Recording
from idtool.signals.own_filter import OwnFilter
from idtool.signals.thin import thin

#: A low-pass is told so many times at most, each time from the base model behind the last one.
_PASSES = 4
#: What acted once is looked for so many times; what is found each time acted more often than that.
_ONCE = 3


@dataclass(frozen=True)
class Base:
    """Fits of the base model that the data can carry, the one to trust most first.

    Attributes:
        recording: all rows that they are of; behind a low-pass where the torque went through one.
        fits: to the thinned rows; where LuGre leaves more than noise, the last one is without presliding.
        notes: on all of them.
        stepped_down: of each, notes on the law that the data cannot carry, and what they lack for it.
    """

    recording: Recording
    fits: Sequence[JointFit]
    notes: Sequence[str]
    stepped_down: Sequence[tuple[Sequence[str], Sequence[Shortcoming]]]

    @property
    def best(self) -> JointFit:
        """The fit that leaves least."""
        return min(self.fits, key=lambda fit: fit.sse)


def base_model(
    recording: Recording,
    law: str,
    gravity: str,
    *,
    optimizer: str = "direct",
    seed: int = 0,
    without: Sequence[str] = (),
    tell: Callable[[str], None] = lambda _: None,
) -> Base:
    """The base model, behind the low-pass that the torque went through before it was logged, if it did.

    Args:
        recording: of one axis.
        law, gravity, optimizer, seed, without, tell: as in `identify`.

    Raises:
        InputError: an unknown law, nothing moves, or the gravity that is asked for cannot be fitted.
    """
    of_rows = partial(base_of_rows, law=law, gravity=gravity, optimizer=optimizer, seed=seed, without=without)
    base = replace(of_rows(thin(recording)), recording=recording)
    base = _undisturbed(base, of_rows)
    if own := low_pass_of(base.best, base.recording, tell):
        base = _told_anew(base.recording, own, of_rows)
    own = base.recording.own_filter
    return replace(base, notes=[*base.notes, *([_filtered(own)] if own else [])])


def _undisturbed(base: Base, of_rows: Callable[[Recording], Base]) -> Base:
    """The base model of the rows on which nothing acted that acts nowhere else; the same one where something
    is found again and again, which is no such thing."""
    found, acted = base, list[Stretch]()
    for _ in range(_ONCE):
        more = acted_once(found.best)
        if not more:
            return found
        acted = joined([*acted, *more])
        quiet = without_what_acted(base.recording, acted)
        found = replace(of_rows(thin(quiet)), recording=quiet)
    return base


def _told_anew(recording: Recording, own: OwnFilter, of_rows: Callable[[Recording], Base]) -> Base:
    """The base model behind a low-pass, which that tells better than one that was fitted beside none."""

    def behind(own: OwnFilter) -> Base:
        filtered = recording.through(own).without_what_was_before()
        return replace(of_rows(thin(filtered)), recording=filtered)

    base = behind(own)
    for _ in range(_PASSES):
        again, fit = behind_own_filter(base.best)
        if again.is_near(own) or _hides_all(fit):
            break
        anew = behind(again)
        if anew.best.rmse >= base.best.rmse:
            break
        base, own = anew, again
    return base


def low_pass_of(fit: JointFit, recording: Recording, tell: Callable[[str], None]) -> OwnFilter | None:
    """The low-pass that the torque of a recording went through, where a fit says clearly which; None where
    none is known that was not known before."""
    if recording.own_filter is not None or not filtered_before(recording):
        return None
    tell("finding the low-pass that the torque went through")
    spec = fit.model.spec.without("transport_delay")  # which stands for the delay of a filter
    plain = refit(fit, JointModel.build(fit.model.recording, spec, fit.model.constants))
    own, behind = behind_own_filter(plain)
    return None if _hides_all(behind) or gain_in_evidence(fit, behind) <= CLEAR_EVIDENCE else own


def _hides_all(fit: JointFit) -> bool:
    """Whether a low-pass hides more noise than all that was read: it is none, but stands for a torque that is
    as smooth as that."""
    return fit.model.recording.noise > fit.model.recording.torque_size


def _filtered(own: OwnFilter) -> str:
    how = "as a drive filters" if own.causal else "without delay"
    return (
        f"the torque went through a low-pass before it was logged, {how} ({own.corner_hz:.3g} Hz); what the "
        "model predicts goes through the same."
    )


def base_of_rows(
    rows: Recording,
    law: str,
    gravity: str,
    *,
    optimizer: str = "direct",
    seed: int = 0,
    without: Sequence[str] = (),
) -> Base:
    """The base model of just these rows, as they were logged.

    Raises:
        InputError: as `base_model`.
    """
    kind: FrictionKind = check_choice("friction", law, FRICTION_KINDS)  # type: ignore[assignment]
    if not rows.motion.velocity.any():
        raise InputError(
            "nothing moves", file=", ".join(rows.sources), remedy="record the axis while it moves"
        )
    model, columns = choose_gravity(rows, gravity)
    notes = []
    if model == "slide" and "base" not in columns:
        notes.append(
            "gravity never acts without payload: its base is not determined; add a run that stands upright."
        )
    inertia = registry.get("inertia")
    has_inertia = inertia.name not in without and not inertia.missing(rows.motion)
    spec = Spec(kind, model, columns, (inertia,) if has_inertia else ())
    search = partial(first_fits, spec=spec, optimizer=optimizer, seed=seed)
    fits = search(rows)
    # rows near standstill that follow no law would have the say in what the sliding ones show
    if (counted := weighed(rows, fits[0], unsure=law != "coulomb")) is not rows:
        fits, rows = search(counted), counted
    stepped = [step_down(fit) for fit in fits]
    # a bristle may bend for what the model lacks
    if stepped[0][0].model.spec.friction == "lugre" and worth_a_restart(fits[0]):
        static = replace(spec, friction="stribeck")
        rigid, why, reasons = step_down(first_fit(rows, static, optimizer=optimizer, seed=seed))
        why = ["no presliding is modelled: what was found predicts better without LuGre's.", *why]
        stepped.append((rigid, why, reasons))
    bare = [_bare(fit, spec) for fit, _, _ in stepped]
    return Base(rows, bare, notes, [(why, reasons) for _, why, reasons in stepped])


def _bare(fit: JointFit, spec: Spec) -> JointFit:
    """The fit without what only helped the search."""
    kept = replace(fit.model.spec, effects=spec.effects)
    return refit(fit, JointModel.build(fit.model.recording, kept, fit.model.constants))


def check_choice(argument: str, value: str, known: Sequence[str]) -> str:
    """The value, if it is one of the known ones.

    Raises:
        InputError: it is not; the sentence suggests the nearest.
    """
    if value not in known:
        raise InputError(f"unknown {argument} {value!r}", argument=argument, remedy=nearest(value, known))
    return value
