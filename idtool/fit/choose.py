"""Which model the data can carry: gravity model, and the friction law that steps down where it must."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from idtool.effects import registry
from idtool.effects.base import FEWEST_REVERSALS
from idtool.effects.position_stiffness import HIGHEST_DEGREE, PositionStiffness
from idtool.errors import InputError
from idtool.fit.identifiability import low_speeds, no_reversal, presliding, stribeck_seen
from idtool.fit.joint import JointFit, gain_in_evidence, refit, solve
from idtool.fit.left_out import predicts_better
from idtool.fit.model import JointModel
from idtool.fit.own_swing import LEAST_STROKE, swings_by_itself
from idtool.fit.restart import rises, rises_all_along, worth_a_restart
from idtool.fit.search import search
from idtool.fit.shortcoming import Shortcoming
from idtool.fit.spec import FrictionKind, Spec
from idtool.model import gravity
from idtool.model.motion import Array
from idtool.parameters import GRAVITY_MODELS
from idtool.signals import Recording

GRAVITY_CHOICES = ("auto", "slide", "arm", "none")
#: An arm's sine and cosine must take away this share of the torque's square to be taken for gravity.
_ARM_GAIN = 0.05
#: ... and a cubic spring must not leave less than this share of what they leave.
_SPRING = 0.7
_LEAST_SPAN = 1e-3
#: Bayesian evidence for a richer friction law (Kass & Raftery 1995 call 6 "strong").
CLEAR_EVIDENCE = 6.0


def choose_gravity(recording: Recording, choice: str = "auto") -> tuple[str | None, tuple[str, ...]]:
    """The gravity model, and which of its coefficients these data can show.

    `auto` takes the slide where tilt was logged; the arm where the torque follows the sine and cosine of the
    angle, better than a spring that bends would, and beside a payload better than the slide; else the slide
    where a payload was logged; the arm where the acceleration is a pendulum's, as its weight may be any then;
    and none otherwise.

    Raises:
        InputError: the axis is an arm by `auto`, and its load changes.
    """
    motion = recording.motion
    if choice == "auto":
        if motion.gravity_factor is None and recording.axis.kind == "rotary" and _swings(recording):
            _refuse_other_loads(recording)
            choice = "arm"
        elif motion.payload is not None or motion.gravity_factor is not None:
            choice = "slide"
        else:
            choice = "arm" if swings_by_itself(recording) else "none"
    if choice == "none":
        return None, ()
    columns = gravity.columns(choice, motion)
    free = []
    for index, name in enumerate(GRAVITY_MODELS[choice]):
        column = columns[:, index]
        others = columns[:, [i for i in range(columns.shape[1]) if i < index]]
        left = (
            column - others @ np.linalg.lstsq(others, column, rcond=1e-12)[0] if others.shape[1] else column
        )
        if np.max(np.abs(column)) > 0 and np.linalg.norm(left) > _LEAST_SPAN * np.linalg.norm(column):
            free.append(name)
    return (choice, tuple(free)) if free else (None, ())


def weightless(recording: Recording, model: str | None) -> bool:
    """Whether an axis without a gravity model feels none: not where its tilt kept it away all along."""
    return model is None and recording.motion.gravity_factor is None


def _swings(recording: Recording) -> bool:
    """Whether the torque follows the sine and cosine of the angle, each payload by a size of its own."""
    motion = recording.motion
    if recording.position_resolution == 0.0 or np.ptp(motion.position) < LEAST_STROKE:
        return False
    payloads = payloads_of(recording)
    level = [np.ones(len(motion)), *payloads]
    arm = _left(recording, [*level, *_pulls(recording, level)])
    x = motion.position - motion.position.mean()
    spring = _left(recording, [*level, x, x**2, x**3])
    return _left(recording, level) - arm > _clear(recording) and spring > _SPRING * arm


def _refuse_other_loads(recording: Recording) -> None:
    """The weight of an arm is that of one payload.

    Raises:
        InputError: the torque shows that it changes.
    """
    payloads = payloads_of(recording)
    if not payloads:
        return
    level = [np.ones(len(recording.motion))]
    own = [*level, *_pulls(recording, level)]
    loaded = [*own, *payloads, *_pulls(recording, payloads)]
    if _left(recording, own) - _left(recording, loaded) > _clear(recording):
        raise other_loads(recording)


def other_loads(recording: Recording) -> InputError:
    """What is said of an arm whose payload changes."""
    return InputError(
        "it changes and this axis is an arm, of which the weight of one payload is modelled",
        file=", ".join(recording.sources),
        place="payload_kg",
        remedy="identify each payload by itself (`ffc-id import LOG -o ONE.csv --where payload_kg=...`"
        " takes its rows)",
    )


def payloads_of(recording: Recording) -> list[Array]:
    """The payload, in a list, if it changes."""
    payload = recording.motion.payload
    return [] if payload is None or np.ptp(payload) == 0.0 else [payload]


def _pulls(recording: Recording, sizes: list[Array]) -> list[Array]:
    """Sine and cosine of the angle, times each of some sizes."""
    angle = recording.motion.position
    return [size * turn for size in sizes for turn in (np.sin(angle), np.cos(angle))]


def _left(recording: Recording, columns: list[Array]) -> float:
    """What friction, mass and these columns leave of the torque's square."""
    motion, target = recording.motion, recording.filtered_torque
    plain = [np.sign(motion.velocity), motion.velocity, motion.acceleration]
    regressors = recording.filtered(np.column_stack([*plain, *columns]))
    solution = np.linalg.lstsq(regressors, target, rcond=1e-10)[0]
    return float(np.sum((target - regressors @ solution) ** 2))


