"""A page for each effect of the library: docs/effects/.

What the library knows of an effect stands between two markers and is made here; the prose around it is
written by hand, in the page itself. Pictures and what the diagnosis made of each session come from the
simulated axis of docs/effects/bench.toml with that one effect, recorded in docs/effects/sessions.json.

python -m studies.effect_pages [EFFECT...]      (make docs-effects; some minutes)
python -m studies.effect_pages --text           only the text, from sessions.json
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from idtool.diagnosis.diagnose import Diagnosis, diagnose
from idtool.effects import registry
from idtool.effects.base import Effect, EffectParameter
from idtool.experiment.recipe import parse_recipe, read_recipe
from idtool.experiment.runner import run
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.identification import begin
from idtool.log import Log
from idtool.rig.plant_file import parse_plant
from idtool.rig.simulated import SimulatedRig
from idtool.signals import record
from idtool.toml_text import parse_toml
from idtool.units import file_key, unit_text
from studies.effect_cases import CASES, Case
from studies.effect_figures import draw

FOLDER = Path("docs/effects")
PLANT = FOLDER / "bench.toml"
SESSIONS = FOLDER / "sessions.json"
BEGIN, END = "<!-- made by `make docs-effects` -->", "<!-- end of what is made -->"
#: The controller leaves it out, see `ForceFreeController`.
_NOT_GUIDED = {"external_periodic": "left out: the phase is not known once the clock starts anew"}
_MUJOCO = {
    "inertia": "`armature`",
    "nonlinear_viscous": "`damping`",
    "position_stiffness": "`stiffness`",
    "position_ripple": "`cogging`, one harmonic",
}


def plant_of(name: str) -> str:
    """The [[effects]] table of a session, as TOML."""
    numbers = "\n".join(f"{key} = {value:g}" for key, value in CASES[name].numbers.items())
    return f'[[effects]]\nname = "{name}"\n{numbers}\n'


def recipe_of(name: str) -> str:
    """The recipe of a further run, as TOML; empty if the bundled ones show the effect."""
    case = CASES[name]
    if not case.recipe:
        return ""
    return (
        f'schema = "ffc-id/recipe/1"\nname = "{case.view.experiment}"\nexperiment = "{case.view.experiment}"\n'
        f"{case.recipe.rstrip()}\n"
    )


def logs_of(name: str) -> list[Log]:
    """Record the session of an effect."""
    case = CASES[name]
    recipes = [read_recipe(recipe) for recipe in ("gravity", "sweep", "sine")]
    if case.pauses:
        recipes.append(read_recipe("pauses"))
    if case.recipe:
        recipes.append(parse_recipe(recipe_of(name), f"{case.view.experiment}.toml"))
    plant = parse_plant(parse_toml(PLANT.read_text() + plant_of(name)), PLANT)
    logs = []
    with tempfile.TemporaryDirectory() as folder, SimulatedRig(plant, seed=0) as rig:
        for recipe in recipes:
            path = Path(folder) / f"{recipe.name}.csv"
            run(recipe, rig, path)
            logs.append(Log.read(path))
    return logs


def look_into(name: str) -> dict[str, Any]:
    """Record the session of an effect, draw its picture, and say what the diagnosis made of it."""
    recording = record(logs_of(name))
    start, spec, *_ = begin(recording, "lugre", "auto")
    found = diagnose(recording, start, spec, registry.library())
    effect = registry.get(name)
    with_it = found.final
    if effect not in with_it.model.spec.effects:  # something like it was named: show what there is
        declared = dict.fromkeys((registry.get("inertia"), effect))
        with_it = diagnose(recording, start, spec, tuple(declared), given=True).final
    draw(FOLDER / f"{name}.png", effect.title, CASES[name].view, _without(with_it, effect), with_it)
    return _outcome(found, CASES[name])


def _without(fit: JointFit, effect: Effect) -> JointFit:
    """The same model without the effect, fitted to the same rows."""
    model = fit.model
    others = tuple(other for other in model.spec.effects if other.name != effect.name)
    return refit(fit, JointModel.build(model.recording, replace(model.spec, effects=others)))


def _outcome(found: Diagnosis, case: Case) -> dict[str, Any]:
    document = found.to_document()
    held = document["error"]["held_out"]
    return {
        "verdict": document["verdict"],
        "effects": [effect["name"] for effect in document["effects"]],
        "alternatives": sorted({other for e in document["effects"] for other in e["alternatives"]}),
        "before_mnm": round(1e3 * held["before"], 2),
        "after_mnm": round(1e3 * held["after"], 2),
        "noise_mnm": round(1e3 * document["error"]["noise_floor"], 2),
        "identified": {
            key: float(f"{one['value']:.3g}")
            for effect in document["effects"]
            for key, one in effect["parameters"].items()
            if key in case.numbers and effect["name"] != "inertia"
        },
    }


def made(name: str, session: dict[str, Any]) -> str:
    """What stands between the markers of an effect's page."""
    effect = registry.get(name)
    rows = "\n".join(_parameter(p) for p in effect.parameters)
    return f"""{BEGIN}
`{name}`: {effect.formula}

![Residual without the effect in the model, and with it]({name}.png)

| parameter | unit | what it is |
|---|---|---|
{rows}

| | |
|---|---|
| the run that shows it | {effect.reveals} |
| columns it needs | {_columns(effect)} |
| look-alikes | {_links(effect.look_alikes) or "none"} |
| takes the place of | {_links(effect.absorbs) or "none"} |
| in the controller | {_NOT_GUIDED.get(name, "yes")} |
| in C (`export c`) | {_in_c(effect)} |
| in MuJoCo | {_MUJOCO.get(name, "no")} |
| described in | {effect.citation} |

{_session(name, session)}
{END}
"""


