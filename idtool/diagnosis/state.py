"""What a search for effects has come to: each candidate, a trial, what was selected."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from idtool.diagnosis.sliding import doubtful, outdoes
from idtool.effects.base import Effect
from idtool.fit.joint import JointFit, refit
from idtool.fit.left_out import left_out_error
from idtool.fit.model import JointModel
from idtool.signals import Recording

#: Two fits of one model whose sums of squares agree to this share are at one minimum.
_THE_SAME = 1e-6


@dataclass
class Candidate:
    """What became of an effect.

    Attributes:
        name: the effect.
        gain: share of squared error that its score promises; None where it could not be tested.
        p_value: of its score, corrected for its many starts.
        held_out: left-out error (root mean square, filtered rows) with it; None if not refitted.
        accepted: whether it is in the model.
        why: in words.
    """

    name: str
    gain: float | None = None
    p_value: float | None = None
    held_out: float | None = None
    accepted: bool = False
    why: str = ""


@dataclass(frozen=True, eq=False)
class Trial:
    """A candidate model after its joint refit."""

    effect: Effect
    fit: JointFit
    p_value: float


@dataclass(frozen=True, eq=False)
class Rival:
    """Another model that leaves nothing structured: beside it a selection is given up that comes to no more.

    Attributes:
        fit: it.
        by: factor by which it has to predict better where nothing passes any more.
    """

    fit: JointFit
    by: float = 1.0

    def is_simpler(self, fit: JointFit) -> bool:
        """Whether it has fewer numbers than a fit and predicts better."""
        return len(fit.x) > len(self.fit.x) and outdoes(self.fit, fit)

    def is_ahead(self, fit: JointFit) -> bool:
        """Whether it predicts better than a fit by enough to leave that."""
        return left_out_error(fit) > self.by * left_out_error(self.fit) and outdoes(self.fit, fit)


@dataclass
class Selection:
    """The outcome.

    Attributes:
        fit: the final model on the training trials.
        candidates: one per effect of the library.
        alternatives: accepted effect -> effects that explain the data as well.
        p_values: accepted effect -> p-value when it was accepted.
        rivals: accepted effect -> the fit with its first alternative in its place.
        searched: the last fit whose friction curve was searched for anew.
        hopeless: it was given up, since a rival has fewer numbers and predicts better, or went on from here.
        steps: the fits that it came by.
        others: those that other selections came by, which all went on from there.
        nameless: shape without a name -> mean square that it took away, which is not explained by that.
    """

    fit: JointFit
    candidates: dict[str, Candidate]
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    p_values: dict[str, float] = field(default_factory=dict)
    rivals: dict[str, JointFit] = field(default_factory=dict)
    searched: JointFit | None = None
    hopeless: bool = False
    steps: list[JointFit] = field(default_factory=list)
    others: Sequence[JointFit] = ()
    nameless: dict[str, float] = field(default_factory=dict)

    @property
    def unexplained(self) -> float:
        """Mean square above the sensor noise that nothing with a name accounts for (filtered rows)."""
        inside = {effect.name for effect in self.fit.model.spec.effects}
        taken = sum(square for name, square in self.nameless.items() if name in inside)
        return left_out_error(self.fit) ** 2 - self.fit.model.filtered_noise**2 + taken

    def step(self) -> None:
        """Note where it is; it is given up where another selection has been, with a fit as good."""
        self.steps.append(self.fit)
        self.hopeless |= any(_no_better(self.fit, other) for other in self.others)

    def copy(self) -> Selection:
        """One that may go another way from here."""
        return replace(
            self,
            candidates={name: replace(candidate) for name, candidate in self.candidates.items()},
            alternatives=dict(self.alternatives),
            p_values=dict(self.p_values),
            rivals=dict(self.rivals),
            steps=list(self.steps),
            nameless=dict(self.nameless),
        )

    def onto(self, recording: Recording) -> None:
        """Fit what was found to other rows, or to the same ones with other weights."""
        model = self.fit.model
        self.fit = refit(self.fit, JointModel.build(recording, model.spec, model.constants))
        self.rivals.clear()


def _no_better(one: JointFit, other: JointFit) -> bool:
    """Whether a search came to the model that another one was at, and to no better minimum of it."""
    if one.model.spec.friction != other.model.spec.friction or one.model.names != other.model.names:
        return False
    return one.sse > (1.0 - _THE_SAME) * other.sse and not doubtful(other, one)
