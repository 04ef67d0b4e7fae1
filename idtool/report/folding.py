"""Which figures a reader may pass over: those that were looked at and show nothing to act on."""

from __future__ import annotations

from idtool.report.evidence import Evidence
from idtool.report.residual_gallery import depends

#: Of the residual as a whole: worth a look where the diagnosis leaves something unexplained.
_WHOLE = ("residual_histogram", "residual_autocorrelation", "spectrum_time", "cumulative_periodogram")
#: Of the choice: worth a look where it was close.
_CHOICE = ("candidates", "correlation", "bristle_stiffness")
#: What is not tested itself is judged by what it moves: a payload is part of the load, and one in each trial.
_STAND_IN = {"payload": ("load", "order")}


def quiet(evidence: Evidence, name: str) -> bool:
    """Whether the figure of this name holds no finding."""
    verdict = evidence.diagnosis.verdict
    if name in _WHOLE:
        return verdict != "unexplained"
    if name in _CHOICE:
        return verdict != "ambiguous"
    if name == "spectrum_angle":
        return _independent(evidence, "position")
    if name.startswith("residual_"):
        variable = name.removeprefix("residual_")
        return any(_independent(evidence, judge) for judge in (variable, *_STAND_IN.get(variable, ())))
    return False


def _independent(evidence: Evidence, variable: str) -> bool:
    """Tested, and found to explain nothing that one could see, before or after."""
    tests = evidence.facts.residual_tests
    found = [] if tests is None else [t for t in (*tests.before, *tests.after) if t.variable == variable]
    return bool(found) and not any(depends(test) for test in found)
