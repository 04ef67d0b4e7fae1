"""`ffc-id import`: a recording from elsewhere into a log."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .common import PATH, Output, force_option, output_options
from .numbers import Number
from .words import Choice

if TYPE_CHECKING:
    from idtool.importing import Imported
    from idtool.parameters import Parameters


def _pairs(option: str, texts: Iterable[str]) -> list[tuple[str, str]]:
    pairs = []
    for text in texts:
        left, equals, right = text.partition("=")
        if not (left.strip() and equals and right.strip()):
            raise click.UsageError(f"{option} {text}: write it as {option} NAME=VALUE.")
        pairs.append((left.strip(), right.strip()))
    return pairs


def _once(option: str, texts: Iterable[str]) -> dict[str, str]:
    pairs = _pairs(option, texts)
    result = dict(pairs)
    if len(result) < len(pairs):
        raise click.UsageError(f"{option} names one column twice; name it once.")
    return result


@click.command("import", short_help="Turn a recording from elsewhere into a log.")
@click.argument("file", type=PATH)
@click.option(
    "-o", "--output", "target", required=True, metavar="LOG.csv", type=PATH, help="The log to write."
)
@click.option(
    "--map",
    "mapping",
    multiple=True,
    metavar="COLUMN=SOURCE",
    help="Take SOURCE for COLUMN (position_rad, or just position).",
)
@click.option(
    "--unit",
    "units",
    multiple=True,
    metavar="ROLE=UNIT",
    help="Unit of a column: position=deg, velocity=rpm, time=ms, current=2.69mA, position=count:4096.",
)
@click.option("--trial-by", metavar="COLUMN", help="Column whose values part the trials.")
@click.option("--where", multiple=True, metavar="COLUMN=VALUE", help="Take only the rows in which it holds.")
@click.option(
    "--torque-constant",
    type=Number(),
    metavar="K",
    help="N m/A (N/A on a linear axis), where current was recorded.",
)
@click.option(
    "--experiment", default="", metavar="NAME", help="What it was: gravity, sweep, sine or another word."
)
@click.option(
    "--axis",
    "axis_file",
    type=PATH,
    metavar="FILE",
    help="Axis file (ffc-id init) in place of --kind and --torque-constant.",
)
@click.option("--kind", type=Choice(["rotary", "linear"]), help="Kind of axis; else as the units tell.")
@click.option(
    "--unwrap",
    type=Number(),
    metavar="PERIOD",
    help="Undo the wrapping of the position, in the unit of its column.",
)
@force_option
@output_options
def import_recording(
    *, file: Path, target: Path, axis_file: Path | None, force: bool, output: Output, **how: Any
) -> None:
    """Turn a recording from elsewhere into a log: CSV, Parquet, MATLAB, ROS 1 and 2 bags, MCAP, BAM.

    A JSON of BAM's parameters becomes a parameter file.

    Columns are guessed by their names and the units in them; --map and --unit correct the guess.
    Repeat --map, --unit and --where as needed; --where of one column twice takes either value.

    \b
    ffc-id import run.csv -o log.csv --unit position=deg --torque-constant 2.67
    ffc-id import my_bag/ -o log.csv --where joint=elbow
    ffc-id import bam.json -o params.toml
    """
    from idtool.importing import import_recording as convert
    from idtool.importing.bam_parameters import bam_parameters
    from idtool.io.atomic import refuse_existing
    from idtool.parameters.axis_file import AxisFile

    if (from_bam := bam_parameters(file)) is not None:
        refuse_existing(target, force, file)
        _write_parameters(output, *from_bam, target, force=force)
        return
    how["mapping"], how["units"] = _once("--map", how["mapping"]), _once("--unit", how["units"])
    where: dict[str, list[str]] = {}
    for name, value in _pairs("--where", how["where"]):
        where.setdefault(name, []).append(value)
    unwrap, axis = how["unwrap"], None
    if unwrap is not None and not unwrap > 0.0:
        raise click.UsageError(f"--unwrap {unwrap:g}: the period must be a finite number above zero.")
    if axis_file is not None:
        if how["kind"] is not None or how["torque_constant"] is not None:
            raise click.UsageError("--axis says what --kind and --torque-constant would; leave them away.")
        axis = AxisFile.read(axis_file).axis
        how |= {"kind": axis.kind, "torque_constant": axis.torque_constant}
    refuse_existing(target, force, file)
    imported = convert(file, **how | {"where": where})
    if axis is not None:
        imported = replace(imported, log=replace(imported.log, axis=imported.log.axis.completed(axis)))
    imported.log.write(target, force=force)
    _tell(output, imported, target)
    output.result(_document(imported, target), ())
    output.next("check", target, odd=[str(target)] if imported.doubts else [])


def _write_parameters(
    output: Output, parameters: Parameters, lost: list[str], target: Path, *, force: bool
) -> None:
    parameters.write(target, force=force)
    for key in lost:
        output.say(f"note: {key} did not come over: nothing here means the same.")
    output.say(f"written: {target}")
    output.result({"schema": "ffc-id/import/1", "params": str(target), "not_carried": lost}, ())
    output.next("export", "mujoco", "-p", target, "-o", target.with_suffix(".xml"))


#: Why a column was taken, as a person is told.
_WHY = {"given": "as given", "named": "", "presumed": "unit presumed", "unit": "by its unit"}


def _tell(output: Output, imported: Imported, target: Path) -> None:
    from idtool.presentation.text import counted

    frame = imported.log.frame
    width = max(len(item.column) for item in imported.taken)
    for item in imported.taken:
        told = not item.unit.text or item.source.endswith((f"[{item.unit.text}]", f"({item.unit.text})"))
        unit = "" if told else f" [{item.unit.text}]"
        remark = ", ".join(part for part in (_WHY[item.why], "commanded" if item.commanded else "") if part)
        output.say(
            f"  {item.column:<{width}}  from {item.source}{unit}" + (f"  ({remark})" if remark else "")
        )
    if imported.kept:
        output.say(f"  kept as they are: {', '.join(imported.kept)}")
    for note in imported.notes:
        output.say(f"note: {note}.")
    for doubt in imported.doubts:
        output.say(f"! {doubt}")
    rows, trials = counted(len(frame), "row"), counted(int(frame["trial"].nunique()), "trial")
    output.say(f"{target}: {rows}, {trials}, {imported.log.axis.kind} axis.")


def _document(imported: Imported, target: Path) -> dict[str, Any]:
    frame = imported.log.frame
    return {
        "schema": "ffc-id/import/1",
        "log": str(target),
        "rows_read": imported.rows_read,
        "rows": len(frame),
        "trials": int(frame["trial"].nunique()),
        "kind": imported.log.axis.kind,
        "torque_constant": imported.log.axis.torque_constant,
        "experiment": imported.log.experiment,
        "columns": {
            item.column: {
                "source": item.source,
                "unit": item.unit.text,
                "factor": item.unit.factor,
                "how": item.why,
                "commanded": item.commanded,
            }
            for item in imported.taken
        },
        "kept": list(imported.kept),
        "notes": list(imported.notes),
        "doubts": list(imported.doubts),
    }
