"""How a diagnosis goes: which effect the base model lacks, and what is left then."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from idtool.diagnosis.candidates import LEAST_GAIN
from idtool.diagnosis.diagnosis import Diagnosis
from idtool.diagnosis.exchange import exchange, in_its_place
from idtool.diagnosis.held_out import between, held_out_squares, predicts_worse
from idtool.diagnosis.level import told_by_its_level
from idtool.diagnosis.low_passes import allowing_for_low_pass
from idtool.diagnosis.next_experiment import NextExperiment, between_models, for_parameter
from idtool.diagnosis.passing import lowers
from idtool.diagnosis.plausible import CHANCE, WORTH
from idtool.diagnosis.pruning import (
    drop_impossible,
    drop_what_may_be_unknown,
    of_the_readings,
    simplify,
    veto,
)
from idtool.diagnosis.remainder import Remainder, memory_of_noise, remainder
from idtool.diagnosis.residual import DEPENDS, ResidualTest, test_residual
from idtool.diagnosis.selection import absorbed, begun, extend, good_enough, one_by_one
from idtool.diagnosis.shapes import Unnamed
from idtool.diagnosis.sides import allowing_for_sides
from idtool.diagnosis.sliding import outdoes
from idtool.diagnosis.split import Split, split
from idtool.diagnosis.springs import allowing_for_springs
from idtool.diagnosis.state import Rival, Selection
from idtool.diagnosis.summary import LOOKS_LIKE
from idtool.diagnosis.suspects import Suspect, allowing_for_what_lacks
from idtool.diagnosis.weights import weighed
from idtool.effects.base import Effect
from idtool.fit.choose import step_down, with_load
from idtool.fit.joint import JointFit, refit
from idtool.fit.left_out import SURELY, left_out_error
from idtool.fit.model import JointModel
from idtool.fit.restart import rises_all_along
from idtool.fit.results import dynamic_parameters, static_parameters
from idtool.fit.shortcoming import Shortcoming
from idtool.presentation.text import quantity
from idtool.signals import Recording
from idtool.signals.thin import thin

#: Of effects that were turned down so many are told.
_MOST_TOLD = 3
#: Effects that others may take the place of, one after another.
_EXCHANGES = 4
#: Sentences on what is going on that say how far it is (`idtool.verbs.expected`).
BASE, FINAL = "fitting the base model", "fitting the final model on all trials"


def diagnose(
    recording: Recording,
    starts: Sequence[JointFit],
    library: Sequence[Effect],
    tell: Callable[[str], None] = lambda _: None,
    *,
    given: bool = False,
    tolerance: float = 0.0,
) -> Diagnosis:
    """Find the effects that the base model lacks.

    Args:
        recording: all trials.
        starts: fits of the base model to these data, the one to trust most first. Another one is taken where
            it predicts better without any effect, or where the first one leaves something that it does not.
        library: the effects to consider.
        tell: called with a sentence on what is being tried.
        given: the library is a model that somebody chose; its effects need not explain everything.
        tolerance: error that is good enough, share of the torque (rms).
    """
    shown = split(with_load(recording, starts[0]))
    search = _Search(shown, library, tell, given, tolerance)
    found = search.found(starts)
    notes, stepped_down = search.step_down(found, shown)
    base, selection = found.base, found.selection
    if selection.fit.model.spec == base.model.spec:
        # nothing was added: one model, of which the search may have found a better minimum
        base = selection.fit
    final, tests, left = search.finish(found)
    notes += _notes(shown, search.parts.recording, final)
    if left is None and (memory := memory_of_noise(final)):
        notes.append(
            f"what is left is noise that is correlated over {1e3 * memory:.0f} ms, as readings are that were "
            "filtered; single readings differ by less."
        )
    if left and (shapes := [words for words in found.unnamed.values() if words]):
        notes.append(f"{LOOKS_LIKE}: {'; '.join(shapes)}.")
    # who chose the model has its numbers with its own errors
    hidden: list[Suspect] = []
    if not given:
        final, hidden = allowing_for_what_lacks(final, left, look=_no_chance(selection))
        final, sides = allowing_for_sides(final)
        final, springs = allowing_for_springs(final, left)
        final = allowing_for_low_pass(final)
        notes += filter(None, (sides, springs))
    notes += _turned_down(selection, hidden)
    return Diagnosis(
        split=shown,
        base=base,
        selection=selection,
        final=final,
        tests_before=test_residual(base, 0.0),
        tests_after=tests,
        next_experiment=_next_experiment(selection, final, tell),
        remainder=left,
        hidden=[one.effect.name for one in hidden],
        start=found.place,
        notes=notes,
        stepped_down=stepped_down,
    )


@dataclass
class _Found:
    """What the search from one fit of the base model led to.

    Attributes:
        place: of that fit among those that were given.
        base: that fit on the training rows.
        selection: the effects that were found.
        unnamed: shapes without a name that were taken out, and each in words ("" for what is too small).
    """

    place: int
    base: JointFit
    selection: Selection
    unnamed: dict[Unnamed, str]


@dataclass
class _Search:
    """The steps of a diagnosis, and what they share.

    Attributes:
        parts: training and held-out rows; weighed anew where some turn out to fit worse.
        library, tell, given, tolerance: as in `diagnose`.
    """

    parts: Split
    library: Sequence[Effect]
    tell: Callable[[str], None]
    given: bool
    tolerance: float

    def found(self, starts: Sequence[JointFit]) -> _Found:
        """The effects beside the base model, with rows that count by what is left beside them.

        Where some rows leave more beside the effects than they did before, the search begins anew: what it
        took in while they counted otherwise may have been there for their sake. The effects that come in one
        by one mostly tell that, before the search has tried all that it does where none passes.
        """
        self.tell(BASE)
        bases = self._trained(starts)
        if self._weighed(bases[0]):
            bases = self._trained(bases)
        # beside the base model with which the search begins: it comes by the same fits again, which are kept
        place, base = _of_one_law(bases)[0][-1]
        first = begun(base, self.library)
        one_by_one(first, self.library, self.tell, given=self.given, tolerance=self.tolerance)
        unnamed = _without_unnamed(first)
        found = self._anew(bases, _Found(place, base, first, unnamed)) or self._best_of(bases)
        found = self._anew(bases, found) or found
        for _ in range(_EXCHANGES):
            other = exchange(found.selection, self.library, self.tell)
            if other is None:
                break
            unnamed, _ = self._select(other)
            if not in_its_place(other.fit, found.selection.fit):
                break  # what came in is gone again
            found.selection, found.unnamed = other, unnamed
        return found

    def _anew(self, bases: Sequence[JointFit], found: _Found) -> _Found | None:
        """What a search that begins anew comes to, where rows count otherwise beside what was found; None
        where they do not. If that is surely worse the search goes on from what was found."""
        if not self._weighed(found.selection.fit):
            return None
        self.tell("weighing rows by what their like leave")
        found.selection.onto(thin(self.parts.training))
        anew = self._best_of(self._trained(bases))
        if left_out_error(anew.selection.fit) <= SURELY * left_out_error(found.selection.fit):
            return anew
        found.unnamed, _ = self._select(found.selection)
        return found

    def _trained(self, fits: Sequence[JointFit]) -> list[JointFit]:
        training = thin(self.parts.training)
        return [refit(fit, JointModel.build(training, fit.model.spec)) for fit in fits]

    def _weighed(self, fit: JointFit) -> bool:
        """Whether rows count otherwise than before, by what a fit leaves on them."""
        recording = weighed(self.parts.recording, fit, unsure=not self.given)
        if recording is self.parts.recording:
            return False
        self.parts = replace(self.parts, recording=recording)
        return True

    def _best_of(self, bases: Sequence[JointFit]) -> _Found:
        """The effects beside the base model that does best with them."""
        best: _Found | None = None
        rival: Rival | None = None
        been: list[JointFit] = []
        alike, rigid = _of_one_law(bases)
        # the one to trust most comes last, and goes on only while it may do as well as the others
        for place, base in reversed(alike):
            selection = begun(base, self.library)
            selection.others = tuple(been)
            unnamed, complete = self._select(selection, rival)
            been += selection.steps
            if selection.hopeless:
                continue
            if unnamed:
                # a shape can stand in the way of effects it is made of: where those do as well they are it
                self.tell("looking once more for effects that have a name")
                alone = begun(base, self.library)
                self._select(alone, Rival(complete, SURELY), named=True)
                if not alone.hopeless and _as_good(alone.fit, complete):
                    selection, unnamed = alone, {}
            fit = selection.fit
            done = not unnamed and not any(test.depends for test in test_residual(fit, DEPENDS))
            if best is None or (done and not outdoes(best.base, fit)) or not _beats(best.selection.fit, fit):
                best = _Found(place, base, selection, unnamed)
            rival = Rival(fit) if done else rival
        assert best is not None
        for place, base in rigid:
            best = self._without_presliding(_Found(place, base, begun(base, self.library), {}), best)
        return best

    def _without_presliding(self, rigid: _Found, best: _Found) -> _Found:
        """The better of what was found beside presliding and of what is found beside none.

        A bristle may bend for what the model lacks: an effect without it has to do more than the bristle did.
        All machines have presliding, so that the law without it has to predict better with fewer numbers, or
        surely.
        """
        self.tell("looking once more without presliding")
        rival, selection = best.selection.fit, rigid.selection.copy()
        path = [best.base, *best.selection.steps]
        one_by_one(selection, self.library, self.tell, given=self.given, tolerance=self.tolerance, path=path)
        if self._does_better(selection.fit, rival):
            rigid.unnamed, _ = self._select(selection, Rival(rival))
            rigid.selection = selection
        fit = rigid.selection.fit
        return rigid if not selection.hopeless and self._does_better(fit, rival) else best

    def _does_better(self, rigid: JointFit, rival: JointFit) -> bool:
        """Whether a fit predicts better by enough to matter with fewer numbers, or surely: left-out trials or
        the held-out rows."""
        error, least = left_out_error(rigid), left_out_error(rival)
        if SURELY * error < least or (len(rigid.x) < len(rival.x) and lowers(least, error)):
            return True
        held = [float(held_out_squares(each, self.parts, rigid).mean()) for each in (rigid, rival)]
        return SURELY**2 * held[0] < held[1]

    def _select(
        self, selection: Selection, rival: Rival | None = None, *, named: bool = False
    ) -> tuple[dict[Unnamed, str], JointFit]:
        """Add the effects that the data ask for, without those that the held-out rows turn down; the shapes
        without a name that were taken out, and the fit with them.

        Args:
            selection: what was found so far.
            rival: as in `extend`.
            named: without shapes that have no name.
        """
        wanted = self.library
        while True:
            extend(
                selection,
                wanted,
                self.tell,
                given=self.given or named,
                tolerance=self.tolerance,
                rival=rival,
            )
            if selection.hopeless:
                return {}, selection.fit
            complete = selection.fit
            unnamed = _without_unnamed(selection)
            vetoed = self._veto(selection, complete)
            wanted = absorbed(vetoed, self.library)
            if not wanted:
                if vetoed:  # without these a special case of another may do as well
                    simplify(selection, self.library, self.tell)
                return unnamed, complete

    def _veto(self, selection: Selection, beside: JointFit) -> list[Effect]:
        squares = partial(held_out_squares, parts=self.parts, beside=beside)
        return veto(selection, squares, partial(between, parts=self.parts), self.tell)

    def step_down(self, found: _Found, shown: Split) -> tuple[list[str], list[Shortcoming]]:
        """Take the simplest friction law that the data determine: beside the effects less may be seen of the
        friction than before they were in; as `choose.step_down`."""
        fit = found.selection.fit
        simpler, notes, stepped_down = step_down(fit)
        if simpler is not fit and predicts_worse(simpler, fit, shown):
            return [], []  # rows that count less since may have been what the law was needed for
        found.selection.fit = simpler
        return notes, stepped_down

    def finish(self, found: _Found) -> tuple[JointFit, list[ResidualTest], Remainder | None]:
        """The chosen model on all trials, without effects that cannot be there; its residual's tests, and the
        structure in it."""
        self.tell(FINAL)
        selection = found.selection
        followed = [variable for shape, told in found.unnamed.items() if told for variable in shape.follows]
        while True:
            final = _finished(selection, self.parts.recording)
            tests = test_residual(final, 0.0)
            left = None if good_enough(final, self.tolerance) else remainder(final, tests, followed)
            if drop_impossible(selection, final):
                # what one effect had in common with others is theirs then, and may make them what they
                # were not
                self._veto(selection, selection.fit)
                simplify(selection, self.library, self.tell)
            elif self.given or not (
                drop_what_may_be_unknown(selection, final, left.depends_on if left else ())
                or simplify(selection, self.library, self.tell, final)
            ):
                return final, tests, left and replace(left, looked_for=not self.given)


def _of_one_law(
    bases: Sequence[JointFit],
) -> tuple[list[tuple[int, JointFit]], list[tuple[int, JointFit]]]:
    """The fits of the first one's friction law, each with its place, and those without its presliding."""
    law = bases[0].model.spec.friction
    alike = [(k, base) for k, base in enumerate(bases) if base.model.spec.friction == law]
    return alike, [(k, base) for k, base in enumerate(bases) if base.model.spec.friction != law]


