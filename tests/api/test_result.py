"""What a person at a notebook sees and asks."""

from __future__ import annotations

import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_info

import idtool
from idtool import InputError, Log, Parameters, Result, identify
from idtool.api.progress import told as told_of
from idtool.io.catalogue import fetch, read_catalogue
from idtool.verbs.identify import READING, SEARCHING

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sample")
    fetch(read_catalogue().get("sample"), folder)
    return folder


@pytest.fixture(scope="module")
def told() -> list[str]:
    return []


@pytest.fixture(scope="module")
def result(sample: Path, told: list[str]) -> Result:
    """Of the gravity run alone, without the search for effects: quick, and enough for what is shown."""

    def keep(what: str) -> None:
        told.append(what)
        # the linear algebra keeps to one core meanwhile
        assert {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"} == {1}

    return identify(
        str(sample / "gravity.csv.gz"),
        friction="coulomb",
        validate=sample / "validation.csv.gz",
        progress=keep,
    )


def test_the_public_names_are_all_that_is_seen() -> None:
    assert set(dir(idtool)) == set(idtool.__all__)
    for name in idtool.__all__:
        assert getattr(idtool, name) is not None
    shown = subprocess.run(
        [sys.executable, "-c", "import idtool; help(idtool)"],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    ).stdout
    for name in ("identify", "Log", "Parameters", "Result", "ForceFreeController"):
        assert name in shown


def test_a_result_prints_its_summary(result: Result, told: list[str]) -> None:
    text = repr(result)
    assert text == result.summary()
    assert len(text) < 4000
    assert "coulomb" in text
    assert f"verdict: {result.diagnosis['verdict']}" in text
    assert "of the torque; sensor noise" in text
    assert "\nvalidation: " in text
    page = result._repr_html_()
    assert page.count("<table") == 1
    assert "verdict:" in page
    assert "searching the friction parameters" in told


def test_parameters_are_a_table(result: Result) -> None:
    frame = result.parameters.to_frame()
    assert isinstance(frame, pd.DataFrame)
    row = frame.loc[("gravity", "per_payload")]
    assert row["value"] == result.parameters.gravity["per_payload"].value
    assert row["low"] < row["value"] < row["high"]
    assert row["unit"] == "N m/kg"
    assert ("inertia", "inertia") in frame.index
    assert "inertia" not in result.effects


def test_every_figure_is_drawn_alone_and_into_axes(result: Result) -> None:
    from matplotlib import pyplot

    assert {"stribeck", "prediction", "residual_time"} <= set(result.figures)
    for name in ("prediction", "gravity"):
        alone = result.plot(name)
        assert alone.get_axes()
    figure, axes = pyplot.subplots(1, 2, figsize=(14, 7))
    assert result.plot("prediction", ax=axes[0]) is figure
    left = [axis.get_position() for part in figure.subfigs for axis in part.get_axes()]
    assert left
    figure.canvas.draw()
    small, cell = pyplot.subplots(figsize=(1, 1))
    with pytest.raises(InputError, match=r"^ax: has no room"):
        result.plot("prediction", ax=cell)
    with pytest.raises(InputError, match=r'^name: .* did you mean "stribeck"\?'):
        result.plot("stribek")
    loose = figure.add_axes((0.1, 0.1, 0.2, 0.2))
    with pytest.raises(InputError, match=r"^ax: these axes have no cell"):
        result.plot("prediction", ax=loose)
    with pytest.raises(InputError, match=r"^ax: these axes have no cell"):
        result.plot("prediction", ax="left")  # type: ignore[arg-type]
    pyplot.close(figure)
    pyplot.close(small)


def test_logs_and_parameters_say_what_they_are(result: Result, sample: Path) -> None:
    log = repr(Log.read(sample / "gravity.csv.gz"))
    assert re.search(
        r"^<Log \S+gravity.csv.gz: gravity, rotary axis, [\d]+ rows, \d+ trials; trial, time_s, ", log
    )
    shown = repr(result.parameters)
    assert "\n" in shown
    assert "coulomb" in shown
    assert len(shown) < 4000
    assert repr(Parameters()) == "<Parameters of a rotary axis>\nnothing is fitted yet"


def test_a_log_draws_itself(sample: Path) -> None:
    log = Log.read(sample / "gravity.csv.gz")
    figure = log.plot()
    labels = {axis.get_ylabel() for axis in figure.get_axes()}
    assert {"Position, rad", "Speed, rad/s", "Current, A"} <= labels


def test_its_heading_counts_trials(sample: Path) -> None:
    log = Log.read(sample / "sine.csv.gz")
    one = replace(log, rows=log.trials[0])
    assert "sine.csv.gz: 11400 rows, 4 trials" in {text.get_text() for text in log.plot().texts}
    heading = f"sine.csv.gz: {one.row_count} rows, 1 trial"
    assert heading in {text.get_text() for text in one.plot().texts}


def test_predicts_logs_and_paths(result: Result, sample: Path) -> None:
    path = sample / "validation.csv.gz"
    of_path, of_log = result.predict(path), result.predict([Log.read(path)])
    np.testing.assert_array_equal(of_path.frame["torque_predicted_nm"], of_log.frame["torque_predicted_nm"])
    validated = result.diagnosis["validation"]["errors"]
    assert of_path.errors == validated
    shown = repr(of_path).splitlines()
    assert re.fullmatch(r"validation: 0\.\d+ N m rms, [\d.]+ % of the torque, 9600 rows", shown[0])
    assert all(line.startswith("note: ") for line in shown[1:])


def test_the_line_of_progress_tells_time_and_share_first(capsys: pytest.CaptureFixture[str]) -> None:
    """What is being done is cut off where the line is full, not how long it takes."""
    with told_of(True) as show:
        show(READING)
        time.sleep(0.7)  # the search is expected to take four times as long
        show(SEARCHING)
        show("trying " + 20 * "words ")
    lines = [line.rstrip() for line in capsys.readouterr().err.split("\r") if line.strip()]
    assert lines[0] == f"   0 s: {READING}"
    assert re.fullmatch(rf"   1 s, \d+ %, at least \d s left: {SEARCHING}", lines[1])
    assert re.match(r"   1 s, \d+ %, at least \d s left: trying words", lines[2])
    assert len(lines[2]) < 80


def test_writes_the_result_folder(result: Result, tmp_path: Path) -> None:
    said: list[str] = []
    page = result.report(tmp_path / "result", progress=said.append)
    assert len(said) == len(result.figures)
    assert said[0] == f"drawing the figures: 0 of {len(said)}, 0 %"
    assert re.fullmatch(
        rf"drawing the figures: 1 of {len(said)}, \d+ %", said[1]
    )  # the first loads what all need
    assert re.fullmatch(rf"drawing the figures: 2 of {len(said)}, \d+ %, \d+ s left", said[2])
    assert page.name == "report.html"
    for name in ("params.toml", "diagnosis.json", "figures/prediction.png"):
        assert (tmp_path / "result" / name).exists()
    with pytest.raises(InputError, match=r"already holds .*; pass force=True to overwrite it"):
        result.report(tmp_path / "result")


def test_errors_name_the_argument(sample: Path) -> None:
    log = Log.read(sample / "gravity.csv.gz")
    for call, expected in (
        (lambda: identify([]), "^logs: is empty; give a log"),
        (lambda: identify(3), "^logs: int is neither a log nor a path"),  # type: ignore[arg-type]
        (lambda: identify([log, None]), "^logs: NoneType is neither"),  # type: ignore[list-item]
        (lambda: identify(log, friction="lugr"), r'^friction: .* did you mean "lugre"\?'),
        (lambda: identify(log, gravity="slyde"), r'^gravity: .* did you mean "slide"\?'),
        (lambda: identify(log, optimizer="isre"), r'^optimizer: .* did you mean "isres"\?'),
        (lambda: identify(log, tolerance=150.0), "^tolerance: is 150 %"),
        (lambda: identify(log, tolerance="a"), "^tolerance: expected a number"),  # type: ignore[arg-type]
        (lambda: identify(log, progress=3), "^progress: int is no function"),  # type: ignore[arg-type]
        (lambda: identify(log, seed=-1), "^seed: expected a whole number from 0 on, found -1"),
        (lambda: identify(log, torque_constant=-1.0), "^torque_constant: expected a number above 0"),
        (lambda: identify(log, without="backlsh"), r'^without: .* did you mean "backlash"\?'),
        (lambda: identify(log, effects=["backlash"]), "^effects: str is no effect"),  # type: ignore[list-item]
        (lambda: identify(log.frame), "^logs: DataFrame is neither a log nor a path"),
        (lambda: identify(log, without=["backlsh"]), 'did you mean "backlash"'),
        (lambda: identify(log, validate=log), "validate: is among the logs that are fitted"),
    ):
        with pytest.raises(InputError, match=expected):
            call()
