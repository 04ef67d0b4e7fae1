"""A page for each effect of the library: docs/effects/.

What the library knows of an effect stands between two markers and is made here; the prose around it is
written by hand, in the page itself. Pictures and what the diagnosis made of each session come from the
simulated axis of docs/effects/bench.toml with that one effect, recorded in docs/effects/sessions.json.

python -m pages.effects [EFFECT...]      (make docs-effects; some minutes)
python -m pages.effects --text           only the text, from sessions.json
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from idtool.diagnosis.diagnose import diagnose
from idtool.diagnosis.diagnosis import Diagnosis
from idtool.diagnosis.summary import found as found_effects
from idtool.effects import registry
from idtool.effects.base import Effect, EffectParameter
from idtool.experiment.recipe import parse_recipe, read_recipe
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.io.toml import parse_toml
from idtool.log import Log
from idtool.model.units import file_key, unit_text
from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC
from idtool.presentation.text import counted
from idtool.rig.plant_file import parse_plant
from idtool.rig.simulated import SimulatedRig
from idtool.signals import record
from idtool.verbs.base_model import base_model
from pages.effect_cases import CASES, Case
from pages.effect_figures import draw
from pages.markdown import table, with_made
from testbench.plants import recorded

FOLDER = Path("docs/effects")
#: They come with the package: the report shows them beside what was found.
PICTURES = Path("data/effects")
PLANT = FOLDER / "bench.toml"
SESSIONS = FOLDER / "sessions.json"
#: What a parameter that the fit gets wrong without the effect is called, and its key in the plant file.
_TRUTH = {
    **{name: ("friction", file_key(name, what, "rotary")) for name, what in (STATIC | DYNAMIC).items()},
    **{
        f"gravity.{name}": ("gravity", file_key(name, what, "rotary"))
        for name, what in GRAVITY_MODELS["slide"].items()
    },
    "inertia.inertia": ("plant", "inertia_kg_m2"),
}
#: Keys that no fit varies: the data set them.
_SET_BY_DATA = {"reference_degc", "half_stroke_rad"}
#: A parameter that is off by less than this share is as good as right.
_RIGHT = 0.03
#: The controller leaves it out, see `ForceFreeController`.
NOT_GUIDED = {"external_periodic": "left out: the phase is not known once the clock restarts"}
MUJOCO = {
    "inertia": "`armature` (on a slide the body's mass)",
    "nonlinear_viscous": "`damping`",
    "position_stiffness": "`stiffness`",
    "position_ripple": "`cogging`",
    "torque_offset": "a constant bias",
    "direction_asymmetry": "`damping`, and an actuator that acts one way",
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
    name = case.view.experiment
    head = f'schema = "ffc-id/recipe/1"\nname = "{name}"\nexperiment = "{name}"\n'
    return f"{head}{case.recipe.rstrip()}\n"


def logs_of(name: str) -> list[Log]:
    """Record the session of an effect."""
    case = CASES[name]
    recipes = [read_recipe(recipe) for recipe in ("gravity", "sweep", "sine")]
    if case.pauses:
        recipes.append(read_recipe("pauses"))
    if case.recipe:
        recipes.append(parse_recipe(recipe_of(name), f"{case.view.experiment}.toml"))
    plant = parse_plant(parse_toml(PLANT.read_text(encoding="utf-8") + plant_of(name)), PLANT)
    return recorded(SimulatedRig(plant, seed=0), recipes)


def look_into(name: str) -> dict[str, Any]:
    """Record the session of an effect, draw its picture, and say what the diagnosis made of it."""
    recording = record(logs_of(name))
    starts = base_model(recording, "lugre", "auto").fits
    found = diagnose(recording, starts, registry.library())
    effect = registry.get(name)
    with_it = found.final
    if effect not in with_it.model.spec.effects:  # something like it was named: show what there is
        declared = dict.fromkeys((registry.get("inertia"), effect))
        with_it = diagnose(recording, starts, tuple(declared), given=True).final
    without = _without(with_it, effect)
    draw(PICTURES / f"{name}.png", effect.title, CASES[name].view, without, with_it)
    return _outcome(found, CASES[name]) | {"hides_in": _hides_in(without)}


def _hides_in(without: JointFit) -> dict[str, int]:
    """The three parameters that the fit without the effect gets most wrong, in per cent."""
    plant = parse_toml(PLANT.read_text(encoding="utf-8"))
    off = {
        name: without.values[name] / plant[table][key] - 1.0
        for name, (table, key) in _TRUTH.items()
        if name in without.values
    }
    worst = sorted(off, key=lambda name: -abs(off[name]))[:3]
    return {name: round(100.0 * off[name]) for name in worst if abs(off[name]) > _RIGHT}


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
        "effects": [effect["name"] for effect in found_effects(document)],
        "alternatives": sorted({other for e in document["effects"] for other in e["alternatives"]}),
        "before_mnm": round(1e3 * held["before"], 2),
        "after_mnm": round(1e3 * held["after"], 2),
        "noise_mnm": round(1e3 * document["error"]["noise_floor"], 2),
        "identified": {
            key: float(f"{one['value']:.3g}")
            for effect in document["effects"]
            for key, one in effect["parameters"].items()
            if key in case.numbers.keys() - _SET_BY_DATA and effect["name"] != "inertia"
        },
    }


def picture(name: str) -> str:
    """The formula and the picture of an effect's page."""
    return f"""`{name}`: {registry.get(name).formula}

![Residual without the effect in the model, and with it](../../data/effects/{name}.png)
"""