def _beats(other: JointFit, trusted: JointFit) -> bool:
    """Whether a fit predicts enough better than one that is to be trusted more.

    A friction curve that rises from rest can follow what an effect does that the model lacks: beside one that
    falls it has to be better by enough to matter, or as good with fewer numbers.
    """
    if rises_all_along(other) or other.model.spec.falling or not trusted.model.spec.falling:
        return outdoes(other, trusted)
    error, trusted_error = left_out_error(other), left_out_error(trusted)
    if len(other.x) < len(trusted.x):
        return error < (1.0 + LEAST_GAIN) * trusted_error
    return error < (1.0 - LEAST_GAIN) * trusted_error


def _as_good(named: JointFit, complete: JointFit) -> bool:
    """Whether a model of which everything has a name is to be believed beside one with shapes that have none:
    it predicts as well, or lets nothing structured be seen with fewer numbers, and the other is not surely
    better."""
    error, least = left_out_error(named), left_out_error(complete)
    if error <= least:
        return True
    fewer = len(named.x) < len(complete.x) and error < SURELY * least
    return fewer and not any(test.depends for test in test_residual(named, DEPENDS))


def _finished(selection: Selection, recording: Recording) -> JointFit:
    """The chosen model on all trials."""
    chosen = selection.fit
    loaded = with_load(recording, chosen)
    return told_by_its_level(
        refit(chosen, JointModel.build(loaded, chosen.model.spec, chosen.model.constants))
    )


