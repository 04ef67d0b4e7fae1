"""What `diagnosis.json` and `evidence.json` hold, typed.

Unknown keys pass (a newer writer may add some), absent ones take their default, and a number that
could not be computed is null. A value of the wrong type is an error that names the key.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar

import msgspec
import numpy as np

from idtool.errors import InputError
from idtool.model.motion import Array

REMEDY = "run ffc-id identify again"
DIAGNOSIS_SCHEMA = "ffc-id/diagnosis/1"

Number = float | None
Verdict = Literal["adequate", "effect_found", "ambiguous", "unexplained"]


@dataclass(frozen=True, kw_only=True)
class Pair:
    """An error of the base model and of the extended one."""

    before: Number = None
    after: Number = None


@dataclass(frozen=True, kw_only=True)
class Found:
    """An accepted effect."""

    name: str
    p_value: Number = None
    percent_of_torque: Number = None
    alternatives: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Left:
    """What the extended model leaves on the held-out rows, and the sensor noise, per cent of the torque."""

    percent_of_torque: Number = None
    noise_percent: Number = None


@dataclass(frozen=True, kw_only=True)
class Errors:
    """Prediction errors, in the unit that `metric` ends with."""

    metric: str = "rmse"
    held_out: Pair = Pair()
    training: Pair = Pair()
    by_experiment: dict[str, Pair] = field(default_factory=dict)
    noise_floor: Number = None
    blocks_stand_in_for_trials: bool = False


@dataclass(frozen=True, kw_only=True)
class SmoothCorrection:
    """What `correction.toml` holds: torque over one variable, and the held-out error without and with it."""

    variable: str
    held_out: Pair = Pair()


@dataclass(frozen=True, kw_only=True)
class Unexplained:
    """Structure that no effect accounts for."""

    share: Number = None
    depends_on: tuple[str, ...] = ()
    note: str = ""
    correction: SmoothCorrection | None = None


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """An effect that was tried."""

    name: str
    held_out: Number = None
    p_value: Number = None
    accepted: bool = False
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """The run that would tell explanations apart."""

    recipe: dict[str, Any] = field(default_factory=dict)
    separates: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Validated:
    """The error of one experiment of logs that no fit saw, over all its rows."""

    rmse: Number = None
    relative_percent: Number = None
    rows: int | None = None


@dataclass(frozen=True, kw_only=True)
class Validation:
    """What `identify --validate` found: the logs, and the errors by experiment."""

    logs: tuple[str, ...] = ()
    errors: dict[str, Validated] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """`diagnosis.json`."""

    schema: str
    verdict: Verdict
    effects: tuple[Found, ...] = ()
    error: Errors = Errors()
    unexplained: Unexplained | None = None
    left: Left = Left()
    candidates: tuple[Candidate, ...] = ()
    next_experiment: NextExperiment | None = None
    validation: Validation | None = None

    @property
    def tried(self) -> tuple[Candidate, ...]:
        """The candidates besides inertia, which belongs to the base model."""
        return tuple(candidate for candidate in self.candidates if candidate.name != "inertia")


@dataclass(frozen=True, kw_only=True)
class PositionErrors:
    """How far the simulated position is off on the logs that were identified."""

    unit: str
    rms_1s_windows: Number = None
    rms: Number = None
    mean_abs: Number = None


@dataclass(frozen=True, kw_only=True)
class FilterFacts:
    """The zero-phase filter and the rate after decimation."""

    bandwidth_hz: Number = None
    rate_hz: Number = None


@dataclass(frozen=True, kw_only=True)
class LogFacts:
    """One log that went into the result."""

    file: str
    sha256: str = ""
    rows: int | None = None
    trials: int | None = None
    experiment: str = ""
    wiring: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class StribeckPoint:
    """A steady friction torque at one speed; the sign of both is the direction."""

    velocity: float
    torque: float
    stderr: Number = None
    steady: bool = True


@dataclass(frozen=True, kw_only=True)
class StribeckCurve:
    """The fitted curve and its 95 % band; `low` and `high` may be empty."""

    velocity: tuple[Number, ...] = ()
    torque: tuple[Number, ...] = ()
    low: tuple[Number, ...] = ()
    high: tuple[Number, ...] = ()


@dataclass(frozen=True, kw_only=True)
class GravityPoint:
    """Gravity torque at one payload (slide) or one position (arm), friction removed."""

    torque: float
    payload_kg: Number = None
    position: Number = None
    stderr: Number = None


@dataclass(frozen=True, kw_only=True)
class StiffnessCost:
    """Error of the fit along the bristle stiffness, all else fitted."""

    sigma0: tuple[Number, ...] = ()
    rmse: tuple[Number, ...] = ()
    best: Number = None


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """Correlation of the parameter estimates."""

    names: tuple[str, ...] = ()
    matrix: tuple[tuple[Number, ...], ...] = ()


@dataclass(frozen=True, kw_only=True)
class ResidualTest:
    """Whether the residual depends on a variable, and how much of its variance that explains."""

    variable: str
    p_value: Number = None
    share: Number = None


@dataclass(frozen=True, kw_only=True)
class ResidualTests:
    """The tests on the base model's residual and on the extended model's."""

    before: tuple[ResidualTest, ...] = ()
    after: tuple[ResidualTest, ...] = ()


@dataclass(frozen=True, kw_only=True)
class CumulativePeriodogram:
    """Share of the residual's power below each share of the highest frequency, and that of noise."""

    over: str
    frequency: tuple[float, ...] = ()
    power: tuple[float, ...] = ()
    white: tuple[float, ...] = ()
    band: float = 0.0
    p_value: Number = None


@dataclass(frozen=True, kw_only=True)
class CumulativePeriodograms:
    """Of the base model's residual and of the extended model's."""

    before: tuple[CumulativePeriodogram, ...] = ()
    after: tuple[CumulativePeriodogram, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Facts:
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
    residual_tests: ResidualTests | None = None
    cumulative_periodograms: CumulativePeriodograms | None = None
    command: str = ""
    versions: dict[str, str] = field(default_factory=dict)
    seed: int | None = None


T = TypeVar("T", Diagnosis, Facts)


def read_facts(file: Path, form: type[T]) -> T:
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
