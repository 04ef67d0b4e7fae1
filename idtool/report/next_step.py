"""What to do after an identification, the same on the page and in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from idtool.diagnosis.summary import LOOKS_LIKE
from idtool.guiding.hand import travel_per_position
from idtool.parameters import Parameters
from idtool.presentation.text import change, quantity
from idtool.report.facts import Diagnosis, Facts, read_facts
from idtool.report.result_folder import CORRECTION, NEXT_RECIPE


@dataclass(frozen=True)
class Step:
    """One command and why.

    Attributes:
        reason: a sentence.
        words: the command, `ffc-id` left away.
    """

    reason: str
    words: tuple[str, ...]


def next_step(
    diagnosis: Diagnosis, facts: Facts, file: Parameters, folder: Path, logs: Sequence[str] = ()
) -> Step:
    """The one step to go on with; `file` is that of the folder, `folder` and `logs` as they stand in the
    command."""
    named = {Path(log).name: log for log in logs}
    wrong = [named.get(log.file, log.file) for log in facts.logs if log.wiring]
    if wrong:  # no other run cures a column that is wrong
        return Step("Columns of a log contradict each other: look at them first.", ("plot", wrong[0]))
    proposed = diagnosis.next_experiment
    if proposed is not None:
        reason = proposed.why or "One more run would tell what these logs leave open."
        recipe = str(folder / NEXT_RECIPE)
        return Step(reason, ("run", "--recipe", recipe, "--rig", file.rig or "SPEC", "-o", "next.csv"))
    parameters = str(folder / "params.toml")
    if diagnosis.verdict == "unexplained" and diagnosis.textbook:
        reason = "The textbook model leaves something: look for the effect that it lacks."
        given = logs or [log.file for log in facts.logs]
        return Step(reason, ("identify", *given, "-o", f"{folder}-searched"))
    if diagnosis.verdict == "unexplained":
        return _after_unexplained(diagnosis, facts, folder)
    if file.axis.effort != "torque":
        reason = "The model explains these logs, in the units of the drive: a known load tells the torque."
        return Step(reason, ("calibrate", "LOADED.csv", "--mass", "KG", "--lever", "M", "-p", parameters))
    reason = "The model explains these logs: choose how the axis is to feel in the hand."
    feel = ("tune", "-p", parameters, "--hand-force", "2")
    if travel_per_position(file) is None:
        return Step(f"{reason} Say at which lever, in metres, it pushes.", (*feel, "--lever", "M"))
    return Step(reason, feel)


def _after_unexplained(diagnosis: Diagnosis, facts: Facts, folder: Path) -> Step:
    """What is left is of use only if it comes again: a log of another day, with the correction if any."""
    predict = ("predict", "OTHER-DAY.csv", "-p", str(folder / "params.toml"))
    correction = diagnosis.unexplained and diagnosis.unexplained.correction
    shape = next((note for note in facts.notes if note.startswith(LOOKS_LIKE)), "").rstrip(".")
    what = (
        f"No effect of the library explains {shape}" if shape else "Something is left that no effect explains"
    )
    if not correction:
        reason = f"{what}: see whether it is there on another day too."
        return Step(reason, (*predict, "-o", "predicted.csv"))
    gain = change(correction.held_out.before, correction.held_out.after)
    reason = (
        f"{what}, but a smooth correction over the {quantity(correction.variable)} was found (error on "
        f"held-out trials {gain}): see whether it helps on another day too; `teach` takes it as well."
    )
    return Step(reason, (*predict, "--correction", str(folder / CORRECTION), "-o", "predicted.csv"))


def next_step_of(folder: Path, logs: Sequence[str] = ()) -> Step:
    """The step after the result in a folder.

    Raises:
        InputError: the folder's files are missing or broken.
    """
    diagnosis = read_facts(folder / "diagnosis.json", Diagnosis)
    facts, file = read_facts(folder / "evidence.json", Facts), Parameters.read(folder / "params.toml")
    return next_step(diagnosis, facts, file, folder, logs)