def _parameter(parameter: EffectParameter) -> str:
    key = file_key(parameter.name, parameter.dimension, "rotary")
    linear = unit_text(parameter.dimension, "linear")
    unit = unit_text(parameter.dimension, "rotary") or "1"
    both = unit if not linear or linear == unit else f"{unit} ({linear})"
    return f"| `{key}` | {both} | {parameter.meaning}{' (one form of it)' if parameter.optional else ''} |"


_WORDS = {
    "load": "a load: payload, tilt, or an arm that swings",
    "load_upright": "a payload or tilt",
    "torque_constant": "current",
    "tilt_alpha": "the tilt",
}


def _columns(effect: Effect) -> str:
    return ", ".join(_WORDS[need] for need in effect.needs) or "those of every log"


def _links(names: Sequence[str]) -> str:
    return ", ".join(f"[{name}]({name}.md)" for name in names)


def _in_c(effect: Effect) -> str:
    if effect.name in _NOT_GUIDED:
        return "no"
    memory = f"yes, {effect.memory} numbers of memory" if effect.memory > 1 else "yes"
    return "yes, 1 number of memory" if effect.memory == 1 else memory


def _session(name: str, session: dict[str, Any]) -> str:
    """The session of the picture, and what came of it."""
    case = CASES[name]
    runs = ["gravity", "sweep", "sine"]
    lines = [f"ffc-id run-{run} --rig sim:plant.toml -o {run}.csv" for run in runs]
    if case.pauses:
        runs.append("pauses")
        lines.append("ffc-id run --recipe pauses --rig sim:plant.toml -o pauses.csv")
    recipe = ""
    if case.recipe:
        own = case.view.experiment
        runs.append(own)
        lines.append(f"ffc-id run --recipe {own}.toml --rig sim:plant.toml -o {own}.csv")
        recipe = f"\nand the run `{own}.toml`\n\n```toml\n{recipe_of(name)}```\n"
    lines.append(f"ffc-id identify {' '.join(f'{run}.csv' for run in runs)} -o result")
    named = ", ".join(f"`{effect}`" for effect in session["effects"]) or "no effect"
    tie = f" (tied with {', '.join(f'`{o}`' for o in session['alternatives'])})" if session["alternatives"] else ""
    values = ", ".join(
        f"`{key}` {value:g} ({case.numbers[key]:g} put in)" for key, value in session["identified"].items()
    )
    return f"""<details><summary>Try it: the session of the picture</summary>

`plant.toml` is [bench.toml](bench.toml) and

```toml
{plant_of(name)}```
{recipe}
```
{chr(10).join(lines)}
```

</details>

The diagnosis of that session says `{session["verdict"]}` and names {named}{tie}; error on held-out trials
{session["before_mnm"]:g} mN m before, {session["after_mnm"]:g} mN m after, sensor noise {session["noise_mnm"]:g} mN m{"; " + values if values else ""}."""


def with_made(page: str, block: str) -> str:
    """A page with what is made put between its markers."""
    head, _, rest = page.partition(BEGIN)
    _, _, tail = rest.partition(END + "\n")
    return head + block + tail


def index(sessions: dict[str, dict[str, Any]]) -> str:
    """The table of docs/effects/README.md, between its markers."""
    rows = []
    for effect in registry.library():
        session = sessions[effect.name]
        rows.append(
            f"| [{effect.name}]({effect.name}.md) | {effect.formula} | {', '.join(effect.follows)} "
            f"| {effect.reveals} | {session['before_mnm']:g} → {session['after_mnm']:g} |"
        )
    return "\n".join(
        [
            BEGIN,
            "| effect | what it adds | what the residual follows | what shows it | error, mN m |",
            "|---|---|---|---|---|",
            *rows,
            END,
            "",
        ]
    )


def write_text() -> None:
    """Put what is made into every page."""
    sessions = json.loads(SESSIONS.read_text())
    for name in registry.names():
        _update(FOLDER / f"{name}.md", made(name, sessions[name]), f"# {registry.get(name).title}\n\n")
    _update(FOLDER / "README.md", index(sessions), "# Effects\n\n")


def _update(page: Path, block: str, head: str) -> None:
    text = page.read_text() if page.exists() else head + BEGIN + END + "\n"
    page.write_text(with_made(text, block))


@click.command()
@click.argument("effects", nargs=-1, type=click.Choice(registry.names()), metavar="[EFFECT]...")
@click.option("--text", is_flag=True, help="Only the text, from what the sessions were.")
def main(effects: tuple[str, ...], text: bool) -> None:
    """Record the sessions, draw the pictures, and write what is made into the pages."""
    sessions = json.loads(SESSIONS.read_text()) if SESSIONS.exists() else {}
    for name in () if text else effects or registry.names():
        sessions[name] = look_into(name)
        click.echo(f"{name}: {sessions[name]['verdict']}, {', '.join(sessions[name]['effects'])}")
        SESSIONS.write_text(json.dumps({n: sessions[n] for n in registry.names() if n in sessions}, indent=1) + "\n")
    if sessions.keys() == set(registry.names()):
        write_text()


if __name__ == "__main__":
    main()
