"""`ffc-id virtual-servo` and the commands that talk to it: the real programs, two processes, one bus."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from idtool.cli.main import main

from idtool.log import Log
from idtool.parameters import Controller, Parameters
from idtool.parameters.axis import Axis
from testbench.board.files import stated

from .support import PROGRAM, ffc_id

SHORT = """
schema = "ffc-id/recipe/1"
name = "short"
experiment = "gravity"
[[trials]]
kind = "back_and_forth"
payload_kg = [0.0, 0.5]
speed_rad_s = 0.5
travel_rad = 0.6
"""
#: In slow motion: a busy computer that answers late is a fault of the bus.
BAUD, SCALE = 1_000_000, 0.5


class Servo:
    """A running `ffc-id virtual-servo`."""

    def __init__(self, folder: Path, *options: str, scale: float = SCALE) -> None:
        self.process = subprocess.Popen(
            [
                *(str(PROGRAM), "virtual-servo", "--plant", "bench", "--baud", str(BAUD)),
                *("--scale", str(scale), "--link", str(folder / "servo"), "--json", *options),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout
        said = json.loads(self.process.stdout.readline())
        self.device, self.rig = said["device"], said["rig"]

    def do(self, line: str) -> str:
        """Say what a person does; its answer."""
        assert self.process.stdin
        assert self.process.stderr
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        while (answer := self.process.stderr.readline()).startswith(("use it", "  ")):
            pass
        return answer.strip()

    def end(self) -> int:
        self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(timeout=10)
        finally:
            self.process.kill()
            self.process.communicate()


@pytest.fixture
def servo(tmp_path: Path) -> Iterator[Servo]:
    made = Servo(tmp_path)
    yield made
    made.end()


@pytest.fixture
def short(tmp_path: Path) -> Path:
    (tmp_path / "short.toml").write_text(SHORT)
    return tmp_path / "short.toml"


def test_it_says_where_it_is(servo: Servo, tmp_path: Path) -> None:
    assert servo.device.startswith("/dev/")
    assert servo.rig == f"dynamixel:{tmp_path}/servo,id=1,baud={BAUD},scale={SCALE}"
    assert Path(servo.device).samefile(tmp_path / "servo")
    assert servo.end() == 0
    assert not (tmp_path / "servo").exists()


@pytest.mark.long
def test_a_person_is_asked_for_every_payload(servo: Servo, short: Path, tmp_path: Path) -> None:
    """A rehearsal of the gravity run: what is asked for is done at the servo, then Enter."""
    log = tmp_path / "gravity.csv"
    with subprocess.Popen(
        [str(PROGRAM), "run-gravity", "--recipe", short, "--rig", servo.rig, "-o", log],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as run:
        assert run.stdin
        assert run.stderr
        assert run.stderr.readline() == (
            "trial 1 of 2: set the axis to payload 0 kg, tilt 0° and 0°, then press Enter; Ctrl-C ends\n"
        )
        run.stdin.write("\n")
        run.stdin.flush()
        assert run.stderr.readline() == (
            "trial 2 of 2: set the axis to payload 0.5 kg, tilt 0° and 0° (now payload 0 kg, "
            "tilt 0° and 0°), then press Enter; Ctrl-C ends\n"
        )
        assert servo.do("payload 0.5") == "payload 0.5 kg, tilt 0° and 0°"
        out, _ = run.communicate("\n", timeout=240)
    assert run.returncode == 0
    assert out.startswith(f"{log}: ")
    done = ffc_id("fit-gravity", log, "-p", tmp_path / "params.toml", "--json")
    assert done.returncode == 0, done.stderr
    gravity = Parameters.read(tmp_path / "params.toml").gravity
    assert gravity["base"].value == pytest.approx(0.20, rel=0.05)
    assert gravity["per_payload"].value == pytest.approx(0.42, rel=0.05)


def test_nobody_there_to_ask(servo: Servo, short: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [str(PROGRAM), "run-gravity", "--recipe", short, "--rig", servo.rig, "-o", tmp_path / "x.csv"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert "pass --yes if it needs no hand" in done.stderr
    assert not (tmp_path / "x.csv").exists()


@pytest.fixture
def lying(tmp_path: Path) -> Iterator[Servo]:
    """On its side it does not sink while its torque is off, so that no start is far away."""
    made = Servo(tmp_path, "--tilt-deg", "90", "0")
    yield made
    made.end()


def test_interrupted_and_resumed(lying: Servo, short: Path, tmp_path: Path) -> None:
    """SIGTERM in the second trial; --resume makes that one and leaves the first alone."""
    short.write_text(
        SHORT.replace("travel_rad = 0.6", "travel_rad = 0.2")
        + "tilt_alpha_rad = 1.5707963267948966\nrest_s = 0.1\n"
    )
    log = tmp_path / "log.csv"
    command = ["run", "--recipe", str(short), "--rig", lying.rig, "--yes", "-o", str(log)]
    with subprocess.Popen([str(PROGRAM), *command], stderr=subprocess.PIPE, text=True) as run:
        until = time.monotonic() + 120
        while not log.exists() or b"\n1," not in log.read_bytes():
            assert time.monotonic() < until
            assert run.poll() is None
            time.sleep(0.02)
        run.send_signal(signal.SIGTERM)
        _, told = run.communicate(timeout=120)
    assert run.returncode == 130
    assert "(1 of 2 trials finished)." in told
    assert shlex.split(told.splitlines()[-1]) == [
        *("next:", "ffc-id", "run", "--recipe", str(short), "--rig", lying.rig, "-o", str(log), "--yes"),
        "--resume",
    ]
    assert "torque off" in lying.do("status")
    first = Log.read(log).trials[0]
    for _ in range(3):
        done = ffc_id(*command, "--resume", "--json")
        # a machine that gives the virtual servo no core for a tenth of a second has interrupted it once more
        if "does not answer" not in done.stderr:
            break
    assert done.returncode == 0, done.stderr
    said: dict[str, Any] = json.loads(done.stdout)
    assert (said["trials"], said["resumed_trials"]) == (2, 1)
    assert Log.read(log).trials[0].equals(first)
    assert ffc_id(*command, "--resume", "--force").returncode == 2


@pytest.fixture
def slow(tmp_path: Path) -> Iterator[Servo]:
    """Upright, it would sink before the torque is on. In slow motion, so that a busy computer that runs the
    tests does not stop the controller, which takes a gap of 50 ms for a fault."""
    made = Servo(tmp_path, "--tilt", "1.5707963", "0", scale=0.25)
    yield made
    made.end()


def test_guiding_by_hand(slow: Servo, tmp_path: Path) -> None:
    Parameters(
        axis=Axis("rotary", 2.67),
        gravity_model="slide",
        gravity=stated(base=0.20, per_payload=0.42),
        static=stated(coulomb=0.080, static=0.115, stribeck_velocity=0.08, viscous=0.12),
        dynamic=stated(bristle_stiffness=8.0, bristle_damping=0.2),
        controller=Controller(2.05, 1.68, 0.01),
    ).write(tmp_path / "params.toml")
    log = tmp_path / "run.csv"
    command = ["teach", "-p", tmp_path / "params.toml", "--rig", slow.rig, "-o", log, "--json"]
    command += ["--tilt", "1.5707963", "0", "--payload", "0", "--button", "none"]
    with subprocess.Popen(
        [str(PROGRAM), *map(str, command)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as run:
        until = time.monotonic() + 120
        while not log.exists() or log.read_bytes().count(b"\n") < 80:
            assert time.monotonic() < until
            assert run.poll() is None, run.communicate()[1]
            time.sleep(0.02)
        slow.do("hand 0.3")
        time.sleep(1.5)
        slow.do("hand 0")
        run.send_signal(signal.SIGINT)
        out, told = run.communicate(timeout=120)
    assert run.returncode == 0, told
    assert json.loads(out)["interrupted"] is True
    position = Log.read(log).frame["position_rad"]
    assert position.iloc[-1] - position.iloc[0] > 0.1


@pytest.mark.parametrize("word", ["unplugged@1", "silent@1"])
def test_a_fault_of_the_device_is_one_sentence(short: Path, tmp_path: Path, word: str) -> None:
    servo = Servo(tmp_path, "--fault", word)
    try:
        done = ffc_id(*("run", "--recipe", short, "--rig", servo.rig, "--yes", "-o", tmp_path / "log.csv"))
        assert (done.returncode, done.stdout) == (4, "")
        assert done.stderr.count("\n") == 1
        assert "Traceback" not in done.stderr
        assert ("has disappeared" if word.startswith("unplugged") else "does not answer") in done.stderr
    finally:
        servo.end()


def test_what_it_does_not_understand(servo: Servo) -> None:
    assert servo.do("paylod 1") == 'no command "paylod"; did you mean "payload"?'
    assert servo.do("payload").startswith("payload takes 1 number")
    assert servo.do("payload nan").startswith("payload takes 1 number")
    assert servo.do("payload 1e300").startswith("a payload is 0 to 10000 kg, not 1e+300 kg; ")
    assert servo.do("payload -1").startswith("a payload is 0 to 10000 kg, not -1 kg; ")
    assert servo.do("hand -1e300").startswith("no hand pushes with -1e+300 N m; ")
    assert servo.do("tilt-deg 90 0") == servo.do("tilt 1.5707963 0") == "payload 0 kg, tilt 90° and 0°"
    assert servo.do("tilt-deg 0 0") == "payload 0 kg, tilt 0° and 0°"
    assert servo.do("fault lost=0.5") == "as you wish"
    assert "torque off, faults so far: none" in servo.do("status")


@pytest.mark.parametrize(
    ("options", "code", "expected"),
    [
        (["--tilt", "1", "0", "--tilt-deg", "60", "0"], 2, "--tilt and --tilt-deg say the same in two units"),
        (["--plant", "papr"], 2, 'did you mean "paper"'),
        (["--fault", "silent"], 3, "silent@SECONDS"),
        (["--baud", "12"], 3, "no baud rate 12"),
        (["--payload", "1e300"], 3, "a payload is 0 to 10000 kg, not 1e+300 kg"),
        (["--link", "/proc/servo"], 3, "/proc/servo: cannot be written"),
    ],
)
def test_refusals(options: list[str], code: int, expected: str) -> None:
    done = ffc_id("virtual-servo", *options)
    assert (done.returncode, done.stdout) == (code, "")
    assert expected in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.fixture
def scan(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Any]:
    """`ffc-id rigs --scan DEVICE --json` in this process, at one baud rate (six take six seconds)."""
    monkeypatch.setattr("idtool.rig.dynamixel.bus.BAUD_RATES", (BAUD,))
    monkeypatch.setattr("idtool.rig.feetech.bus.BAUD_RATES", (BAUD,))
    monkeypatch.setattr("idtool.rig.scanners.IDS", range(1, 2))

    def run(device: str) -> tuple[int, Any, str]:
        with pytest.raises(SystemExit) as stop:
            main(["rigs", "--scan", device, "--json"])
        printed = capsys.readouterr()
        return int(stop.value.code or 0), json.loads(printed.out)["servos"], printed.err

    return run


def test_a_servo_is_found(servo: Servo, scan: Callable[..., Any]) -> None:
    found = {"device": servo.device, "baud": BAUD, "id": 1, "model_number": 1150, "model": "XH540-V150"}
    rig = f"dynamixel:{servo.device},id=1,baud={BAUD}"
    assert scan(servo.device) == (0, [{"rig": rig} | found], "")


def test_scanning_what_is_no_servo(tmp_path: Path, scan: Callable[..., Any]) -> None:
    near, far = os.openpty()
    device = os.ttyname(far)
    try:
        code, found, told = scan(device)
    finally:
        os.close(near)
        os.close(far)
    assert (code, found) == (4, [])
    assert f"no servo answered on {device}; check its power" in told
    code, found, told = scan(str(tmp_path / "none"))
    assert (code, found) == (4, [])
    assert "there is no such device" in told