def _clear(recording: Recording) -> float:
    """What sine and cosine must take away of it; a voltage is mostly back-EMF, which says nothing of them."""
    target = recording.filtered_torque
    beside = np.ones((len(target), 1))
    if recording.by_voltage:
        beside = np.column_stack([beside, recording.filtered(recording.motion.velocity)])
    left = target - beside @ np.linalg.lstsq(beside, target, rcond=1e-10)[0]
    return _ARM_GAIN * float(left @ left)


def first_fit(
    recording: Recording, spec: Spec, *, optimizer: str = "direct", seed: int = 0, evaluations: int = 120
) -> JointFit:
    """A joint fit from nothing: global search, then least squares from its best points.

    Inertia (and on an axis without gravity an offset) goes along even where `spec` lacks it: leaving
    it out bends the friction parameters. The caller takes it away again if it wants the bare model.
    """
    names = {effect.name for effect in spec.effects}
    helped = spec
    for name in ("inertia", "torque_offset"):
        effect = registry.get(name)
        if name not in names and effect.missing(recording.motion) is None:
            helped = helped.adding(effect)
    model = JointModel.build(recording, helped)
    points = search(model, optimizer=optimizer, seed=seed, evaluations=evaluations)
    fits = [solve(model, model.coordinates(point.values), most=25) for point in points]
    best = min(fits, key=lambda fit: fit.sse)
    return solve(model, best.x)


def first_fits(
    recording: Recording, spec: Spec, *, optimizer: str = "direct", seed: int = 0, evaluations: int = 120
) -> list[JointFit]:
    """First fits in the order in which to trust them: those of `bending_fits`, and before them, where the
    curve of one that leaves more than noise rises from rest, the same with a curve that may only fall, which
    takes the place of one that stands for viscous friction."""
    begin = partial(first_fit, recording, optimizer=optimizer, seed=seed, evaluations=evaluations)
    fits = bending_fits(spec, begin)
    bent = [fit for fit in fits if worth_a_restart(fit) and rises(fit)]
    falling = [begin(replace(fit.model.spec, effects=spec.effects, falling=True)) for fit in bent]
    return [*falling, *(fit for fit in fits if not _is_viscous_friction(fit))]


def _is_viscous_friction(fit: JointFit) -> bool:
    """Whether the curve of a fit that leaves more than noise rises all along beside no viscous friction: it
    is that by another name."""
    return worth_a_restart(fit) and rises_all_along(fit) and fit.at_bound["viscous"]


