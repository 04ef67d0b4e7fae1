"""A session that lacks one thing: what `check` says of it before a fit, and what the fits say and flag."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import pytest

from idtool import Log, Parameters, identify
from idtool.verbs.check import check
from idtool.verbs.identification import Identification

from .support import GRAVITY, SINE, SWEEP, changed, document, ffc_id, plant, record

Build = Callable[[Path], dict[str, Log]]

#: What no fit may call found where it is not; the bench's own numbers, known to this test only.
TRUTH = {
    "gravity.base": 0.20,
    "gravity.per_payload": 0.42,
    "static.coulomb": 0.080,
    "static.static": 0.115,
    "static.stribeck_velocity": 0.08,
    "static.viscous": 0.12,
    "dynamic.bristle_damping": 0.2,
}


@dataclass(frozen=True)
class Row:
    """One session.

    Attributes:
        build: makes its logs, by experiment.
        codes: everything that it lacks.
        lost: parameters that must not be reported as found; all others of `identify` must.
        says: part of the sentence.
        advice: part of what to do about it.
        fits: the single fits that must repeat it.
    """

    build: Build
    codes: frozenset[str] = frozenset()
    lost: frozenset[str] = frozenset()
    says: str = ""
    advice: str = ""
    fits: tuple[str, ...] = ()


@cache
def on_the_bench(text: str, seed: int) -> Log:
    """A recipe's log; sessions share it, and nobody changes it in place."""
    with tempfile.TemporaryDirectory() as folder:
        return record(text, Path(folder) / "log.csv", seed=seed)


def session(sweep: str = SWEEP, sine: str = SINE, gravity: str = GRAVITY, **keys: object) -> Build:
    """All three experiments, on the bench or (with keys of its plant file) on an axis like it."""

    def build(folder: Path) -> dict[str, Log]:
        rig = plant(folder, **keys) if keys else None
        recipes = {"gravity": gravity, "sweep": sweep, "sine": sine}
        return {
            name: record(text, folder / f"{name}.csv", rig, seed) if rig else on_the_bench(text, seed)
            for seed, (name, text) in enumerate(recipes.items())
            if text
        }

    return build


def one_way(build: Build) -> Build:
    """Only the stretches on which the axis was told to move forward, each a trial."""

    def forward(folder: Path) -> dict[str, Log]:
        logs = build(folder)
        for name, log in logs.items():
            ahead = log.frame["velocity_command_rad_s"] > 0
            trial = (ahead != ahead.shift()).cumsum()
            logs[name] = replace(log, rows=log.frame.assign(trial=trial)[ahead].reset_index(drop=True))
        return logs

    return forward


def clipped(build: Build, at: float) -> Build:
    """The current probe of the sweep ends at `at` amperes."""

    def clip(folder: Path) -> dict[str, Log]:
        logs = build(folder)
        frame = logs["sweep"].frame
        return logs | {
            "sweep": replace(logs["sweep"], rows=frame.assign(current_a=frame["current_a"].clip(-at, at)))
        }

    return clip


