"""The rig's interface: opening, seeds, limits, plant files, and that nobody reads the truth."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import idtool
from idtool.errors import InputError, RigFault
from idtool.rig import named_rigs, open_rig
from idtool.rig.base import Rig, Trajectory, TrialSetup

from .support import play, record, rig_of, table

STIFF = {
    "name": "compliance",
    "stiffness_nm_per_rad": 60.0,
    "damping_nm_s_per_rad": 0.0,
    "load_inertia_kg_m2": 0.01,
}


def test_named_rigs_open_and_keep_their_secret() -> None:
    names = named_rigs()
    assert {"sim:paper", "sim:bench"} <= names.keys()
    for name in names:
        with open_rig(name) as rig:
            assert isinstance(rig, Rig)
            assert rig.simulated
            assert not any(character.isdigit() for character in rig.description)
            public = {key for key in vars(rig) if not key.startswith("_")}
            said = {"axis", "limits", "period_s", "description", "measures_temperature"}
            assert public - {"measures", "measures_voltage"} == said


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("sim:papr", 'did you mean "paper"'),
        ("sims:paper", 'did you mean "sim:paper"'),
        ("sim:", "unknown rig"),
        ("paper", "sim:paper"),
        ("sim:paper,sensor=lab", 'did you mean "sensors"'),
        ("sim:paper,sensors=labb", 'did you mean "lab"'),
        ("sim:paper,sensors", "not one key=value"),
        ("sim:nowhere.toml", "no such file"),
    ],
)
def test_wrong_words_get_a_remedy(spec: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        open_rig(spec)


def test_a_seed_gives_the_same_readings() -> None:
    command = 0.3 * np.sin(np.arange(200) * 0.03)
    runs = [
        play(open_rig("sim:paper", seed=seed), command, TrialSetup(start_position=0)) for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.abs(runs[0][3] - runs[2][3]).max() > 1e-3


def test_the_clock_runs_on() -> None:
    rig = rig_of()
    first = play(rig, np.full(100, 0.2), TrialSetup(start_position=0.0))
    second = play(rig, np.full(100, 0.2), TrialSetup(start_position=1.0, rest_s=2.0))
    np.testing.assert_allclose(np.diff(first[0]), rig.period_s, atol=1e-9)
    assert second[0][0] > first[0][-1] + 2.0
    assert second[1][0] == pytest.approx(1.0, abs=1e-3)


def test_samples_carry_the_command_in_force() -> None:
    rig = rig_of()
    rig.prepare(TrialSetup())
    blocks = list(rig.play(Trajectory(2 * rig.period_s, "velocity", np.arange(60, dtype=np.float64) * 1e-3)))
    assert [len(block.time_s) for block in blocks] == [50, 50, 20]
    np.testing.assert_allclose(
        np.concatenate([block.command for block in blocks]), np.repeat(np.arange(60) * 1e-3, 2)
    )
    assert blocks[0].temperature is None


def test_dynamixel_readings_stand_on_their_steps() -> None:
    rig = open_rig("sim:paper,sensors=dynamixel")
    rig.prepare(TrialSetup(start_position=0.5))
    sample = rig.step(0.5)
    for value, step in ((sample.position, 2 * np.pi / 4096), (sample.current, 2.69e-3)):
        assert value / step == pytest.approx(round(value / step), abs=1e-6)


def test_speed_is_limited() -> None:
    run = play(rig_of(), np.full(200, 9.0), TrialSetup(start_position=-2.0))
    assert run[2].max() < 2.0 * 1.05


def test_leaving_the_limits_is_a_fault_and_stops() -> None:
    rig = rig_of()
    rig.prepare(TrialSetup(start_position=2.0))
    positions: list[float] = []
    blocks = rig.play(Trajectory(rig.period_s, "velocity", np.full(1000, 0.5)))
    with pytest.raises(RigFault, match="position limits"):
        positions.extend(q for block in blocks for q in block.position)
    assert 2.5 < max(positions) <= 2.55
    rig.prepare(TrialSetup(start_position=0.0))
    assert abs(rig.step(0.0).velocity) < 1e-6


def test_position_commands_end_at_the_limit() -> None:
    rig = rig_of()
    rig.prepare(TrialSetup(start_position=2.2))
    last = [rig.step(7.0) for _ in range(600)][-1]
    assert last.position == pytest.approx(2.5, abs=2e-3)


def test_what_cannot_be_done_is_a_fault() -> None:
    rig = rig_of()
    with pytest.raises(RigFault, match="not prepared"):
        rig.step(0.0)
    with pytest.raises(RigFault, match="outside its limits"):
        rig.prepare(TrialSetup(start_position=3.0))
    with pytest.raises(RigFault, match="cannot hold"):
        rig.prepare(TrialSetup(payload_kg=50.0))
    rig.close()
    rig.close()
    rig.stop()
    with pytest.raises(RigFault, match="closed"):
        rig.prepare(TrialSetup())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"friktion": {}}, 'friktion: unknown key; did you mean "friction"'),
        ({"friction": {"coulomb_nm": -1}}, "friction.coulomb_nm: -1 is not above zero"),
        ({"friction": {"coulomb_nm": "much"}}, "friction.coulomb_nm: expected a finite number, found 'much'"),
        ({"friction": {"coulomb": 1}}, 'friction.coulomb: unknown key; did you mean "coulomb_nm"'),
        ({"sensors": "dynamixl"}, 'did you mean "dynamixel"'),
        ({"plant": {"inertia_kg_m2": True}}, "plant.inertia_kg_m2"),
        ({"gravity": {"kind": "slid"}}, 'did you mean "slide"'),
        ({"period_s": 0}, "period_s"),
        ({"period_s": 0.00512345}, "period_s"),
        ({"axis": {"kind": "linear"}}, "axis"),
        ({"limits": {"lowest_rad": 3.0}}, "limits: lowest_rad is not below"),
        ({"temperature": {"sensor": 1}}, "temperature.sensor"),
        ({"effects": [{"name": "backlsh"}]}, 'did you mean "backlash"'),
        ({"effects": [{"name": "torque_offset"}]}, "torque_offset.offset_nm: is missing"),
        ({"effects": [{"name": "transport_delay", "delay_s": 2.0}]}, "transport_delay.delay_s"),
        ({"effects": [{"name": "inertia", "inertia_kg_m2": 1, "x": 2}]}, "inertia.x: unknown key"),
        ({"effects": 3}, "effects: not a list"),
        ({"motor": {"resistance_ohm": 0}}, "motor.resistance_ohm: 0 is not above zero"),
        ({"motor": {"supply_v": "12"}}, "motor.supply_v: expected a finite number, found '12'"),
        ({"motor": {"volts": 12}}, "motor.volts: unknown key"),
        (
            {"friction": {"bristle_stiffness_nm_per_rad": -1}},
            "bristle_stiffness_nm_per_rad: -1 is below zero",
        ),
        ({"effects": [{"name": "inertia", "inertia_kg_m2": -0.1}]}, "inertia.inertia_kg_m2: -0.1 is below"),
        ({"effects": [STIFF | {"damping_nm_s_per_rad": 100.0}]}, "compliance: the spring and damper are too"),
        ({"effects": [STIFF | {"stiffness_nm_per_rad": 1e9}]}, "compliance: the spring and damper are too"),
        ({"effects": [STIFF | {"stiffness_nm_per_rad": 0.0}]}, "compliance.stiffness_nm_per_rad: 0 is not"),
        (
            {"effects": [{"name": "breakaway_dwell", "gain": 1.0, "time_constant_s": 1e-9}]},
            "breakaway_dwell.time_constant_s: 1e-09 s is too short",
        ),
    ],
)
def test_plant_files_are_read_strictly(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(tomli_w.dumps(table(**changes)))
    with pytest.raises(InputError) as caught:
        open_rig(f"sim:{file}")
    assert str(file) in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "text", ["friction = [", "a = " + "[" * 20_000, "a = " + "9" * 5000, "\udcff", "a = 1 # \0"]
)
def test_not_toml(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=r"is not TOML|is not a text file"):
        open_rig(f"sim:{file}")


def test_a_huge_file_is_no_plant_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_bytes(b"#" * (9 << 20))
    with pytest.raises(InputError, match="too much for a plant file"):
        open_rig(f"sim:{file}")


def test_an_axis_that_runs_away_is_a_fault_and_not_a_number() -> None:
    rig = rig_of({"name": "nonlinear_viscous", "quadratic_nm_s2_per_rad2": 1e6})
    rig.prepare(TrialSetup(start_position=0.0))
    with pytest.raises(RigFault, match="ran away"):
        record(rig, np.full(400, 0.4))
    rig.stop()
    with pytest.raises(RigFault, match="not prepared"):
        rig.step(0.0)
    rig.prepare(TrialSetup(start_position=0.0))
    assert np.isfinite(rig.step(0.0).position)


def test_what_was_measured_before_an_axis_ran_away_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a rig of 1 ms, whose quarter of a second is computed in five parts; the third fails."""
    rig = rig_of(period_s=0.001)
    with rig:
        rig.prepare(TrialSetup())
        run, calls = rig._run, []

        def fails(commands: Any, mode: int, hand: float) -> Any:
            calls.append(len(commands))
            if len(calls) == 3:
                raise RigFault("the simulated axis ran away")
            return run(commands, mode, hand)

        monkeypatch.setattr(rig, "_run", fails)
        blocks = rig.play(Trajectory(0.001, "velocity", np.full(400, 0.1)))
        assert len(next(blocks).time_s) == 100
        with pytest.raises(RigFault, match="ran away"):
            next(blocks)


def test_estimation_never_imports_the_rigs() -> None:
    root = Path(idtool.__file__).parent
    for folder in ("fit", "diagnosis", "effects", "model"):
        for file in (root / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom):
                    names = [node.module or "", *(f"{node.module}.{alias.name}" for alias in node.names)]
                assert not any("rig" in name.split(".") for name in names), file
