"""The smooth correction: it lowers the error where something is unexplained, and is never extrapolated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from idtool.errors import InputError
from idtool.model.motion import Motion
from idtool.parameters.correction import Correction
from idtool.verbs.identification import parameters_of
from idtool.verbs.identify import identify
from idtool.verbs.predict import predict
from testbench.cases import disturb
from testbench.plants import SESSION, random_plant, record_session

KNOTS = np.linspace(-1.0, 1.0, 5)
BUMP = Correction("position", False, KNOTS, np.array([0.0, 0.1, 0.3, 0.2, 0.0]))


def motion(position: np.ndarray, velocity: float = 0.1) -> Motion:
    n = len(position)
    return Motion(
        0.01 * np.arange(n), np.zeros(n, dtype=np.intp), position, np.full(n, velocity), np.zeros(n)
    )


def test_nothing_is_extrapolated_and_nothing_jumps() -> None:
    place = np.linspace(-3.0, 3.0, 6001)
    torque = BUMP(motion(place))
    assert np.all(torque[np.abs(place) >= 1.0] == 0.0)
    assert np.max(np.abs(np.diff(torque))) < 1e-3
    assert torque[3000] == pytest.approx(0.3)


def test_friction_changes_sign_with_the_motion() -> None:
    directed = Correction("position", True, BUMP.knots, BUMP.torque)
    place = np.linspace(-1.0, 1.0, 9)
    np.testing.assert_allclose(directed(motion(place, -0.1)), -BUMP(motion(place)))


def test_a_file_comes_back(tmp_path: Path) -> None:
    BUMP.write(tmp_path / "c.toml")
    again = Correction.read(tmp_path / "c.toml")
    np.testing.assert_array_equal(again.torque, BUMP.torque)
    assert (again.variable, again.with_direction) == ("position", False)


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("position", "time", "variable"),
        ("false", "0", "with_direction"),
        ("-1.0,", "5.0,", "knots"),
        ("0.3", "nan", "torque: is missing or wrong; expected two finite numbers or more"),
        ("correction/1", "correction/9", "schema"),
    ],
)
def test_a_wrong_file_is_one_sentence(tmp_path: Path, old: str, new: str, place: str) -> None:
    file = tmp_path / "c.toml"
    BUMP.write(file)
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=place):
        Correction.read(file)


@pytest.mark.long
def test_unexplained_but_useful() -> None:
    """A damaged tooth, which no effect of the library is: the error on trials that it was not fitted on."""
    plant = random_plant(np.random.default_rng(11))
    logs = record_session(plant, "lab", 11, (*SESSION, "validation"))
    *seen, fresh = disturb(logs, "damaged tooth", 11, 0.01)
    found = identify(seen)
    unexplained = found.diagnosis["unexplained"]
    assert "position" in unexplained["depends_on"]
    held_out = unexplained["correction"]["held_out"]
    assert held_out["after"] < 0.8 * held_out["before"]
    parameters = parameters_of(found.fit)
    (plain,) = predict([fresh], parameters).errors.values()
    (corrected,) = predict([fresh], parameters, found.evidence.correction).errors.values()
    assert corrected["rmse"] < 0.9 * plain["rmse"]