def facts(name: str, session: dict[str, Any]) -> str:
    """What the library knows of an effect, and what became of its session."""
    effect = registry.get(name)
    rows = "\n".join(_parameter(p) for p in effect.parameters)
    return f"""| parameter | unit | what it is |
|---|---|---|
{rows}

| | |
|---|---|
| the run that shows it | {effect.reveals} |
| columns it needs | {_columns(effect)} |
| look-alikes | {_links(effect.look_alikes) or "none"} |
| takes the place of | {_links(effect.absorbs) or "none"} |
| fit, prediction | yes |
| controller | {NOT_GUIDED.get(name, "yes")} |
| C (`ffc-id export c`) | {_in_c(effect)} |
| MuJoCo (`ffc-id export mujoco`) | {MUJOCO.get(name, "no")} |
| described in | {effect.citation} |

{_session(name, session)}
"""


def _parameter(parameter: EffectParameter) -> str:
    key = file_key(parameter.name, parameter.dimension, "rotary")
    linear = unit_text(parameter.dimension, "linear")
    unit = unit_text(parameter.dimension, "rotary") or "1"
    both = unit if not linear or linear == unit else f"{unit} ({linear})"
    return (
        f"| `{key}` | {both} | {parameter.meaning}{' (in one of its forms)' if parameter.optional else ''} |"
    )


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
    if effect.name in NOT_GUIDED:
        return "no"
    return f"yes, {counted(effect.memory, 'number')} of memory" if effect.memory else "yes"


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
    return f"""<details><summary>Try it: the session of the picture</summary>

`plant.toml` is [bench.toml](bench.toml) and

```toml
{plant_of(name)}```
{recipe}
```
{chr(10).join(lines)}
```

</details>

{_outcome_text(name, session)}"""


def _outcome_text(name: str, session: dict[str, Any]) -> str:
    named = ", ".join(f"`{effect}`" for effect in session["effects"]) or "no effect"
    rivals = ", ".join(f"`{other}`" for other in session["alternatives"])
    values = ", ".join(
        f"`{key}` {value:g} ({CASES[name].numbers[key]:g} put in)"
        for key, value in session["identified"].items()
    )
    hides = ", ".join(f"{_plain(key)} {percent:+d} %" for key, percent in session["hides_in"].items())
    sentences = [
        f"In this session `ffc-id identify` says `{session['verdict']}` and names {named}"
        + (f", tied with {rivals}." if rivals else "."),
        f"Error on held-out trials: {session['before_mnm']:g} mN m before, {session['after_mnm']:g} mN m "
        f"after; sensor noise {session['noise_mnm']:g} mN m.",
    ]
    if values:
        sentences.append(f"Recovered: {values}.")
    sentences.append(
        f"Left out of the model, it hides in other parameters: {hides}."
        if hides
        else "Left out of the model, it puts no other parameter off by more than 3 %."
    )
    return "\n".join(sentences)


def _plain(parameter: str) -> str:
    return parameter.removeprefix("inertia.").replace("gravity.", "gravity ").replace("_", " ")


def index(sessions: dict[str, dict[str, Any]]) -> str:
    """The table of docs/effects/README.md."""
    rows = []
    for effect in registry.library():
        session = sessions[effect.name]
        error = f"{session['before_mnm']:.1f} to {session['after_mnm']:.1f}"
        formula, follows = effect.formula.replace("|", "\\|"), ", ".join(effect.follows)
        rows.append((f"[{effect.name}]({effect.name}.md)", formula, follows, effect.reveals, error))
    head = ("effect", "what it adds", "what the residual follows", "what shows it", "error, mN m")
    return "\n".join([*table(head, rows), ""])


def pages() -> dict[Path, str]:
    """Every page as it should be: what is made, around the prose that is there."""
    sessions = json.loads(SESSIONS.read_text(encoding="utf-8"))
    result = {}
    for name in registry.names():
        page = FOLDER / f"{name}.md"
        text = with_made(page.read_text(encoding="utf-8"), "picture", picture(name))
        result[page] = with_made(text, "facts", facts(name, sessions[name]))
    page = FOLDER / "README.md"
    result[page] = with_made(page.read_text(encoding="utf-8"), "table", index(sessions))
    return result


@click.command()
@click.argument("effects", nargs=-1, type=click.Choice(registry.names()), metavar="[EFFECT]...")
@click.option("--text", is_flag=True, help="Only the text, from what the sessions were.")
def main(effects: tuple[str, ...], text: bool) -> None:
    """Record the sessions, draw the pictures, and write what is made into the pages."""
    sessions = json.loads(SESSIONS.read_text(encoding="utf-8")) if SESSIONS.exists() else {}
    for name in () if text else effects or registry.names():
        sessions[name] = look_into(name)
        click.echo(f"{name}: {sessions[name]['verdict']}, {', '.join(sessions[name]['effects'])}")
        SESSIONS.write_text(
            json.dumps({n: sessions[n] for n in registry.names() if n in sessions}, indent=1) + "\n"
        )
    for page, content in pages().items():
        page.write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main()
