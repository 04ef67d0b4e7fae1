"""The next experiment: it decides what was ambiguous, and it stays within what the axis has shown."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w

from idtool.effects import registry
from idtool.experiment.recipe import Changes, document_of_command, parse_recipe, read_recipe, recipe_text
from idtool.experiment.runner import run
from idtool.log import Log
from idtool.rig.simulated import SimulatedRig
from idtool.verbs.identify import identify
from testbench.plants import SESSION, random_plant

OFFSET = {"torque_offset": {"offset_nm": 0.02}}
PAYLOADS = next(line for line in recipe_text("gravity").splitlines() if line.startswith("payload_kg"))
TILT = {"tilt_misalignment": {"alpha_rad": 0.05, "beta_rad": 0.0}}


#: All that is looked for beside the two that tie, once; the other way round the two alone show the same.
OTHERS = tuple(name for name in registry.names() if name not in {"inertia", *OFFSET, *TILT})


@pytest.mark.long
@pytest.mark.parametrize(("effects", "without"), [(OFFSET, ()), (TILT, OTHERS)], ids=["offset", "tilt"])
def test_ambiguous_then_run_then_decided(
    tmp_path: Path, effects: dict[str, dict[str, float]], without: tuple[str, ...]
) -> None:
    plant = replace(random_plant(np.random.default_rng(2)), effects=effects)
    logs = []
    with SimulatedRig(plant.to_file("lab"), seed=3) as rig:

        def go(recipe: str) -> None:
            log = tmp_path / f"{len(logs)}.csv"
            run(read_recipe(recipe), rig, log)
            logs.append(Log.read(log))

        for name in SESSION:
            go(name)
        undecided = identify(logs, without=without).diagnosis
        assert undecided["verdict"] == "ambiguous"
        proposed = undecided["next_experiment"]
        assert set(proposed["separates"]) == {"torque_offset", "tilt_misalignment"}
        assert "standard errors" in proposed["why"]

        recipe = tmp_path / "next.toml"
        recipe.write_text(tomli_w.dumps(proposed["recipe"]))
        shown = np.concatenate([log.frame["velocity_rad_s"] for log in logs])
        go(str(recipe))
        decided = identify(logs, without=without).diagnosis
    # nothing faster than what the axis was seen to do
    assert logs[-1].frame["velocity_rad_s"].abs().max() < 1.1 * np.abs(shown).max()
    assert decided["verdict"] == "effect_found"
    assert [effect["name"] for effect in decided["effects"]] == [*effects, "inertia"]
    assert decided["effects"][0]["alternatives"] == []
    assert decided["next_experiment"] is None


@pytest.mark.long
def test_a_run_for_a_parameter_that_is_not_determined(tmp_path: Path) -> None:
    """One payload shows nothing per payload: payload steps are proposed, made, and show it."""
    plant, short = random_plant(np.random.default_rng(5)), Changes(travel=2.6)
    logs = []
    with SimulatedRig(plant.to_file("lab"), seed=1) as rig:
        for name in ("sweep", "sine"):
            log = tmp_path / f"{name}.csv"
            run(read_recipe(name, short if name == "sweep" else None), rig, log)
            logs.append(Log.read(log))
        upright = tmp_path / "upright.toml"
        upright.write_text(recipe_text("gravity").replace(PAYLOADS, "payload_kg = [0.0, 0.0]"))
        run(read_recipe(str(upright)), rig, tmp_path / "gravity.csv")
        logs.append(Log.read(tmp_path / "gravity.csv"))
        before = identify(logs)
        proposed = before.diagnosis["next_experiment"]
        assert not before.parameters.gravity["per_payload"].identified
        assert "gravity per payload is not determined" in proposed["why"]
        recipe = tmp_path / "next.toml"
        recipe.write_text(tomli_w.dumps(proposed["recipe"]))
        run(read_recipe(str(recipe)), rig, tmp_path / "next.csv")
        logs.append(Log.read(tmp_path / "next.csv"))
    after = identify(logs)
    assert after.parameters.gravity["per_payload"].identified
    assert after.parameters.gravity["per_payload"].value == pytest.approx(plant.per_payload, rel=0.01)


@pytest.mark.parametrize(
    "command", ["ffc-id run-gravity", "ffc-id run-sweep --speeds 0.02,0.05 --travel 1.5", "ffc-id run-sine"]
)
def test_a_command_as_a_recipe(command: str) -> None:
    document = document_of_command(command, "rotary")
    made = parse_recipe(tomli_w.dumps(document), "made")
    name, *options = command.split()[1:]
    plain = read_recipe(
        name.removeprefix("run-"),
        Changes(speeds=[0.02, 0.05], travel=1.5) if options else None,
    )
    assert made.trials == plain.trials