def bending_fits(spec: Spec, begin: Callable[[Spec], JointFit]) -> list[JointFit]:
    """Fits with a friction curve of any shape: the bristle bends over a small share of the stroke, and where
    that leaves more than noise and a softer one predicts better what it did not see, a softer one. A softer
    one that leaves noise alone needs no other.

    Args:
        spec: what to fit.
        begin: fits it from nothing.
    """
    stiff = begin(spec)
    if spec.friction != "lugre" or not worth_a_restart(stiff):
        return [stiff]
    soft = begin(replace(spec, soft=True))
    if not worth_a_restart(soft):
        return [soft]
    # one that bends farther than the stroke never slides: it is a spring, with a start that nobody knows
    far = 0.9 * stiff.model.longest_bend < soft.presliding_scale < soft.model.scales.travel
    return [stiff, soft] if far and predicts_better(soft, _with_spring(stiff)) else [stiff]


def step_down(fit: JointFit) -> tuple[JointFit, list[str], list[Shortcoming]]:
    """The same fit under the simplest friction law that the data determine; why, in sentences and as data."""
    notes: list[str] = []
    reasons: list[Shortcoming] = []
    spec = fit.model.spec
    if spec.friction == "lugre":
        short = presliding(fit)
        still = no_reversal(fit)
        seldom = fit.model.recording.motion.reversals < FEWEST_REVERSALS
        if still is not None:
            notes.append(f"{still.why}: the static curve is used instead of LuGre; {still.remedy}.")
            reasons.append(still)
            fit = _with_law(fit, "stribeck")
        elif not fit.rigid and (fit.at_bound["bristle_stiffness"] or seldom):
            simpler = _with_law(fit, "stribeck")
            few = fit.at_bound["bristle_stiffness"] and seldom
            if few or not predicts_better(fit, _with_spring(simpler)):
                notes.append(
                    "the fit bends the bristle as far as it may, or after so few starts that nothing shows "
                    "it to be presliding: the static curve is used instead of LuGre; sines with more "
                    "reversals would show it."
                )
                fit = simpler
        elif short is not None:
            simpler = _with_law(fit, "stribeck")
            if fit.rigid or gain_in_evidence(simpler, fit) < CLEAR_EVIDENCE:
                notes.append(f"{short.why}: the static curve is used instead of LuGre; {short.remedy}.")
                reasons.append(short)
                fit = simpler
            else:
                notes.append("LuGre is kept though its presliding is short: it predicts better.")
    if fit.model.spec.friction == "stribeck" and not stribeck_seen(fit):
        simpler = _with_law(fit, "coulomb")
        # the static level may be all but nothing, which no error of its logarithm tells from chance
        if gain_in_evidence(simpler, fit) < CLEAR_EVIDENCE:
            lacking = low_speeds(fit)
            assert lacking is not None  # it speaks wherever no static level is seen
            notes.append(f"{lacking.why}: Coulomb and viscous friction is used; {lacking.remedy}.")
            reasons.append(lacking)
            fit = simpler
    return fit, notes, reasons


def _with_spring(fit: JointFit) -> JointFit:
    """The fit with a cable over the stroke beside it, which a bristle that bends far can stand for."""
    spring = PositionStiffness(HIGHEST_DEGREE)
    model = fit.model
    if model.spec.gravity == "arm" or spring.missing(model.recording.motion):
        return fit
    more = JointModel.build(model.recording, model.spec.adding(spring), model.constants)
    nothing = {f"{spring.name}.{c.name}": c.null for c in spring.active(model.recording.motion)}
    return refit(fit, more, nothing)


def _with_law(fit: JointFit, law: FrictionKind) -> JointFit:
    model = JointModel.build(fit.model.recording, replace(fit.model.spec, friction=law), fit.model.constants)
    return refit(fit, model)


def with_load(recording: Recording, fit: JointFit) -> Recording:
    """The recording with the gravity torque that a fit found, for effects that depend on the load."""
    spec = fit.model.spec
    if spec.gravity is None:
        return recording
    coefficients = np.array([fit.values.get(f"gravity.{n}", 0.0) for n in GRAVITY_MODELS[spec.gravity]])
    load = gravity.columns(spec.gravity, recording.motion) @ coefficients
    upright = gravity.upright_columns(spec.gravity, recording.motion) @ coefficients
    return recording.with_load(load, upright)