def _notes(shown: Split, recording: Recording, final: JointFit) -> list[str]:
    """Sentences on how the rows were used, and on what is of the readings."""
    notes = []
    if shown.blocks:
        notes.append(
            "there are too few trials to hold some out, so contiguous blocks of time stand in for trials: "
            "the error on them tells of other times of the same run, not of another run."
        )
    if recording.weight is not None:
        notes.append(
            "where the axis is slow, or its acceleration is least sure, the model leaves up to "
            f"{recording.weight.max() / recording.weight.min():.0f} times as much as elsewhere; those rows "
            "count that much less."
        )
    notes += filter(None, (of_the_readings(final, effect) for effect in final.model.spec.effects))
    return notes + _not_compared(shown.recording)


def _no_chance(selection: Selection) -> bool:
    """Whether an effect was turned down though it is no chance: what it can have done to the numbers of a
    model that leaves nothing structured shows nowhere else."""
    found = selection.candidates.values()
    return any(not one.accepted and one.p_value is not None and one.p_value < CHANCE for one in found)


def _turned_down(selection: Selection, hidden: Sequence[Suspect]) -> list[str]:
    """A sentence on those that were turned down in the end, the least likely to be chance first."""
    names = [one.effect.name for one in hidden if one.effect.name in selection.candidates]
    reasons = [f"{name} ({why})" for name in names if (why := selection.candidates[name].why)]
    if not reasons:
        return []
    told = "; ".join(reasons[:_MOST_TOLD])
    return [f"clearer than chance, but turned down: {told}. The intervals allow for that."]


