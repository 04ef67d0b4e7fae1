"""`identify` as a person calls it: one log or several, paths too, and progress in sight."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from threadpoolctl import threadpool_limits

from idtool.api.logs import Logs, read_logs
from idtool.api.progress import told
from idtool.api.result import Result
from idtool.effects.base import Effect
from idtool.errors import InputError
from idtool.verbs.identify import identify as run


def identify(
    logs: Logs,
    *,
    seed: int = 0,
    friction: str = "lugre",
    gravity: str = "auto",
    optimizer: str = "direct",
    effects: Sequence[Effect] = (),
    without: str | Sequence[str] = (),
    tolerance: float | None = None,
    validate: Logs = (),
    known_load: bool = False,
    weigh: str = "torque",
    torque_constant: float | None = None,
    progress: Callable[[str], None] | bool | None = None,
) -> Result:
    """Identify gravity, friction and the effects that the base model lacks.

        result = identify(["gravity.csv", "sweep.csv", "sine.csv"])
        result.parameters.write("params.toml")

    Args:
        logs: a log, a path, or several, of one axis; any experiments.
        seed: of the stochastic optimisers; the default one is deterministic.
        friction: "lugre", "stribeck" or "coulomb"; where the data cannot carry it the law steps down.
            "coulomb" is the textbook model (inertia, offset, Coulomb, viscous): no further effects are
            looked for.
        gravity: "auto", "slide", "arm" or "none".
        optimizer: "direct", "crs2", "isres" or "esch".
        effects: of your own, to compete with those of the library; this process knows them from then on.
        without: name or names of effects that are not to be considered.
        tolerance: error that is good enough, per cent of the torque (rms): once it is reached no further
            effects are looked for, and nothing that is left below it counts as unexplained.
        validate: logs of the same axis, to be predicted with the result; no fit sees them.
        known_load: find the torque constant (or torque per volt) from the load that the logs tell.
        weigh: "torque", or "position": the file is fitted to the simulated position at the end.
        torque_constant: N m/A (N/A), for logs that do not say it.
        progress: called with a sentence on what is going on; True shows them on one line, None does so in
            a notebook only, False never.

    Returns:
        The outcome: `parameters`, `diagnosis`, `effects`, `summary()`, `plot(name)`, `predict(log)`,
        `report(folder)`.

    Raises:
        InputError: an impossible argument, an effect that lacks something, or logs that cannot be used.
    """
    if torque_constant is not None and not torque_constant > 0.0:
        raise InputError(f"expected a number above 0, found {torque_constant}", argument="torque_constant")
    if tolerance is not None and not isinstance(tolerance, int | float):
        raise InputError(f"expected a number, found {tolerance!r}", argument="tolerance")
    if not isinstance(seed, int) or seed < 0:
        raise InputError(f"expected a whole number from 0 on, found {seed!r}", argument="seed")
    for effect in effects:
        if not isinstance(effect, Effect):
            raise InputError(
                f"{type(effect).__name__} is no effect",
                argument="effects",
                remedy="give effects of your own; those of the library are looked for anyway",
            )
    without = [without] if isinstance(without, str) else without
    read = read_logs(logs, torque_constant=torque_constant)
    unseen = (
        [] if validate == () else read_logs(validate, argument="validate", torque_constant=torque_constant)
    )
    # the matrices are small: threads of the linear algebra wait for each other longer than they compute, and
    # two hundred times as long where something else has the cores
    with told(progress) as tell, threadpool_limits(limits=1, user_api="blas"):
        return Result.of(
            run(
                read,
                seed=seed,
                friction=friction,
                gravity=gravity,
                optimizer=optimizer,
                effects=effects,
                without=without,
                tolerance=tolerance,
                validate=unseen,
                known_load=known_load,
                weigh=weigh,
                tell=tell,
            )
        )
