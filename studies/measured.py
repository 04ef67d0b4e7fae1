"""What `identify` finds on recordings of real machines, beside what their sources published.

python -m studies.measured [--folder FOLDER]        (make study-measured, into docs/measured.md)

The recordings are not shipped; the folder is `$FFC_ID_SHARED/measured`, or `shared/measured` beside the
project.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from idtool.errors import FfcIdError
from idtool.importing import import_recording
from idtool.log import Log
from idtool.model.units import unit_text
from idtool.verbs.identify import Identification, identify
from idtool.verbs.predict import predict


@dataclass(frozen=True)
class Recording:
    """One recording and what is known of it.

    Attributes:
        title, source: for the page.
        files: in the folder.
        options: of the import.
        friction: of `identify`.
        published: what to compare with, as rows (name, published, how to read it off the result).
        validation: a file of the source to predict, and the published relative error.
        remark: what to know.
    """

    title: str
    source: str
    files: tuple[str, ...]
    options: dict[str, Any] = field(default_factory=dict)
    friction: str = "lugre"
    published: tuple[tuple[str, str, Callable[[Identification], str]], ...] = ()
    validation: tuple[str, str] | None = None
    remark: str = ""


def _static(name: str) -> Callable[[Identification], str]:
    return lambda result: _plain(result.parameters.static[name])


def _gravity(name: str) -> Callable[[Identification], str]:
    return lambda result: _plain(result.parameters.gravity.get(name))


def _effect(effect: str, name: str) -> Callable[[Identification], str]:
    def read(result: Identification) -> str:
        entry = result.parameters.effect(effect)
        return "not found" if entry is None else _plain(entry.parameters[name])

    return read


def _plain(parameter: Any) -> str:
    if parameter is None:
        return "not found"
    if not parameter.identified:
        return f"{parameter.value:.4g}, not determined"
    return f"{parameter.value:.5g}" + (f" ± {parameter.stderr:.2g}" if parameter.stderr else "")


def _relative(result: Identification) -> str:
    return f"{result.diagnosis['error']['relative_percent']['all_rows_after']:.2f} %"


EMPS = "A. Janot, M. Gautier, M. Brunot, Data Set and Reference Models of EMPS, 2019 (nonlinearbenchmark.org)"
CICESE = "github.com/jorgevchin/Friction-Identification"

RECORDINGS = (
    Recording(
        "EMPS, textbook model",
        EMPS,
        ("emps/emps_identification.csv.gz",),
        friction="coulomb",
        published=(
            ("M, kg", "95.109", _effect("inertia", "inertia")),
            ("viscous, N s/m", "203.50", _static("viscous")),
            ("Coulomb, N", "20.394", _static("coulomb")),
            ("offset, N", "-3.165", _effect("torque_offset", "offset")),
            ("relative error", "4.08 %", _relative),
        ),
        validation=("emps/emps_validation_pulses.csv.gz", "5.98 % (at 50 Hz)"),
        remark="The published error is over rows decimated to 50 Hz, ours over the full rate.",
    ),
    Recording(
        "EMPS, with the library of effects",
        EMPS,
        ("emps/emps_identification.csv.gz",),
        published=(("relative error", "3.11 % (the authors' asymmetric friction)", _relative),),
        validation=("emps/emps_validation_pulses.csv.gz", ""),
        remark="The authors traced the asymmetry to fatigue of the screw.",
    ),
    Recording(
        "CICESE DD2DOF, joint 1 (direct drive, vertical, constant speeds)",
        CICESE,
        ("cicese_dd2dof/test2_constant_speed_both_joints.csv.gz",),
        {"mapping": {"position_rad": "position1_rad", "torque_nm": "torque1_cmd_nm"}, "trial_by": "run"},
        published=(
            ("gravity, sin q, N m", "38.5 (and 1.8 sin 2q)", _gravity("sin")),
            ("Coulomb, N m", "12.4 forwards, 10.9 backwards", _static("coulomb")),
            ("viscous, N m s/rad", "3.4, 2.8", _static("viscous")),
        ),
        remark="Joint 2 moves along, so what is left depends on the angle.",
    ),
    Recording(
        "DFKI pendulum (AK80-6), ddp",
        "github.com/dfki-ric-underactuated-lab/torque_limited_simple_pendulum",
        ("dfki_pendulum_ak80/ddp.csv.gz",),
        published=(("gravity, sin q, N m", "3.31 (another file of the source: 2.14)", _gravity("sin")),),
    ),
    Recording(
        "HSM150 servo, torque step",
        "github.com/malik-robert/HSM150-data",
        ("hsm150_servo/torque_step_pos_0.06.csv.gz",),
        {"trial_by": "run"},
        published=(("inertia, kg m2", "1.2e-4 (catalogue)", _effect("inertia", "inertia")),),
    ),
    Recording(
        "Damiao DM4310",
        "github.com/YIZHIXIAOCANGSHU/Friction-Identification-for-Manipulators_usb2fdcan",
        ("damiao_motors/motor05_dm4310.csv.gz",),
        {"unwrap": 25.0},
        published=(
            ("Coulomb, N m", "0.101", _static("coulomb")),
            ("viscous, N m s/rad", "0.00586", _static("viscous")),
        ),
        remark="48 Hz at up to 8 rad/s: few rows per motion.",
    ),
    Recording(
        "LAAS cogging, one speed",
        "github.com/heitor-andrade/laas_anti_cogging",
        ("laas_bldc_cogging/speed_test.csv.gz",),
        {"torque_constant": 0.03},
    ),
    Recording(
        "Servo motor, torque triangle",
        "github.com/TeacherRock/LuGre_Friction",
        ("servo_motor_lugre/inertia_viscous_torque_triangle.csv.gz",),
        {"trial_by": "run"},
        published=(
            ("Coulomb, N m", "0.0149, which its own logs contradict (about 0.030)", _static("coulomb")),
        ),
        remark="Torque is commanded, and the published numbers are of another recording: a negative control.",
    ),
)


def section(recording: Recording, folder: Path) -> list[str]:
    """What comes out, as lines of the page."""
    lines = [f"## {recording.title}", "", f"{recording.source}. Files: {', '.join(recording.files)}.", ""]
    if recording.remark:
        lines += [recording.remark, ""]
    start = time.process_time()
    try:
        logs = [_import(recording, folder / name) for name in recording.files]
        result = identify(logs, friction=recording.friction)
        lines += _found(recording, result, time.process_time() - start)
    except FfcIdError as error:
        return [*lines, f"Refused: {error}", ""]
    if recording.validation is not None:
        name, published = recording.validation
        (error,) = predict([_import(recording, folder / name)], result.parameters).errors.values()
        said = f"; published: {published}" if published else ""
        lines += [
            f"On the source's own validation file, every row of it: {error['relative_percent']:.1f} %{said}.",
            "",
        ]
    return lines


def _import(recording: Recording, path: Path) -> Log:
    return import_recording(path, **recording.options).log


def _found(recording: Recording, result: Identification, seconds: float) -> list[str]:
    diagnosis = result.diagnosis
    unit = unit_text("torque", result.recording.axis.kind)
    lines = []
    if recording.published:
        lines += ["| | published | found |", "|---|---|---|"]
        lines += [f"| {name} | {known} | {read(result)} |" for name, known, read in recording.published]
        lines.append("")
    held = diagnosis["error"]["held_out"]
    names = [
        e["name"] + (f" (or {', '.join(e['alternatives'])})" if e["alternatives"] else "")
        for e in diagnosis["effects"]
    ]
    lines += [
        f"Verdict `{diagnosis['verdict']}`, friction law `{diagnosis['friction']}`, "
        f"effects: {', '.join(names) or 'none'}. Held-out error {held['before']:.3g} {unit} before, "
        f"{held['after']:.3g} {unit} after; sensor noise {diagnosis['error']['noise_floor']:.2g} {unit}. "
        f"{len(result.recording.torque):,} rows, {seconds:.1f} s of one core.",
        "",
    ]
    if diagnosis["unexplained"]:
        lines += [f"Unexplained: {diagnosis['unexplained']['note']}", ""]
    return lines


def default_folder() -> Path:
    """Where the recordings are."""
    shared = os.environ.get("FFC_ID_SHARED")
    return (Path(shared) if shared else Path(__file__).parents[2] / "shared") / "measured"


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=None)
@click.option("--out", type=click.Path(path_type=Path), default=Path("docs/measured.md"))
def main(folder: Path | None, out: Path) -> None:
    """Identify every recording and write the page."""
    where = folder or default_folder()
    if not where.is_dir():
        raise click.ClickException(f"{where}: no recordings there; give --folder")
    lines = [
        "# What it finds on recordings of real machines",
        "",
        "Made by `make study-measured`. None of these recordings is shipped; their sources are named.",
        "Nothing in the tool is tuned to any of them. EMPS and CICESE are tests too",
        "(`tests/test_measured.py`), which skip where the recordings are absent.",
        "",
    ]
    for recording in RECORDINGS:
        click.echo(recording.title, err=True)
        lines += section(recording, where)
    out.write_text("\n".join(lines).rstrip() + "\n")
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