def _not_compared(recording: Recording) -> list[str]:
    """A sentence for each experiment of which no row is compared."""
    compared = {recording.experiment[trial] for trial in np.unique(recording.motion.trial[recording.usable])}
    missing = [name for name in dict.fromkeys(recording.experiment) if name not in compared]
    return [f"no row of the experiment {name!r} could be compared with the model." for name in missing]


def _without_unnamed(selection: Selection) -> dict[Unnamed, str]:
    """Take the shapes without a name out of the model; those, and each in words."""
    fit = selection.fit
    shapes = [effect for effect in fit.model.spec.effects if isinstance(effect, Unnamed)]
    matters = WORTH * fit.model.friction_sizes[0]
    told = {shape: shape.told(fit, matters) for shape in shapes}
    if shapes:
        model, spec = selection.fit.model, selection.fit.model.spec
        for shape in shapes:
            spec = spec.without(shape.name)
        selection.fit = refit(selection.fit, JointModel.build(model.recording, spec, model.constants))
    return told


def _next_experiment(
    selection: Selection, final: JointFit, tell: Callable[[str], None]
) -> NextExperiment | None:
    """A run that tells apart what ties, or else one for a parameter that is not determined."""
    for name, rivals in selection.alternatives.items():
        tell(f"looking for a run that tells {name} from {rivals[0]}")
        if found := between_models(selection.fit, selection.rivals[name], (name, rivals[0])):
            return found
    for values in (static_parameters(final), dynamic_parameters(final)):
        for name, value in values.items():
            if not value.identified:
                tell(f"looking for a run that determines {quantity(name)}")
                if found := for_parameter(final, name):
                    return found
    return None
