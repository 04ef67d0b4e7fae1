"""The folder is read as it was written, and a broken one is refused in one sentence."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from idtool.errors import InputError
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.report import write_report
from idtool.report.evidence import read_evidence
from idtool.report.verdict import summarise

from . import folder as synthetic


def test_reads_what_was_written(folder: Path) -> None:
    evidence = read_evidence(folder)
    rows = synthetic.table(ripple=True)
    assert evidence.kind == "rotary"
    np.testing.assert_allclose(evidence.rows.residual_after, rows["torque"] - rows["after"], atol=1e-12)
    assert len(evidence.rows.segments) == 11
    assert [(span.trial, span.experiment) for span in evidence.rows.held_out_spans] == [
        (2, "gravity"),
        (5, "sweep"),
        (8, "sine"),
    ]
    assert np.all(np.diff(evidence.rows.clock) > 0)


def test_a_clock_that_starts_anew_in_each_trial_still_rises(folder: Path) -> None:
    rows = synthetic.table(ripple=True)
    rows["time_s"] = rows["time_s"] - 6.5 * rows["trial"]
    synthetic.write_rows(folder, rows)
    assert np.all(np.diff(read_evidence(folder).rows.clock) > 0)


def test_equal_trial_numbers_of_two_logs_are_two_trials(folder: Path) -> None:
    rows = synthetic.table(ripple=True)
    rows["trial"] = np.where(rows["experiment"] == "gravity", rows["trial"], 3)
    synthetic.write_rows(folder, rows)
    assert len(read_evidence(folder).rows.segments) == 6


def _column(name: str, change: Callable[[np.ndarray], Any]) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        rows = synthetic.table(ripple=True)
        rows[name] = change(rows[name].astype(object))
        synthetic.write_rows(folder, rows)

    return spoil


def _without(name: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        rows = synthetic.table(ripple=True)
        del rows[name]
        synthetic.write_rows(folder, rows)

    return spoil


def _at(row: int, value: Any) -> Callable[[np.ndarray], np.ndarray]:
    def change(values: np.ndarray) -> np.ndarray:
        values[row] = value
        return values

    return change


def _key(name: str, **changes: Any) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        synthetic.write_json(folder, name, synthetic.read_json(folder, name) | changes)

    return spoil


def _text(name: str, content: str | bytes) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())

    return spoil


def _remove(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


BROKEN = [
    (_remove("params.toml"), r"params\.toml: no such file; run ffc-id identify again with -o "),
    (_remove("diagnosis.json"), r"diagnosis\.json: no such file; run ffc-id identify"),
    (_remove("evidence.json"), r"evidence\.json: no such file; run ffc-id identify"),
    (_remove("evidence.csv.gz"), r"evidence\.csv\.gz: no such file; run ffc-id identify"),
    (_text("diagnosis.json", "{"), r"diagnosis\.json: is not JSON \(.*\); run ffc-id identify"),
    (_text("diagnosis.json", "[" * 100_000), r"diagnosis\.json: is not JSON"),
    (_text("diagnosis.json", b"\xff\xfe{}"), r"diagnosis\.json: is not JSON"),
    (_text("diagnosis.json", "[]"), r"diagnosis\.json: expected `object`, got `array`; run"),
    (_key("diagnosis", schema="ffc-id/diagnosis/9"), r"schema: schema is 'ffc-id/diagnosis/9', expected"),
    (_key("diagnosis", verdict="fine"), r"verdict: invalid enum value 'fine'; run"),
    (_key("diagnosis", error={"held_out": {"before": "low"}}), r"error\.held_out\.before: expected `float"),
    (_key("evidence", kind="linear"), r"kind: says the axis is linear, but params\.toml says rotary; run"),
    (_key("evidence", stribeck_points=[{"velocity": 1.0}]), r"stribeck_points\[0\]: object missing"),
    (_text("evidence.csv.gz", b"trial,time_s\n0,1\n"), r"evidence\.csv\.gz: is not a whole gzipped CSV"),
    (_text("evidence.csv.gz", gzip.compress(b"a" * 999)[:-9]), r"csv\.gz: is not a whole gzipped CSV"),
    (_text("evidence.csv.gz", gzip.compress(b"")), r"evidence\.csv\.gz: is not a whole gzipped CSV"),
    (_text("evidence.csv.gz", gzip.compress(b"\x00\xff\xfe")), r"evidence\.csv\.gz"),
    (_without("after"), r"evidence\.csv\.gz, after: the column is missing; run"),
    (_column("torque", _at(5, "much")), r"row 7, torque: expected a finite number, found 'much'; run"),
    (_column("before", _at(0, "")), r"row 2, before: expected a finite number, found 'nan'; run"),
    (_column("velocity", _at(1, "inf")), r"row 3, velocity: expected a finite number, found 'inf'; run"),
    (_column("load", _at(1, "heavy")), r"row 3, load: expected a finite number, found 'heavy'; run"),
    (_column("trial", lambda values: values[:1]), r"holds fewer than two rows; run"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "sentence"), BROKEN)
def test_broken_files_are_refused_in_one_sentence(
    folder: Path, spoil: Callable[[Path], None], sentence: str
) -> None:
    try:
        spoil(folder)
    except ValueError:  # columns of different lengths: write the one row there is
        rows = synthetic.table(ripple=True)
        synthetic.write_rows(folder, {name: values[:1] for name, values in rows.items()})
    with pytest.raises(InputError, match=sentence) as caught:
        write_report(folder)
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(".")
    assert not (folder / "report.html").exists()
    assert not (folder / "figures").exists()


def test_no_folder_and_a_file_in_its_place(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such folder; run ffc-id identify LOG\.\.\. -o "):
        write_report(tmp_path / "nowhere")
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="is a file, no result folder; name the folder"):
        write_report(tmp_path / "file")


def test_a_file_where_the_figures_go_is_said(folder: Path) -> None:
    (folder / "figures").write_text("in the way")
    with pytest.raises(InputError, match="figures: "):
        write_report(folder)


def test_a_headline_of_three_effects_says_the_largest_first_and_of_what_once(folder: Path) -> None:
    file = folder / "diagnosis.json"
    document = json.loads(file.read_text())
    known = document["effects"][0]
    sizes = {"position_ripple": 1.4, "direction_asymmetry": 6.4, "torque_offset": 1.0}
    document["effects"] = [known | {"name": n, "percent_of_torque": size} for n, size in sizes.items()]
    file.write_text(json.dumps(document))
    assert summarise(read_evidence(folder)).headline == (
        "Found: direction asymmetry (6.4 % of the torque), position ripple (1.4 %) and torque offset (1.0 %)"
    )


def test_what_is_no_finding_has_no_number_beside_the_findings(folder: Path) -> None:
    """A delay between two readings is in the parameter file, and no effect of the axis."""
    file = folder / "params.toml"
    known = Parameters.read(file)
    late = EffectEntry("transport_delay", {"delay": Parameter(0.0008, 0.00002)})
    replace(known, effects=(late, *known.effects)).write(file, force=True)
    said = [finding.meaning for finding in summarise(read_evidence(folder)).findings]
    assert said
    assert not any("reported" in meaning for meaning in said)
