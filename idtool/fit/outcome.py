"""How a fit ended, by name: for every fit, its messages and its note in the parameter file."""

from __future__ import annotations

from enum import Enum


class Outcome(Enum):
    """How a search for the least squares ended; the value is what messages and files say.

    After the results of optimistix (Rader, Lyons & Kidger 2024): a search that failed says so by name.
    """

    CONVERGED = "converged"
    AT_BOUND = "converged at a bound"
    OUT_OF_EVALUATIONS = "out of evaluations"
    STALLED = "stalled"

    @property
    def converged(self) -> bool:
        """Whether nothing more was to be gained, inside the bounds."""
        return self in (Outcome.CONVERGED, Outcome.AT_BOUND)

    @property
    def meaning(self) -> str:
        """What that says of the numbers, without a full stop."""
        return _MEANING[self]

    @property
    def advice(self) -> str:
        """What to do about it, without a full stop; empty where there is nothing to do."""
        return _ADVICE[self]

    @property
    def notes(self) -> tuple[str, ...]:
        """A sentence where the search did not converge; none where it did."""
        return () if self.converged else (f"{self.value}: {self.meaning}; {self.advice}.",)

    def at(self, *, bound: bool) -> Outcome:
        """The same, where something did or did not end at a bound."""
        return Outcome.AT_BOUND if bound and self is Outcome.CONVERGED else self


_MEANING = {
    Outcome.CONVERGED: "no step lowers the error any further",
    Outcome.AT_BOUND: "what lowers the error further lies outside the range of a parameter",
    Outcome.OUT_OF_EVALUATIONS: "the fit was still getting better when it ran out of evaluations",
    Outcome.STALLED: "no step lowered the error though the slope said that one would",
}
_FEWER = "record for longer or fit fewer parameters (a simpler law, fewer effects); trust no interval"
_ADVICE = {
    Outcome.CONVERGED: "",
    Outcome.AT_BOUND: "do not use the parameter that sits at its bound",
    Outcome.OUT_OF_EVALUATIONS: _FEWER,
    Outcome.STALLED: _FEWER,
}