FAST = changed(SWEEP, speed_rad_s=[0.6, 0.7, 0.8, 0.9, 1.0], travel_rad=2.0)
STRIBECK = frozenset({"static.static", "static.stribeck_velocity"})
BRISTLE = frozenset({"dynamic.bristle_stiffness", "dynamic.bristle_damping"})
ROWS = {
    "complete": Row(session(), fits=("gravity", "static", "dynamic")),
    "no low speeds": Row(
        session(FAST, sine=""),
        frozenset({"no_low_speeds"}),
        STRIBECK,
        "no low speeds",
        "run slower ones (`ffc-id run-sweep --rig SPEC --speeds 0.0",
        ("static",),
    ),
    "one payload": Row(
        session(gravity=changed(GRAVITY, payload_kg=0.0, speed_rad_s=[0.1, 0.2])),
        frozenset({"one_payload"}),
        frozenset({"gravity.per_payload"}),
        "one payload only (0 kg): gravity per payload is not determined",
        "two payloads or more (`ffc-id run-gravity",
        ("gravity",),
    ),
    "one payload, not an empty slide": Row(
        session(gravity=changed(GRAVITY, payload_kg=0.5, speed_rad_s=[0.1, 0.2])),
        frozenset({"one_payload"}),
        frozenset({"gravity.per_payload", "gravity.base"}),
        "one payload only (0.5 kg)",
        "two payloads or more (`ffc-id run-gravity",
        ("gravity",),
    ),
    "short presliding": Row(
        session(bristle_stiffness_nm_per_rad=80.0, sensors='"dynamixel"'),
        frozenset({"short_presliding"}),
        BRISTLE,
        "steps of the position reading, so the data give sigma0 a lower bound only",
        "a finer encoder",
        ("dynamic",),
    ),
    "soft bristle": Row(
        session(bristle_stiffness_nm_per_rad=0.3),
        frozenset({"unsteady_windows"}),
        frozenset(),
        "windows are not steady, because the bristle had not settled",
        "in one direction would be steady, if the stroke allows (`ffc-id run-sweep",
        ("static",),
    ),
    "saturated current": Row(
        clipped(session(), 0.045),
        frozenset({"saturated_current"}),
        frozenset(),
        "the current is saturated, or within its noise of that, on ",
        "move more slowly or with less payload",
        ("static",),
    ),
    "one direction, upright": Row(
        one_way(session(changed(SWEEP, tilt_alpha_rad=0.0), changed(SINE, tilt_alpha_rad=0.0))),
        frozenset({"one_direction"}),
        frozenset({"static.coulomb", "static.static", "gravity.base"}) | BRISTLE,
        "one direction only: Coulomb friction and gravity cannot be told apart",
        "move both ways",
        ("gravity", "static"),
    ),
    "one direction, on its side": Row(
        one_way(session(sine="", gravity="")),
        frozenset({"one_direction"}),
        frozenset({"static.coulomb", "static.static"}) | BRISTLE,
        "one direction only: Coulomb friction and an offset cannot be told apart",
        "move both ways",
        ("static",),
    ),
}


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A folder per row, with its logs."""
    made = {}
    for name, row in ROWS.items():
        made[name] = tmp_path_factory.mktemp("session")
        for experiment, log in row.build(made[name]).items():
            log.write(made[name] / f"{experiment}.csv", force=True)
    return made


def logs_of(folder: Path) -> list[Path]:
    return [file for name in ("gravity", "sweep", "sine") if (file := folder / f"{name}.csv").exists()]


@pytest.fixture(scope="module")
def identified(folders: dict[str, Path]) -> dict[str, Identification]:
    return {name: identify([Log.read(f) for f in logs_of(folder)]) for name, folder in folders.items()}


@pytest.mark.parametrize("name", ROWS)
def test_check_says_what_is_lacking_before_a_fit(folders: dict[str, Path], name: str) -> None:
    row = ROWS[name]
    found = check([Log.read(file) for file in logs_of(folders[name])])
    assert {one.code for one in found.findings} == row.codes
    lost = {name for one in found.findings for name in one.parameters if not name.startswith("effects")}
    assert lost == row.lost
    assert all(row.says in one.sentence and row.advice in one.sentence for one in found.findings)
    verdicts = {verdict.what: verdict for verdict in found.cannot if not verdict.what.startswith("effect")}
    assert all(verdict.run for verdict in verdicts.values())
    assert ("friction: stiction and Stribeck velocity" in verdicts) == bool(row.lost & STRIBECK)
    assert ("friction: sigma0 and sigma1" in verdicts) == bool(row.lost & BRISTLE) or not row.fits


@pytest.mark.parametrize("name", ROWS)
def test_identify_repeats_it_and_its_flags_agree(identified: dict[str, Identification], name: str) -> None:
    row, result = ROWS[name], identified[name]
    assert {one["code"] for one in result.diagnosis["findings"]} == row.codes
    if row.codes:
        assert any(row.says in note and row.advice in note for note in result.diagnosis["notes"])
    parameters = result.parameters
    flags = {
        f"{part}.{key}": parameter
        for part in ("gravity", "static", "dynamic")
        for key, parameter in getattr(parameters, part).items()
    }
    assert {key for key, parameter in flags.items() if not parameter.identified} == row.lost
    assert all(flags[key].stderr is flags[key].ci95 is None for key in row.lost if key in flags)
    for key, value in TRUTH.items():
        if key in flags and flags[key].identified:
            assert flags[key].stderr is not None
            assert abs(flags[key].value - value) < 5 * flags[key].stderr, key


@pytest.mark.parametrize("name", ROWS)
def test_the_single_fits_repeat_it(
    folders: dict[str, Path], name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    row, folder = ROWS[name], folders[name]
    params = folder / "params.toml"
    log = {"gravity": "gravity.csv", "static": "sweep.csv", "dynamic": "sine.csv"}
    needed = ["static", *row.fits] if row.fits == ("dynamic",) else row.fits
    for part in needed:
        told = document(capsys, f"fit-{part}", folder / log[part], "-p", params)
        expected = row.codes if part in row.fits else frozenset()
        assert {one["code"] for one in told["findings"]} == expected
        if expected:
            assert any(row.says in note and row.advice in note for note in told["notes"])
        written = getattr(Parameters.read(params), part)
        lost = {f"{part}.{key}" for key, parameter in written.items() if not parameter.identified}
        assert lost == {key for key in row.lost if key.startswith(part)}


def test_check_determines_nothing_where_nothing_can_be_fitted(tmp_path: Path) -> None:
    log = record(SINE, tmp_path / "sine.csv")
    found = check([replace(log, rows=log.frame.iloc[:60])])
    assert [one.code for one in found.findings] == ["no_fit"]
    assert found.can == []
    assert any(one.what == "inertia" for one in found.cannot)


def test_check_leaves_to_identify_what_a_missing_effect_hides(tmp_path: Path) -> None:
    ripple = 'name = "position_ripple"\ncycles_per_turn = 9.0\namplitude_1_nm = 0.1\nphase_1_rad = 0.3\n'
    rig = plant(tmp_path)
    file = Path(rig.removeprefix("sim:"))
    file.write_text(f"{file.read_text()}\n[[effects]]\n{ripple}")
    logs = [record(text, tmp_path / f"{k}.csv", rig, k) for k, text in enumerate((GRAVITY, SWEEP, SINE))]
    found = check(logs)
    parameters = identify(logs).parameters
    known = {
        "friction: Coulomb and viscous": [parameters.static[name] for name in ("coulomb", "viscous")],
        "friction: sigma0 and sigma1": list(parameters.dynamic.values()),
    }
    assert {one.what for one in found.open} & set(known)
    hopeless = {one.what for one in found.cannot}
    for what, of_it in known.items():
        assert what not in hopeless or not all(parameter.known for parameter in of_it)


def test_check_prints_it_for_a_person(folders: dict[str, Path], capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = ffc_id(capsys, "check", *logs_of(folders["no low speeds"]))
    assert code == 0
    assert "what they lack\n  no low speeds (the slowest constant speed is 0.2 rad/s)" in out
    assert "what they lack" not in ffc_id(capsys, "check", *logs_of(folders["complete"]))[1]


def test_the_advice_is_a_command_that_helps(
    folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = {"no low speeds": "sim:bench", "soft bristle": ""}
    for name, rig in rows.items():
        logs = logs_of(folders[name])
        found = check([Log.read(file) for file in logs]).findings[0]
        words = found.run.split()
        assert words[:2] == ["ffc-id", "run-sweep"]
        where = tmp_path / words[-1]
        spec = rig or f"sim:{next(folders[name].glob('plant*.toml'))}"
        code, _, err = ffc_id(capsys, *words[1:-1], where, "--rig", spec, "-q")
        assert code == 0, err
        after = check([Log.read(where)] if name == "soft bristle" else [Log.read(f) for f in [*logs, where]])
        assert found.code not in {one.code for one in after.findings}


def test_an_axis_a_thousand_times_smaller_has_the_same_flags(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An inertia of 8e-6 kg m2 is none at its bound."""
    found = []
    for factor in (1.0, 1e-3):
        sweep, sine, params = (tmp_path / f"{name}{factor}" for name in ("sweep.csv", "sine.csv", "p.toml"))
        for recipe, file in ((SWEEP, sweep), (SINE, sine)):
            log = record(recipe, tmp_path / "whole.csv")
            replace(log, rows=log.frame.assign(current_a=log.frame["current_a"] * factor)).write(file)
            (tmp_path / "whole.csv").unlink()
        document(capsys, "fit-static", sweep, "-p", params)
        document(capsys, "fit-dynamic", sine, "-p", params)
        found.append(Parameters.read(params))
    whole, small = (p.effects[0].parameters["inertia"] for p in found)
    assert whole.known
    assert small.known
    assert small.value == pytest.approx(1e-3 * whole.value, rel=1e-3)
    assert small.stderr == pytest.approx(1e-3 * (whole.stderr or 0.0), rel=1e-2)


