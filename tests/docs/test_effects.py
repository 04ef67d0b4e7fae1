"""Every effect has its page, and the page says what the library knows."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.export.mujoco import _carries
from idtool.io.toml import parse_toml
from idtool.model.units import file_key
from idtool.parameters import EffectEntry, Parameter
from idtool.rig.plant_file import EFFECT_KEYS, parse_plant
from pages.effect_cases import CASES
from pages.effects import MUJOCO, NOT_GUIDED, PLANT, pages, plant_of, recipe_of
from pages.markdown import fences, with_made

from .support import PROJECT

FOLDER = PROJECT / "docs" / "effects"
EFFECT = pytest.mark.parametrize("name", registry.names())
PROSE = ("## What else looks like it", "## What to do about it")


def text_of(name: str) -> str:
    return (FOLDER / f"{name}.md").read_text(encoding="utf-8")


def test_the_pages_are_up_to_date(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(PROJECT)
    stale = [page.name for page, wanted in pages().items() if page.read_text(encoding="utf-8") != wanted]
    assert stale == [], "run `make docs-effects` (or python -m pages.effects --text)"


@EFFECT
def test_every_effect_has_its_page_and_picture(name: str) -> None:
    effect, text = registry.get(name), text_of(name)
    assert text.startswith(f"# {effect.title}\n")
    assert effect.formula in text
    assert effect.citation in text
    for parameter in effect.parameters:
        assert f"`{file_key(parameter.name, parameter.dimension, 'rotary')}`" in text
    picture = (PROJECT / "data" / "effects" / f"{name}.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) < 40_000


@EFFECT
def test_every_page_is_written_by_a_person_too(name: str) -> None:
    text = re.sub(r"<!-- (\w+): made.*?<!-- end of \1 -->", "", text_of(name), flags=re.DOTALL)
    for heading in PROSE:
        _, found, section = text.partition(heading)
        assert found, heading
        assert len(section.split("\n## ")[0].split()) > 10, heading


@EFFECT
def test_every_page_tells_it_from_its_look_alikes(name: str) -> None:
    section = text_of(name).partition(PROSE[0])[2].partition("\n## ")[0]
    for other in registry.get(name).look_alikes:
        assert f"`{other}`" in section, other


@EFFECT
def test_the_session_of_a_page_can_be_run(name: str) -> None:
    """Plant and recipe stand on the page as they were used."""
    plant = parse_plant(parse_toml((PROJECT / PLANT).read_text() + plant_of(name)), Path("plant.toml"))
    assert list(plant.effects) == [name]
    blocks = [fence.text for fence in fences(FOLDER / f"{name}.md") if fence.language == "toml"]
    assert blocks == [block for block in (plant_of(name), recipe_of(name)) if block]


@EFFECT
def test_what_the_page_says_of_c_and_of_mujoco_is_so(name: str) -> None:
    effect = registry.get(name)
    assert (type(effect).in_c is Effect.in_c) == (name in NOT_GUIDED)
    entry = EffectEntry(name, {parameter.name: Parameter(1.0) for parameter in effect.parameters})
    carried, _ = _carries(entry)
    assert (carried is not None and carried.name == name) == (name in MUJOCO)


def test_every_effect_has_a_case_with_keys_of_the_plant_file() -> None:
    assert set(CASES) == set(registry.names()) == set(EFFECT_KEYS)
    for name, case in CASES.items():
        assert set(case.numbers) <= set(EFFECT_KEYS[name])


def test_the_diagnosis_names_every_effect_in_the_session_of_its_page() -> None:
    """As recorded when the pictures were made; tests/diagnosis runs such sessions anew."""
    sessions = json.loads((FOLDER / "sessions.json").read_text())
    assert set(sessions) == set(registry.names())
    for name, session in sessions.items():
        # inertia is of the base model, and no finding
        named = (*session["effects"], *session["alternatives"])
        assert name in named if name != "inertia" else named == ()
        assert session["after_mnm"] < session["before_mnm"], name


def test_what_is_made_goes_between_its_markers_only() -> None:
    page = "a\n<!-- facts: made by `make docs-effects` -->\nold\n<!-- end of facts -->\nb\n"
    assert with_made(page, "facts", "new\n") == page.replace("old", "new")
    with pytest.raises(ValueError, match="no markers"):
        with_made(page, "picture", "new\n")
