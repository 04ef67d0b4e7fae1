"""`ffc-id jog`: the real program in a terminal, on a simulated axis and on a virtual servo."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from idtool.cli.main import main

from idtool.guiding.jog import STEP_RAD
from idtool.log import Log

from .support import PROGRAM, ffc_id
from .terminal import Terminal
from .test_hardware import Servo

#: Between two taps, s: longer than a key takes to repeat itself.
PAUSE_S = 0.25


@pytest.mark.parametrize("kind", ["simulated", "virtual servo"])
def test_taps_move_the_axis_and_q_ends_it(kind: str, tmp_path: Path) -> None:
    # on its side: upright it would sink to its stop while a busy computer starts the program
    servo = Servo(tmp_path, "--tilt", "1.5707963", "0") if kind == "virtual servo" else None
    try:
        rig = servo.rig if servo is not None else "sim:bench"
        command = (PROGRAM, "jog", "--rig", rig, "--json", "-o", "way.csv")
        with Terminal(command, cwd=tmp_path) as terminal:
            terminal.until(" rad")  # it has listened and says where it is
            for _ in range(4):
                terminal.send("\x1b[A")
                time.sleep(PAUSE_S)
            time.sleep(2 * PAUSE_S)
            terminal.send("q")
            assert terminal.finish() == 0, terminal.seen
    finally:
        if servo is not None:
            servo.end()
    document = json.loads(terminal.seen[terminal.seen.index("{") : terminal.seen.rindex("}") + 1])
    assert document["stopped"] is None
    assert (document["rig"], document["simulated"]) == (rig, kind == "simulated")
    # how far depends on how busy the computer is: keys that come together are held
    assert 1e3 * STEP_RAD < document["moved_mrad"] < 8e3 * STEP_RAD
    assert Log.read(tmp_path / "way.csv").experiment == "jog"


def test_without_a_terminal_it_is_refused_in_a_sentence(tmp_path: Path) -> None:
    done = ffc_id("jog", "--rig", "sim:bench", "-o", tmp_path / "way.csv")
    assert done.returncode == 3
    assert "no terminal" in done.stderr
    assert "play" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "way.csv").exists()


def test_without_a_terminal_nothing_is_asked_or_said_to_move(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("idtool.cli.guiding.Guiding.inside", lambda *_: pytest.fail("it was brought inside"))
    with pytest.raises(SystemExit) as stop:
        main(["jog", "--rig", "sim:bench", "--move-inside"])
    assert stop.value.code == 3
    assert "no terminal" in capsys.readouterr().err


def test_a_contact_without_a_model_is_a_mistake() -> None:
    done = ffc_id("jog", "--rig", "sim:bench", "--contact", "5")
    assert done.returncode == 2
    assert "parameter file" in done.stderr
