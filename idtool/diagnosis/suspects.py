"""Effects that would take away something of what a fit leaves though that looks like noise.

A missing effect that the friction curve can almost follow leaves little: the residual is as large as the
noise and shows no pattern of its own, while the parameters are far off. Each effect of the library is
therefore scored against the residual (`best_start`), and one that takes away more than chance would is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from idtool.diagnosis.candidates import Start, added, best_start
from idtool.diagnosis.remainder import Remainder, doubted
from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.fit.joint import JointFit

#: A fit that lacks nothing is suspected with this chance at most, all effects together (Bonferroni).
_CHANCE = 0.01


@dataclass(frozen=True)
class Suspect:
    """An effect that the fit may lack, with where a refit with it would start."""

    effect: Effect
    start: Start


def suspects(fit: JointFit) -> list[Suspect]:
    """Effects of the library whose score is no chance, the least likely to be chance first."""
    motion = fit.model.recording.motion
    has = {effect.name for effect in fit.model.spec.effects}
    library = [one for one in registry.library() if one.name not in has and one.missing(motion) is None]
    scored = [Suspect(effect, best_start(fit, effect)) for effect in library]
    found = [one for one in scored if one.start.p_value * len(library) < _CHANCE]
    return sorted(found, key=lambda one: one.start.p_value)


def allowing_for_what_lacks(
    fit: JointFit, left: Remainder | None, *, look: bool = True
) -> tuple[JointFit, list[Suspect]]:
    """The fit with intervals that cover what its model lacks, and the effects that may be that.

    Args:
        fit: of a model.
        left: structure in what it leaves; that covers what an effect which shows nowhere else can do.
        look: whether to look for such an effect.
    """
    if left is not None:
        return doubted(fit, left), []
    found = suspects(fit) if look else []
    return allowing_for(fit, found), found


def allowing_for(fit: JointFit, found: Sequence[Suspect]) -> JointFit:
    """The fit with intervals that cover what any of the suspects can have done to each number: by as much as
    one moves a parameter when it is fitted beside."""
    if not found:
        return fit
    rows = len(fit.residual)
    own = fit.jacobian[:rows, fit.free]
    pull = np.zeros(len(fit.x))
    for one in found:
        both = np.column_stack([own, added(fit, one.effect, one.start.values)])
        size = np.linalg.norm(both, axis=0)
        size[size == 0.0] = 1.0
        moved = np.linalg.lstsq(both / size, fit.residual, rcond=1e-6)[0] / size
        larger = np.abs(moved[:-1]) > np.abs(pull[fit.free])
        pull[fit.free] = np.where(larger, moved[:-1], pull[fit.free])
    return replace(fit, pull=pull)
