"""What `diagnosis.json` and `evidence.json` hold, typed.

Unknown keys pass (a newer writer may add some), absent ones take their default, and a number that
could not be computed is null. A value of the wrong type is an error that names the key.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Struct, field

from idtool.errors import InputError
from idtool.model.motion import Array

REMEDY = "run ffc-id identify again"
DIAGNOSIS_SCHEMA = "ffc-id/diagnosis/1"

Number = float | None
T = TypeVar("T")
Verdict = Literal["adequate", "effect_found", "ambiguous", "unexplained"]


class Pair(Struct, frozen=True):
    """An error of the base model and of the extended one."""

    before: Number = None
    after: Number = None


class BeforeAfter(Struct, Generic[T], frozen=True):
    """What was found on the base model's residual and on the extended one's."""

    before: tuple[T, ...] = ()
    after: tuple[T, ...] = ()


class Found(Struct, frozen=True):
    """An accepted effect."""

    name: str
    p_value: Number = None
    percent_of_torque: Number = None
    alternatives: tuple[str, ...] = ()


class Left(Struct, frozen=True):
    """What the extended model leaves on the held-out rows, and the sensor noise, per cent of the torque."""

    percent_of_torque: Number = None
    noise_percent: Number = None


class Errors(Struct, frozen=True):
    """Prediction errors, in the unit that `metric` ends with."""

    metric: str = "rmse"
    held_out: Pair = Pair()
    training: Pair = Pair()
    by_experiment: dict[str, Pair] = {}
    noise_floor: Number = None
    blocks_stand_in_for_trials: bool = False


class SmoothCorrection(Struct, frozen=True):
    """What `correction.toml` holds: torque over one variable, and the held-out error without and with it."""

    variable: str
    held_out: Pair = Pair()


class Unexplained(Struct, frozen=True):
    """Structure that no effect accounts for."""

    share: Number = None
    depends_on: tuple[str, ...] = ()
    note: str = ""
    correction: SmoothCorrection | None = None


class Candidate(Struct, frozen=True):
    """An effect that was tried."""

    name: str
    held_out: Number = None
    p_value: Number = None
    accepted: bool = False
    why: str = ""


class NextExperiment(Struct, frozen=True):
    """The run that would tell explanations apart."""

    recipe: dict[str, Any] = {}
    separates: tuple[str, ...] = ()
    why: str = ""


class Validated(Struct, frozen=True):
    """The error of one experiment of logs that no fit saw, over all its rows."""

    rmse: Number = None
    relative_percent: Number = None
    rows: int | None = None


class Validation(Struct, frozen=True):
    """What `identify --validate` found: the logs, and the errors by experiment."""

    logs: tuple[str, ...] = ()
    errors: dict[str, Validated] = {}


class Diagnosis(Struct, frozen=True):
    """`diagnosis.json`."""

    schema: str
    verdict: Verdict
    accepted: tuple[Found, ...] = field(default=(), name="effects")
    error: Errors = Errors()
    unexplained: Unexplained | None = None
    left: Left = Left()
    candidates: tuple[Candidate, ...] = ()
    hidden: tuple[str, ...] = ()
    next_experiment: NextExperiment | None = None
    validation: Validation | None = None

    @property
    def effects(self) -> tuple[Found, ...]:
        """The effects that were found; inertia, which is among them in the file, is the base model's."""
        return tuple(effect for effect in self.accepted if effect.name != "inertia")

    @property
    def tried(self) -> tuple[Candidate, ...]:
        """The candidates besides inertia, which belongs to the base model."""
        return tuple(candidate for candidate in self.candidates if candidate.name != "inertia")

    @property
    def textbook(self) -> bool:
        """Whether no effects were looked for but those of the textbook model (`--friction coulomb`)."""
        from idtool.verbs.identify import TEXTBOOK_EFFECTS

        names = {candidate.name for candidate in self.candidates}
        return bool(names) and names <= set(TEXTBOOK_EFFECTS)


class PositionErrors(Struct, frozen=True):
    """How far the simulated position is off on the logs that were identified."""

    unit: str
    rms_1s_windows: Number = None
    rms: Number = None
    mean_abs: Number = None


class FilterFacts(Struct, frozen=True):
    """The zero-phase filter and the rate after decimation."""

    bandwidth_hz: Number = None
    rate_hz: Number = None