def test_a_parameter_at_its_bound_is_never_reported_as_found(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bristle too stiff for the encoder runs to the end of its range."""
    rig = plant(tmp_path, bristle_stiffness_nm_per_rad=1000.0, sensors='"dynamixel"')
    sweep, sine, params = (tmp_path / name for name in ("sweep.csv", "sine.csv", "params.toml"))
    record(SWEEP, sweep, rig)
    record(SINE, sine, rig)
    document(capsys, "fit-static", sweep, "-p", params)
    told = document(capsys, "fit-dynamic", sine, "-p", params)
    stiffness = Parameters.read(params).dynamic["bristle_stiffness"]
    assert stiffness.at_bound
    assert not stiffness.identified
    assert stiffness.ci95 is None
    assert stiffness.at_least is not None
    assert 10.0 < stiffness.at_least < 1000.0
    assert "at_bound" in {one["code"] for one in told["findings"]}
    assert any(
        "bristle stiffness sits at the bound of its range and is not found" in n for n in told["notes"]
    )
    monkeypatch.setenv("COLUMNS", "120")
    out = ffc_id(capsys, "fit-dynamic", sine, "-p", params)[1]
    row = next(line for line in out.splitlines() if line.startswith("bristle stiffness"))
    assert f"at least {stiffness.at_least:.2g}" in row
    assert "at its bound: not found" in row
    result = identify([Log.read(sweep), Log.read(sine)])
    assert result.fit.model.spec.friction == "stribeck"
    assert "short_presliding" in {one["code"] for one in result.diagnosis["findings"]}
    assert any("lower bound only" in note for note in result.diagnosis["notes"])
    assert all(p.at_bound and not p.identified for p in result.parameters.dynamic.values())


def test_what_cannot_be_told_from_a_number_at_its_bound_is_not_found(measured: Path) -> None:
    """At one speed viscous friction ends at 0, and the bristle's damping took its 0.11 for certain."""
    log = Log.read(measured.parent / "sessions/clean/sweep.csv.gz")
    trial = log.frame["trial"].unique()[3]
    result = identify([replace(log, rows=log.frame[log.frame["trial"] == trial].reset_index(drop=True))])
    assert result.parameters.static["viscous"].at_bound
    assert not result.parameters.dynamic["bristle_damping"].identified
    assert result.parameters.effects[0].parameters["inertia"].identified
    assert any("cannot be told from viscous, which is not found" in note for note in result.notes)
