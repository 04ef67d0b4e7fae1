"""Recipes: the bundled ones, and one sentence for each way to get one wrong."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from idtool.errors import InputError
from idtool.experiment.recipe import parse_recipe, read_recipe, recipe_names, recipe_text
from idtool.experiment.trajectory import BackAndForth, Sines

HEAD = 'schema = "ffc-id/recipe/1"\nname = "mine"\nexperiment = "sweep"\n'
WAY = '[[trials]]\nkind = "back_and_forth"\nspeed_rad_s = 0.2\ntravel_rad = 1.0\n'
SINE = '[[trials]]\nkind = "sine"\nfrequency_hz = 0.5\namplitude_rad_s = 0.3\nduration_s = 4\n'
SINES = SINE.replace('"sine"', '"multisine"').replace("frequency_hz = 0.5", "frequencies_hz = [0.5]")


def test_bundled_ones_are_the_published_experiments() -> None:
    assert list(recipe_names()) == ["gravity", "pauses", "sine", "sweep", "validation"]
    assert all(recipe_names().values())
    gravity = read_recipe("gravity")
    assert [trial.setup.payload_kg for trial in gravity.trials] == [i / 10 for i in range(16)]
    assert {trial.setup.tilt_alpha_rad for trial in gravity.trials} == {0.0}
    sweep = read_recipe("sweep")
    ways = [trial.motion for trial in sweep.trials]
    assert all(isinstance(way, BackAndForth) for way in ways)
    assert [way.speed for way in ways if isinstance(way, BackAndForth)] == [
        0.098, 0.147, 0.195, 0.244, 0.293, 0.341, 0.39,
    ]  # fmt: skip
    assert sweep.duration_s / sweep.period_s < 45_000
    sine = read_recipe("sine")
    assert [t.motion.highest_frequency_hz for t in sine.trials] == [0.1, 0.2, 0.5, 1.0]
    assert sine.duration_s / sine.period_s == 11_400
    assert {t.setup.tilt_alpha_rad for t in (*sweep.trials, *sine.trials)} == {math.pi / 2}
    assert [t.setup.payload_kg for t in read_recipe("validation").trials] == [0.0, 0.4, 1.0]


def test_a_bundled_one_copied_is_the_same(tmp_path: Path) -> None:
    for name in recipe_names():
        file = tmp_path / f"{name}-copy.toml"
        file.write_text(recipe_text(name))
        assert read_recipe(str(file)).trials == read_recipe(name).trials


def test_a_folder_of_that_name_does_not_hide_a_bundled_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sweep").mkdir()
    assert read_recipe("sweep").experiment == "sweep"


def test_lists_setup_and_defaults() -> None:
    text = HEAD + "[setup]\npayload_kg = 0.5\nrest_s = 2\n" + WAY.replace("0.2", "[0.1, 0.2]") + SINE
    recipe = parse_recipe(text, "mine.toml")
    assert recipe.period_s == 0.005
    assert [trial.setup.payload_kg for trial in recipe.trials] == [0.5] * 3
    assert recipe.trials[1].motion == BackAndForth(0.2, 1.0, 2.0)
    assert recipe.trials[2].motion == Sines((0.5,), 0.3, 4.0)
    assert recipe.trials[2].setup.temperature_degc is None
    over = parse_recipe(text + "payload_kg = 0.7\ntemperature_degc = 40\n", "mine.toml")
    assert (over.trials[2].setup.payload_kg, over.trials[2].setup.temperature_degc) == (0.7, 40.0)


def test_a_linear_axis_has_metres() -> None:
    linear = HEAD + 'axis = "linear"\n' + WAY.replace("_rad", "_m")
    assert parse_recipe(linear, "mine.toml").kind == "linear"
    with pytest.raises(InputError, match=r'speed_rad_s: unknown key; did you mean "speed_m_s"'):
        parse_recipe(HEAD + 'axis = "linear"\n' + WAY, "mine.toml")


BAD = [
    ("", "schema: is missing"),
    ("a = ", "is not TOML ("),
    (f"a = {'9' * 5000}", "is not TOML ("),
    (HEAD.replace("/1", "/9") + WAY, "schema: unknown schema 'ffc-id/recipe/9'; expected"),
    (HEAD.replace("name", "nam") + WAY, 'nam: unknown key; did you mean "name"'),
    (HEAD.replace('"mine"', "3") + WAY, "name: expected a short text, found 3"),
    (HEAD.replace('"mine"', '"a\\nb"') + WAY, "name: expected a short text"),
    (HEAD.replace('experiment = "sweep"', "") + WAY, "experiment: is missing"),
    (HEAD, "trials: has no trials; add a [[trials]] table"),
    (HEAD + "trials = 3", "trials: has no trials"),
    (HEAD + "trials = [3]", "trials[0]: expected a table"),
    (HEAD + "setup = 3\n" + WAY, "setup: expected a table"),
    (HEAD + 'axis = "rotory"\n' + WAY, 'axis: unknown kind of axis \'rotory\'; did you mean "rotary"'),
    (HEAD + "axis = []\n" + WAY, "axis: unknown kind of axis []"),
    (HEAD + "period_s = 0\n" + WAY, "period_s: expected a number from 0.001 to 0.1, found 0"),
    (HEAD + "[setup]\npayload = 1\n" + WAY, 'setup.payload: unknown key; did you mean "payload_kg"'),
    (HEAD + WAY.replace("back_and_forth", "back_and_fort"), 'did you mean "back_and_forth"'),
    (HEAD + WAY.replace('"back_and_forth"', "{a = 1}"), "trials[0].kind: unknown kind of motion"),
    (HEAD + WAY.replace('kind = "back_and_forth"', ""), "trials[0].kind: is missing"),
    (HEAD + WAY.replace("speed_rad_s", "speed"), 'speed: unknown key; did you mean "speed_rad_s"'),
    (HEAD + WAY.replace("speed_rad_s = 0.2", ""), "trials[0].speed_rad_s: is missing; add speed_rad_s"),
    (HEAD + WAY.replace("0.2", "nan"), "speed_rad_s: expected a number from 1e-06 to 10000, found nan"),
    (HEAD + WAY.replace("0.2", "-0.2"), "speed_rad_s: expected a number"),
    (HEAD + WAY.replace("0.2", "true"), "found True"),
    (HEAD + WAY.replace("0.2", '"fast"'), "found 'fast'"),
    (HEAD + WAY.replace("0.2", "1" + "0" * 400), "speed_rad_s: expected a number"),
    (HEAD + WAY.replace("0.2", "[]"), "an empty list makes no trial"),
    (HEAD + WAY.replace("0.2", "[0.1, 0.2]").replace("1.0", "[1.0]"), "(speed_rad_s 2, travel_rad 1)"),
    (HEAD + WAY.replace("0.2", str([0.2] * 1001)), "makes over 1000 trials"),
    (HEAD + WAY * 1001, "makes over 1000 trials"),
    (HEAD + WAY + "repeats = 1.5", "repeats: expected a whole number, found 1.5"),
    (HEAD + WAY.replace("0.2", "1e-6"), "takes the recipe over four hours"),
    (HEAD + WAY + "repeats = 900\ndwell_s = 3600", "takes the recipe over four hours"),
    (HEAD + WAY + "rest_s = 3600\n" + (WAY + "rest_s = 3600\n") * 4, "trials[3]: takes the recipe"),
    (HEAD + WAY + "acceleration_rad_s2 = 1e-6", "lower speed_rad_s or raise acceleration_rad_s2"),
    (HEAD + WAY.replace("1.0", "0.01"), "more than the travel of 0.01"),
    (HEAD + WAY + "tilt_alpha_rad = 90", "tilt_alpha_rad: expected a number from -3.14159 to 3.14159"),
    (HEAD + SINE.replace("0.5", "60"), "frequency_hz: expected a number from 0.001 to 20, found 60"),
    (HEAD + SINE.replace("= 4", "= 1"), "duration_s: is less than one period; make it at least 2 s"),
    (HEAD + SINES.replace("[0.5]", "0.5"), "frequencies_hz: expected a list of 1 to 50 frequencies"),
    (HEAD + SINES.replace("[0.5]", "[]"), "frequencies_hz: expected a list of 1 to 50 frequencies"),
    (HEAD + SINES.replace("[0.5]", "['a']"), "frequencies_hz: expected a number"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "expected"), BAD, ids=[str(i) for i in range(len(BAD))])
def test_one_sentence_for_each_mistake(text: str, expected: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_recipe(text, "mine.toml")
    sentence = str(caught.value)
    assert sentence.startswith("mine.toml")
    assert expected in sentence
    assert ";" in sentence, "no remedy"
    assert sentence.endswith((".", "?"))
    assert "\n" not in sentence
    assert len(sentence) < 400


def test_files_that_are_none(tmp_path: Path) -> None:
    (tmp_path / "latin.toml").write_bytes(b"name = '\xff'")
    (tmp_path / "big.toml").write_bytes(b"#" * (9 << 20))
    for name, expected in (
        (str(tmp_path), "is a folder where a recipe should be; name the file in it."),
        (str(tmp_path / "no.toml"), "no such file; ffc-id recipes lists"),
        (str(tmp_path / "latin.toml"), "is not a text file; name a recipe"),
        (str(tmp_path / "big.toml"), "holds over 8 MiB, too much for a recipe"),
        ("/dev/zero", "holds over 8 MiB"),
        ("swep", 'unknown recipe "swep"; did you mean "sweep"'),
        ("zzz", "known are gravity, pauses, sine, sweep, validation."),
        ("x" * 5000, "cannot be read (File name too long)"),
        ("a\0b", "is no path of a file"),
    ):
        with pytest.raises(InputError) as caught:
            read_recipe(name)
        assert expected in str(caught.value)


@given(st.binary(max_size=200), st.integers(0, 400))
def test_a_damaged_recipe_is_read_or_refused(junk: bytes, at: int) -> None:
    good = recipe_text("sweep")
    text = good[:at] + junk.decode("latin-1") + good[at + len(junk) :]
    with suppress(InputError):
        parse_recipe(text, "mine.toml")