class LogFacts(Struct, frozen=True):
    """One log that went into the result."""

    file: str
    sha256: str = ""
    rows: int | None = None
    trials: int | None = None
    experiment: str = ""
    wiring: tuple[str, ...] = ()


class StribeckPoint(Struct, frozen=True):
    """A steady friction torque at one speed; the sign of both is the direction."""

    velocity: float
    torque: float
    stderr: Number = None
    steady: bool = True


class StribeckCurve(Struct, frozen=True):
    """The fitted curve and its 95 % band; `low` and `high` may be empty."""

    velocity: tuple[Number, ...] = ()
    torque: tuple[Number, ...] = ()
    low: tuple[Number, ...] = ()
    high: tuple[Number, ...] = ()


class GravityPoint(Struct, frozen=True):
    """Gravity torque at one payload (slide) or one position (arm), friction removed."""

    torque: float
    payload_kg: Number = None
    position: Number = None
    stderr: Number = None


class StiffnessCost(Struct, frozen=True):
    """Error of the fit along the bristle stiffness, all else fitted."""

    sigma0: tuple[Number, ...] = ()
    rmse: tuple[Number, ...] = ()
    best: Number = None


class Correlation(Struct, frozen=True):
    """Correlation of the parameter estimates."""

    names: tuple[str, ...] = ()
    matrix: tuple[tuple[Number, ...], ...] = ()


class ResidualTest(Struct, frozen=True):
    """Whether the residual depends on a variable, and how much of its variance that explains."""

    variable: str
    p_value: Number = None
    share: Number = None


class CumulativePeriodogram(Struct, frozen=True):
    """Share of the residual's power below each share of the highest frequency, and that of noise."""

    over: str
    frequency: tuple[float, ...] = ()
    power: tuple[float, ...] = ()
    white: tuple[float, ...] = ()
    band: float = 0.0
    p_value: Number = None


class Facts(Struct, frozen=True):
    """`evidence.json`."""

    kind: Literal["rotary", "linear"] = "rotary"
    friction: str = "lugre"
    filter: FilterFacts | None = None
    logs: tuple[LogFacts, ...] = ()
    notes: tuple[str, ...] = ()
    stribeck_points: tuple[StribeckPoint, ...] = ()
    stribeck_curve: StribeckCurve | None = None
    gravity_points: tuple[GravityPoint, ...] = ()
    position: PositionErrors | None = None
    cost_over_sigma0: StiffnessCost | None = None
    correlation: Correlation | None = None
    residual_tests: BeforeAfter[ResidualTest] | None = None
    cumulative_periodograms: BeforeAfter[CumulativePeriodogram] | None = None
    command: str = ""
    versions: dict[str, str] = {}
    seed: int | None = None


File = TypeVar("File", Diagnosis, Facts)


def read_facts(file: Path, form: type[File]) -> File:
    """Read and check one of the two JSON files.

    Raises:
        InputError: missing, not JSON, of another schema, or a key holds the wrong type.
    """
    try:
        document = json.loads(file.read_text(encoding="utf-8"), parse_constant=lambda _: None)
    except FileNotFoundError as error:
        raise InputError("no such file", file=file, remedy=f"{REMEDY} with -o {file.parent}") from error
    except OSError as error:
        raise InputError(
            f"cannot be read ({error.strerror})", file=file, remedy="check its permissions"
        ) from error
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not JSON ({error})", file=file, remedy=REMEDY) from error
    if form is Diagnosis and isinstance(document, dict) and document.get("schema") != DIAGNOSIS_SCHEMA:
        raise InputError(
            f"schema is {document.get('schema')!r}, expected {DIAGNOSIS_SCHEMA!r}",
            file=file,
            place="schema",
            remedy=REMEDY,
        )
    try:
        return msgspec.convert(document, form)
    except msgspec.ValidationError as error:
        problem, _, place = str(error).partition(" - at `$")
        problem = problem[:1].lower() + problem[1:]
        raise InputError(problem, file=file, place=place.strip("`.") or None, remedy=REMEDY) from error


def array(values: tuple[Number, ...]) -> Array:
    """Numbers as an array; null is NaN."""
    return np.array([np.nan if value is None else value for value in values], dtype=float)
