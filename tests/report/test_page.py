"""The page says what it must, holds everything inside, and survives what files may hold."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from idtool.parameters import Parameters
from idtool.report import write_report
from idtool.report.evidence import read_evidence
from idtool.report.folding import quiet
from idtool.report.gallery import uncertainty_plates
from idtool.report.tables import parameter_groups

from . import folder as synthetic
from .html import Page

#: markup, a quote that would end an attribute, and a formula that does not parse
HOSTILE = "<script>alert('x')</script>\"&$\\undefined{ $"


@pytest.fixture(scope="module")
def page(drawn: Path) -> Page:
    return Page(drawn / "report.html")


def test_is_well_formed_and_small(drawn: Path, page: Page) -> None:
    assert page.mistakes == []
    assert (drawn / "report.html").stat().st_size < 6e6
    assert [tag for tag, _ in page.tags].count("h1") == 1


def test_verdict_error_and_trust_come_first(drawn: Path, page: Page) -> None:
    head = page.text[: page.text.index("Parameters")]
    assert "Found: position ripple" in head
    error = synthetic.read_json(drawn, "diagnosis")["error"]["held_out"]
    assert f"−{100 * (1 - error['after'] / error['before']):.0f} %" in head
    assert "With care" in head
    assert "Bristle stiffness sits at a bound; the data do not determine bristle damping." in head
    assert "The errors are from 3 whole trials that neither the parameters nor the choice" in head


def test_parameters_carry_unit_error_interval_and_flags_in_words(page: Page) -> None:
    assert "coulomb_nm 0.08055 N m 0.00081 0.07897 to 0.08213" in page.text
    assert "at its bound, and the data do not determine it" in page.text
    assert "the data do not determine it" in page.text
    assert "cycles_per_turn 35.00 1/turn 0.35 34.31 to 35.69" in page.text
    assert "command_gain_s 2.05 s – – a setting, not identified" in page.text


def test_says_how_to_reproduce(page: Page) -> None:
    for word in (
        "ffc-id identify gravity.csv",
        "ab" * 32,
        "2.4.6",
        "Seed 0",
        "231 rows were left out",
        "zero-phase, 20 Hz",
    ):
        assert word in page.text


def test_inertia_belongs_to_the_base_model(folder: Path) -> None:
    diagnosis = synthetic.read_json(folder, "diagnosis")
    diagnosis["candidates"].append({"name": "inertia", "held_out": 0.01, "accepted": True, "why": "needed"})
    synthetic.write_json(folder, "diagnosis", diagnosis)
    evidence = synthetic.read_json(folder, "evidence")
    evidence["correlation"]["names"][2] = "inertia.inertia"
    synthetic.write_json(folder, "evidence", evidence)
    read = read_evidence(folder)
    titles = [group.title for group in parameter_groups(read)]
    assert titles[-3:-1] == ["Inertia", "Effect: position ripple"]
    assert [candidate.name for candidate in read.diagnosis.tried] == [
        "position_ripple",
        "thermal_drift",
        "tilt_misalignment",
    ]
    captions = {plate.name: plate.caption for plate in uncertainty_plates(read)}
    assert captions["candidates"].startswith("Accepted: position ripple. ")


def test_candidates_have_their_reasons(page: Page) -> None:
    assert "thermal drift 0.00900 0.8 no error rises" in page.text
    assert "tilt misalignment – – no one tilt only" in page.text
    assert "It would tell position ripple from external periodic torque" in page.text


def test_every_figure_is_inside_with_alt_and_caption(drawn: Path, page: Page) -> None:
    images = [image for image in page.all("img") if image.get("class") != "small"]
    files = sorted((drawn / "figures").glob("*.png"))
    assert len(images) == len(files) == len(page.all("figcaption")) == 20
    inside = set()
    for image in images:
        assert image["alt"]
        assert len(image["alt"]) > 30
        prefix, _, content = (image["src"] or "").partition(",")
        assert prefix == "data:image/png;base64"
        inside.add(base64.b64decode(content))
    assert inside == {file.read_bytes() for file in files}


def test_an_effect_has_its_picture_beside_that_of_its_page(page: Page) -> None:
    own, typical = (image for image in page.all("img") if image.get("class") == "small")
    assert "what the base model and the extended model leave over the position" in (own["alt"] or "")
    assert "on a simulated axis" in (typical["alt"] or "")
    shipped = (files("idtool.data") / "effects" / "position_ripple.png").read_bytes()
    shown = [base64.b64decode((image["src"] or "").partition(",")[2]) for image in (own, typical)]
    assert shown[1] == shipped
    assert shown[0] != shipped
    assert sum(map(len, shown)) < 100_000


def test_figures_without_a_finding_are_folded(page: Page) -> None:
    folds = re.findall(r'<details class="quiet">(.*?)</details>', page.source, re.DOTALL)
    folded = set(re.findall(r'id="figure-(\w+)"', "".join(folds)))
    assert {"residual_histogram", "correlation"} <= folded
    assert "residual_payload" not in folded, "nobody tested the load"
    assert folded.isdisjoint(
        {"residual_time", "residual_position", "spectrum_angle", "stribeck", "prediction"}
    )


@pytest.mark.parametrize(
    ("p_value", "share", "is_folded"), [(0.4, 0.3, True), (1e-9, 0.002, True), (1e-9, 0.2, False)]
)
def test_a_payload_is_judged_by_the_load(folder: Path, p_value: float, share: float, is_folded: bool) -> None:
    """A share that no picture shows is no finding, however certain."""
    evidence = synthetic.read_json(folder, "evidence")
    for tests in evidence["residual_tests"].values():
        tests.append({"variable": "load", "p_value": p_value, "share": share})
    synthetic.write_json(folder, "evidence", evidence)
    read = read_evidence(folder)
    assert quiet(read, "residual_payload") == quiet(read, "residual_load") == is_folded


@pytest.mark.usefixtures("quick")
def test_words_are_those_of_the_field(folder: Path) -> None:
    """Keys of files stay what they are."""
    file = Parameters.read(folder / "params.toml")
    unknown = replace(file.static["static"], at_bound=True)
    replace(file, static={**file.static, "static": unknown}).write(folder / "params.toml", force=True)
    evidence = synthetic.read_json(folder, "evidence")
    evidence["residual_tests"]["after"].append({"variable": "order", "p_value": 1e-9, "share": 0.2})
    synthetic.write_json(folder, "evidence", evidence)
    page = Page(write_report(folder))
    assert "Stiction and bristle stiffness sit at a bound" in page.text
    assert "still depends on run order (p below 0.01), but by less than the verdict counts" in page.text
    assert "static_nm" in page.text
    assert any(section.get("id") == "uncertainty" for section in page.all("section"))


@pytest.mark.usefixtures("quick")
def test_an_axis_in_ampere_is_called_by_its_kind(folder: Path) -> None:
    file = Parameters.read(folder / "params.toml")
    replace(file, axis=replace(file.axis, effort="current")).write(folder / "params.toml", force=True)
    text = Page(write_report(folder)).text
    assert "· rotary axis" in text
    assert "Prediction error, A rms" in text


@pytest.mark.usefixtures("quick")
def test_logs_for_validation_stand_in_the_table_of_errors(folder: Path) -> None:
    diagnosis = synthetic.read_json(folder, "diagnosis")
    diagnosis["validation"] = {
        "logs": ["other/day2.csv"],
        "errors": {
            "sweep": {"rmse": 0.00539, "relative_percent": 1.15, "rows": 9600},
            "": {"rmse": 0.00641, "relative_percent": 2.5, "rows": 400},
        },
    }
    synthetic.write_json(folder, "diagnosis", diagnosis)
    text = Page(write_report(folder)).text
    assert "validation: sweep – 0.00539 –" in text
    assert "validation – 0.00641 –" in text
    assert "every row (10000) of day2.csv, which no fit saw" in text
    assert "off by 1.1 % and 2.5 % of the torque" in text


def test_formulas_are_typeset(page: Page) -> None:
    assert "sin(n q)" not in page.source
    assert "on a linear axis" not in page.text
    assert page.source.count("<math>") >= 4
    assert "sigma" not in page.source.split("<main>")[1].split("</table>")[0]


def test_figures_are_images_of_a_readable_size(drawn: Path) -> None:
    for file in (drawn / "figures").glob("*.png"):
        with Image.open(file) as image:
            image.verify()
        with Image.open(file) as image:
            assert 800 <= image.width <= 1800
            assert 250 <= image.height <= 1400
            assert len(set(np.asarray(image.convert("L")).ravel().tolist())) > 20, f"{file.name} is blank"
        assert file.with_suffix(".svg").read_text(encoding="utf-8").rstrip().endswith("</svg>")


def test_axes_carry_units(drawn: Path) -> None:
    text = {file.stem: file.read_text(encoding="utf-8") for file in (drawn / "figures").glob("*.svg")}
    assert "Velocity, rad/s" in text["stribeck"]
    assert "Friction torque, N m" in text["stribeck"]
    assert "Position, rad" in text["loops_position"]
    assert "Temperature, °C" in text["residual_temperature"]
    assert "Acceleration, rad/s²" in text["residual_acceleration"]
    for frequency in synthetic.SINES:
        assert f"{frequency:g} Hz" in text["loops_velocity"]


def test_nothing_is_loaded_from_anywhere(page: Page) -> None:
    without_data = re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]+", "", page.source)
    assert re.search(r"https?://|@import|url\(", without_data) is None
    assert page.all("script") == []
    policy = [
        meta["content"] for meta in page.all("meta") if meta.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]
    for tag, attributes in page.tags:
        for name in ("src", "href"):
            assert (attributes.get(name) or "#").startswith(("#", "data:")), tag


def test_links_lead_somewhere(page: Page) -> None:
    targets = {attributes["id"] for _, attributes in page.tags if "id" in attributes}
    assert {(link["href"] or "")[1:] for link in page.all("a")} <= targets


def test_names_from_files_are_escaped(folder: Path) -> None:
    diagnosis = synthetic.read_json(folder, "diagnosis")
    diagnosis["verdict"] = "unexplained"
    diagnosis["effects"].append({"name": HOSTILE, "p_value": None, "alternatives": [HOSTILE]})
    diagnosis["candidates"].append({"name": HOSTILE, "held_out": 0.1, "accepted": True, "why": HOSTILE})
    diagnosis["error"]["by_experiment"][HOSTILE] = {"before": 1.0, "after": 2.0}
    diagnosis["unexplained"] = {"share": 0.4, "depends_on": [HOSTILE], "note": HOSTILE}
    diagnosis["next_experiment"] = {"recipe": {HOSTILE: HOSTILE}, "separates": [HOSTILE]}
    synthetic.write_json(folder, "diagnosis", diagnosis)
    evidence = synthetic.read_json(folder, "evidence")
    evidence["logs"][0] |= {"file": HOSTILE, "sha256": HOSTILE, "experiment": HOSTILE}
    evidence |= {"notes": [HOSTILE], "command": HOSTILE, "versions": {HOSTILE: HOSTILE}, "friction": HOSTILE}
    evidence["correlation"]["names"][0] = HOSTILE
    evidence["residual_tests"]["after"].append({"variable": HOSTILE, "p_value": 0.001})
    synthetic.write_json(folder, "evidence", evidence)
    rows = synthetic.table(ripple=True)
    rows["experiment"] = np.where(rows["experiment"] == "sine", HOSTILE.replace('"', ""), rows["experiment"])
    synthetic.write_rows(folder, rows)
    page = Page(write_report(folder))
    assert page.mistakes == []
    assert page.all("script") == []
    assert page.source.count("<script") == 0
    assert page.text.count("alert('x')") >= 15  # shown as text, not run


@pytest.mark.usefixtures("quick")
def test_commands_in_notes_are_set_as_code(folder: Path) -> None:
    evidence = synthetic.read_json(folder, "evidence")
    evidence["notes"] = ["make them: `ffc-id run-sweep -o <b>sweep</b>.csv`"]
    synthetic.write_json(folder, "evidence", evidence)
    source = Page(write_report(folder)).source
    assert "<code>ffc-id run-sweep -o &lt;b&gt;sweep&lt;/b&gt;.csv</code>" in source


@pytest.mark.usefixtures("quick")
def test_a_command_in_the_reason_for_the_next_step_is_set_as_code(folder: Path) -> None:
    diagnosis = synthetic.read_json(folder, "diagnosis")
    diagnosis["next_experiment"] = diagnosis["next_experiment"] | {
        "why": "run slower ones (`ffc-id run-sweep`)"
    }
    synthetic.write_json(folder, "diagnosis", diagnosis)
    card = Page(write_report(folder)).source.split('id="step"')[1].split("</section>")[0]
    assert "<code>ffc-id run-sweep</code>" in card
    assert "`" not in card


def test_linear_axis_has_its_own_words_and_units(tmp_path: Path) -> None:
    folder = synthetic.make(tmp_path / "slide", "linear")
    page = Page(write_report(folder, svg=True))
    assert page.mistakes == []
    assert "linear axis" in page.text
    assert "coulomb_n 0.08055 N 0.00081" in page.text
    assert "Prediction error, N rms" in page.text
    assert "Force against velocity" in page.text
    assert "torque" not in re.sub(r"external periodic torque|torque constant", "", page.text.lower())
    assert "Velocity, m/s" in (folder / "figures" / "stribeck.svg").read_text(encoding="utf-8")


@pytest.mark.usefixtures("quick")
def test_adequate_model(tmp_path: Path) -> None:
    folder = synthetic.make(tmp_path / "clean", ripple=False)
    page = Page(write_report(folder))
    assert "The model is adequate" in page.text
    assert "with inertia explain the measured torque; nothing further is needed" in page.text


@pytest.mark.parametrize("verdict", ["ambiguous", "unexplained"])
@pytest.mark.usefixtures("quick")
def test_other_verdicts(folder: Path, verdict: str) -> None:
    diagnosis = synthetic.read_json(folder, "diagnosis")
    diagnosis["verdict"] = verdict
    diagnosis["unexplained"] = {
        "share": 0.41,
        "depends_on": ["position", "velocity"],
        "note": "the residual still depends on position, velocity",
    }
    synthetic.write_json(folder, "diagnosis", diagnosis)
    evidence = synthetic.read_json(folder, "evidence")
    evidence["notes"] += ["what is left looks like this: bump over the position: +0.05 N m at -0.1 rad."]
    synthetic.write_json(folder, "evidence", evidence)
    text = Page(write_report(folder)).text
    if verdict == "ambiguous":
        assert "A tie: position ripple or external periodic torque" in text
        assert "With care" in text
    else:
        assert "Found: position ripple; but structure is left" in text
        assert "still varies with position and velocity (41 % of its variance)" in text
        assert "What is left follows position and velocity." in text
        assert "The residual does not depend on" not in text
        assert "What is left looks like this: bump over the position: +0.05 N m at -0.1 rad." in text
        assert "the residual still depends" not in text, "the same twice"
        assert "Not yet" in text


@pytest.mark.usefixtures("quick")
def test_shares_what_is_left_and_the_next_step_lead(folder: Path) -> None:
    diagnosis = synthetic.read_json(folder, "diagnosis")
    for effect in diagnosis["effects"]:
        effect["percent_of_torque"] = 23.8
    diagnosis["left"] = {"rms_nm": 0.003, "percent_of_torque": 7.1, "noise_percent": 0.42}
    diagnosis["next_experiment"]["why"] = "two payloads would tell them apart"
    synthetic.write_json(folder, "diagnosis", diagnosis)
    text = Page(write_report(folder)).text
    head = text[: text.index("Effects beyond the base model")]
    assert "Found: position ripple (24 % of the torque)" in head
    assert "7.1 % of the torque is left (sensor noise 0.4 %)" in head
    assert "Two payloads would tell them apart." in head
    assert f"ffc-id run --recipe {folder.name}/next_experiment.toml --rig SPEC -o next.csv" in head
    # inertia belongs to the base model
    effects = text[text.index("Effects beyond the base model") : text.index("The model and its data")]
    assert "Inertia" not in effects.split("Parameters")[0]


@pytest.mark.usefixtures("quick")
def test_only_what_is_needed(tmp_path: Path) -> None:
    """Every optional column, list and key absent: fewer figures, no broken page."""
    folder = synthetic.make(tmp_path / "bare")
    rows = synthetic.table(ripple=True)
    synthetic.write_rows(
        folder,
        {
            name: values
            for name, values in rows.items()
            if name not in (*synthetic.OPTIONAL, "held_out", "experiment")
        },
    )
    synthetic.write_json(folder, "evidence", {})
    synthetic.write_json(folder, "diagnosis", {"schema": "ffc-id/diagnosis/1", "verdict": "adequate"})
    (folder / "params.toml").write_text('schema = "ffc-id/params/1"\n[axis]\nkind = "rotary"\n')
    page = Page(write_report(folder))
    assert page.mistakes == []
    assert "Not yet" in page.text
    assert "Nothing was held out" in page.text
    drawn = {file.stem for file in (folder / "figures").glob("*.png")}
    assert drawn == {
        "loops_velocity",
        "prediction",
        "residual_time",
        "residual_velocity",
        "residual_histogram",
        "residual_autocorrelation",
        "spectrum_time",
    }


@pytest.mark.parametrize(
    "key",
    [
        "stribeck_points",
        "residual_tests",
        "cumulative_periodograms",
        "filter",
        *(
            pytest.param(one, marks=pytest.mark.long)
            for one in ("stribeck_curve", "gravity_points", "cost_over_sigma0", "correlation")
        ),
    ],
)
@pytest.mark.usefixtures("quick")
def test_null_or_empty_lists_leave_the_rest_standing(drawn: Path, folder: Path, key: str) -> None:
    evidence = synthetic.read_json(folder, "evidence")
    evidence[key] = [] if key.endswith("points") else None
    synthetic.write_json(folder, "evidence", evidence)
    page = Page(write_report(folder))
    assert page.mistakes == []
    assert len(page.all("img")) >= len(list((drawn / "figures").glob("*.png"))) - 1


@pytest.mark.usefixtures("quick")
def test_redrawing_removes_figures_that_are_gone_and_keeps_strangers(folder: Path) -> None:
    write_report(folder, svg=True)
    assert (folder / "figures" / "gravity.svg").exists()
    stranger = folder / "figures" / "mine.png"
    stranger.write_bytes(b"mine")
    evidence = synthetic.read_json(folder, "evidence")
    evidence["gravity_points"] = []
    synthetic.write_json(folder, "evidence", evidence)
    write_report(folder)
    assert not (folder / "figures" / "gravity.png").exists()
    assert list((folder / "figures").glob("*.svg")) == []  # of the report before
    assert stranger.exists()


@pytest.mark.usefixtures("quick")
def test_blocks_of_time_are_called_so(folder: Path) -> None:
    rows = synthetic.table(ripple=True)
    rows["held_out"] = (np.arange(len(rows["trial"])) % 240 > 180).astype(int)
    synthetic.write_rows(folder, rows)
    assert (
        "Too few trials to hold some out: the errors are from 11 blocks of time"
        in Page(write_report(folder)).text
    )


@pytest.mark.usefixtures("quick")
def test_trials_that_each_start_at_zero_and_miss_rows(folder: Path) -> None:
    rows = synthetic.table(ripple=True)
    rows["time_s"] = rows["time_s"] - 6.5 * rows["trial"]
    keep = np.random.default_rng(1).random(len(rows["trial"])) > 0.03
    synthetic.write_rows(folder, {name: values[keep] for name, values in rows.items()})
    assert Page(write_report(folder)).mistakes == []


def test_drawing_is_repeatable_and_leaves_no_trace(drawn: Path, folder: Path) -> None:
    from matplotlib import rc_context, rcParams

    with rc_context({"font.size": 31.0, "axes.grid": False}):
        write_report(folder, svg=True)
        assert rcParams["font.size"] == 31.0
        assert rcParams["axes.grid"] is False
    assert (folder / "report.html").read_bytes() == (drawn / "report.html").read_bytes()
    for file in (drawn / "figures").iterdir():
        assert (folder / "figures" / file.name).read_bytes() == file.read_bytes(), file.name


def test_hand_guiding_is_told_where_there_is_a_record_of_it(tmp_path: Path) -> None:
    from idtool.errors import InputError
    from idtool.report.guiding import read_guiding

    assert read_guiding(tmp_path) == []
    figures = {"force_n": 5.4, "uneven_n": 0.09, "speed_mm_s": 18.9, "stop_ms": 10.0}
    (tmp_path / "teach.json").write_text(json.dumps({"base <model>": figures}), encoding="utf-8")
    (row,) = read_guiding(tmp_path)
    assert (row["name"], row["force"], row["uneven"]) == ("base <model>", "5.40", "0.090")
    (tmp_path / "teach.json").write_text("[1]", encoding="utf-8")
    with pytest.raises(InputError, match="hand guiding"):
        read_guiding(tmp_path)


def test_how_far_the_drawing_is(drawn: Path, told: list[tuple[int, int]]) -> None:
    figures = len(list((drawn / "figures").glob("*.png")))
    assert told == [(done, figures) for done in range(figures)]


def test_where_nothing_was_added_there_is_one_model(tmp_path: Path) -> None:
    page = Page(write_report(synthetic.make(tmp_path / "result", ripple=False)))
    assert "Extended model" not in page.text
    assert "with what was found" not in page.text
    alt = next(image["alt"] for image in page.all("img") if "over time, measured" in (image["alt"] or ""))
    assert "predicted by the model, for" in (alt or "")
