"""One step of the force-free controller, with every effect of the library and without."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.table import Section, seconds
from benchmarks.timing import interleaved
from idtool.control import ForceFreeController
from idtool.effects import registry
from idtool.parameters import Controller, EffectEntry, Parameter, Parameters
from idtool.rig.opening import read_plant
from testbench.guided_axes.cases import file_of

_GOAL_S = 10e-6
#: A number for every parameter of every effect: small, and inside its bounds.
_NUMBERS = {
    "exponent": 1.8,
    "cycles": 24.0,
    "frequency": 0.7,
    "gap": 0.02,
    "stiffness": 5.0,
    "load_inertia": 0.001,
    "reference": 25.0,
    "half_stroke": 2.0,
    "time_constant": 300.0,
    "load_scale": 0.3,
}


def whole_library() -> tuple[EffectEntry, ...]:
    """Every effect that the tool knows, with small numbers."""
    return tuple(
        EffectEntry(
            effect.name,
            {
                p.name: Parameter(_NUMBERS.get(p.name, 0.01))
                for p in effect.parameters
                if not (effect.name == "thermal_drift" and p.name in ("warm_up", "time_constant"))
            },
        )
        for effect in registry.library()
    )


def _steps(file: Parameters, mode: str, count: int) -> None:
    controller = ForceFreeController(file, 0.01, mode=mode)
    step = controller.step
    for k in range(count):
        push = 0.06 if k > 100 else 0.0
        position = 0.004 * max(k - 100, 0)
        step(position, 0.4 if push else 0.0, 0.15 - push, 0.4, 0.1, 0.0, 26.0, 0.01 * k)
    assert controller.status.fault is None


def measure(rounds: int = 20, count: int = 500) -> Section:
    """Processor time of a step while a hand guides."""
    plant = read_plant("paper")
    files = {"base model": file_of(plant, Controller(2.05, 1.68, 0.01), effects=False)}
    base = files["base model"]
    files[f"all {len(registry.names())} effects"] = replace(base, effects=whole_library())
    tasks = {
        f"mode {mode}, {name}": (lambda file=file, mode=mode: _steps(file, mode, count))
        for mode in ("paper", "light")
        for name, file in files.items()
    }
    best = {name: time / count for name, time in interleaved(tasks, rounds).items()}
    section = Section(
        "A step of the controller",
        ["version", "time of a step"],
        notes=[
            f"`ForceFreeController.step` in Python, {count} steps of which the last {count - 100} follow a "
            "hand; construction is in the time. The arithmetic of the model is compiled, so effects cost "
            "next to nothing."
        ],
    )
    for name, time in best.items():
        section.add(name, seconds(time))
    section.below("a step of the controller", max(best.values()), _GOAL_S)
    return section
