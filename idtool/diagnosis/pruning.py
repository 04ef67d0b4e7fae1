"""Second thoughts on accepted effects: what became unneeded, what only follows a part of something else, what
a special case does as well, and what explains the data as well in its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from idtool.diagnosis.candidates import (
    LEAST_GAIN,
    LEAST_OF_EXCESS,
    Selection,
    implausible,
    root_mean,
    swap,
    ties,
)
from idtool.diagnosis.evidence import Background, left_out_errors
from idtool.diagnosis.residual import generic_columns, test_residual
from idtool.effects.base import Effect
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.model.motion import Array

#: An effect must take away this many times what still depends on its variable.
_MIMIC = 6.0
#: ... and where it took away so many times what depends on something else, that is not its cause.
_FAR = 10.0
#: Of what an effect takes away, the least share that is its own beside a smooth function of something else.
_OWN_SHARE = 0.3


def drop_unneeded(selection: Selection, tell: Callable[[str], None]) -> None:
    dropped = True
    while dropped:
        dropped = False
        fit = selection.fit
        for effect in fit.model.spec.effects:
            impossible = implausible(fit, effect)
            model = JointModel.build(
                fit.model.recording, fit.model.spec.without(effect.name), fit.model.constants
            )
            tell(f"trying without {effect.name}")
            smaller = refit(fit, model)
            needed = root_mean(left_out_errors(smaller), smaller) > (1.0 + LEAST_GAIN) * root_mean(
                left_out_errors(fit), fit
            )
            if impossible or not needed:
                selection.fit = smaller
                candidate = selection.candidates[effect.name]
                candidate.accepted = False
                candidate.why = impossible or "became unneeded when other effects were in"
                selection.alternatives.pop(effect.name, None)
                selection.p_values.pop(effect.name, None)
                dropped = True
                break


def drop_mimics(selection: Selection, tell: Callable[[str], None]) -> None:
    """Drop effects that follow only a part of something else.

    A bump at one place has a Fourier component that a ripple can take away, and what is left still depends on
    the place: an effect is not the explanation where what is left over its own variable is of the order of
    what it took away, or where it took away little of what is too much. Nor is it where a smooth function of
    another variable, on which the residual still depends, takes away nearly the same.
    """
    while True:
        fit = selection.fit
        left = {test.variable: test.share * fit.sse for test in test_residual(fit) if test.depends}
        if not left:
            return
        generic = generic_columns(fit)
        floor = len(fit.residual) * fit.model.filtered_noise**2
        mimics = []
        for effect in fit.model.spec.effects:
            if effect.name == "inertia":
                continue
            tell(f"trying without {effect.name}")
            model = JointModel.build(
                fit.model.recording, fit.model.spec.without(effect.name), fit.model.constants
            )
            smaller = refit(fit, model)
            taken = smaller.sse - fit.sse
            own = [left[variable] for variable in effect.follows if variable in left]
            others = [
                generic[variable]
                for variable, remains in left.items()
                if variable not in effect.follows and taken < _FAR * remains
            ]
            if (
                taken < LEAST_OF_EXCESS * (smaller.sse - floor)
                or (own and taken < _MIMIC * max(own))
                or any(_share_beside(fit, smaller, effect, columns) < _OWN_SHARE for columns in others)
            ):
                mimics.append((smaller.sse, effect, smaller))
        if not mimics:
            return
        _, effect, selection.fit = min(mimics, key=lambda mimic: mimic[0])
        candidate = selection.candidates[effect.name]
        candidate.accepted = False
        candidate.why = f"follows only a part of what depends on {' and '.join(left)}"
        selection.alternatives.pop(effect.name, None)
        selection.p_values.pop(effect.name, None)


def _share_beside(fit: JointFit, without: JointFit, effect: Effect, generic: Array) -> float:
    """Of what an effect takes away of the residual of the fit without it, the share that is left to take away
    when generic columns have taken what they can."""
    background = Background.of(without)
    n = len(generic)
    basis, residual = background.basis[:n], background.residual[:n]
    mine = [name.startswith(f"{effect.name}.") for name in fit.model.names]
    own = fit.jacobian[:n, mine]
    own, generic = own - basis @ (basis.T @ own), generic - basis @ (basis.T @ generic)

    def taken(columns: Array) -> float:
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        left = residual - columns @ np.linalg.lstsq(columns, residual, rcond=1e-8)[0]
        return float(residual @ residual - left @ left)

    alone = taken(own)
    return (taken(np.hstack([generic, own])) - taken(generic)) / max(alone, 1e-300)


def simplify(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> None:
    """Put a special case in the place of an accepted effect wherever it does as well."""
    by_name = {effect.name: effect for effect in library}
    for effect in selection.fit.model.spec.effects:
        for name in effect.absorbs:
            if name not in by_name or by_name[name].missing(selection.fit.model.recording.motion):
                continue
            tell(f"trying {name} in place of {effect.name}")
            fit = selection.fit
            swapped = swap(fit, effect, by_name[name])
            before, after = left_out_errors(fit), swapped.left_out
            if root_mean(after, swapped.fit) > (1.0 + LEAST_GAIN) * root_mean(before, fit):
                continue
            selection.fit = swapped.fit
            loser, winner = selection.candidates[effect.name], selection.candidates[name]
            loser.accepted, loser.why = False, f"its special case {name} does as well"
            winner.accepted, winner.why = True, "lowers the error on left-out trials"
            winner.held_out = root_mean(after, swapped.fit)
            selection.p_values[name] = selection.p_values.pop(effect.name, swapped.p_value)
            selection.alternatives.pop(effect.name, None)
            break


def find_alternatives(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> None:
    """For each accepted effect, the equally simple ones that explain the data as well in its place.

    Candidates are those that tied when it was accepted, and its known look-alikes. Inertia, which every
    axis has, is not put in question.
    """
    by_name = {effect.name: effect for effect in library}
    fit = selection.fit
    motion = fit.model.recording.motion
    left_out = left_out_errors(fit)
    found: dict[str, list[str]] = {}
    for effect in fit.model.spec.effects:
        if effect.name == "inertia":
            continue
        size = len(effect.active(motion))
        names = dict.fromkeys([*selection.alternatives.get(effect.name, []), *effect.look_alikes])
        for name in names:
            other = by_name.get(name)
            if other is None or selection.candidates[name].accepted or other.missing(motion):
                continue
            if len(other.active(motion)) != size:
                continue
            tell(f"trying {name} in place of {effect.name}")
            swapped = swap(fit, effect, other)
            if len(swapped.fit.x) == len(fit.x) and ties(swapped.left_out, left_out):
                found.setdefault(effect.name, []).append(name)
                selection.rivals.setdefault(effect.name, swapped.fit)
                selection.candidates[name].why = f"explains the data as well as {effect.name}, which is taken"
    selection.alternatives = found
