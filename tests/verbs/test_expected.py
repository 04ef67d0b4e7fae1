"""What is left of an identification: what is certain to come, and a share that never goes back."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool import Log
from idtool.diagnosis.diagnose import BASE, FINAL
from idtool.diagnosis.selection import ACCEPTED
from idtool.presentation.pace import Pace, spoken
from idtool.verbs.expected import Expected
from idtool.verbs.identify import READING, SEARCHING, identify

SESSION = Path(__file__).resolve().parents[2] / "data" / "session"


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_stages_that_are_over_say_how_long_the_rest_takes() -> None:
    clock = Clock()
    expected = Expected(clock)
    assert (expected.left_s, expected.share) == (None, None)
    expected.hear(READING)
    clock.now += 1.0
    assert (expected.left_s, expected.words) == (None, "")
    expected.hear(SEARCHING)
    assert expected.left_s == pytest.approx(4.0 + 4.0 * (0.8 + 0.1))
    assert expected.words == "at least 8 s left"
    clock.now += 3.0
    assert expected.left_s == pytest.approx(1.0 + 3.6)
    clock.now += 7.0  # ten times the reading: what comes takes longer too
    expected.hear(BASE)
    assert expected.left_s == pytest.approx(10.0 * (0.8 + 0.1))
    clock.now += 9.0  # longer than it should
    expected.hear("trying hysteresis")
    assert expected.left_s == pytest.approx(1.0)
    expected.hear(f"{ACCEPTED} hysteresis")
    assert expected.left_s == pytest.approx(4.0 + 1.0)
    clock.now += 20.0
    expected.hear(f"{ACCEPTED} backlash")  # a round as long as the one before
    assert expected.left_s == pytest.approx(20.0 + 1.0)
    expected.hear(FINAL)
    assert expected.left_s == pytest.approx(1.0)
    clock.now += 5.0
    assert expected.left_s == 0.0
    assert expected.words == ""  # longer than was certain: nobody knows how long
    assert expected.share == 1.0


def test_the_share_never_goes_back() -> None:
    clock = Clock()
    expected = Expected(clock)
    shares = []
    for sentence, took in (
        (READING, 1.0),
        (SEARCHING, 2.0),
        (BASE, 2.0),
        *((f"{ACCEPTED} {k}", 5.0 + k) for k in range(4)),
        (FINAL, 0.0),
    ):
        expected.hear(sentence)
        shares.append(expected.share or 0.0)
        clock.now += took
        shares.append(expected.share or 0.0)
    assert shares == sorted(shares)
    assert 0.0 < shares[5] < 0.9 < shares[-1] < 1.0


def test_an_identification_says_every_stage() -> None:
    said: list[str] = []
    identify([Log.read(SESSION / "sine.csv.gz")], friction="coulomb", gravity="none", tell=said.append)
    stages = [one for one in said if one in (READING, SEARCHING, BASE, FINAL)]
    assert stages == [READING, SEARCHING, BASE, FINAL]


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(0.6, "1 s"), (119.0, "119 s"), (121.0, "2 min"), (7100.0, "118 min"), (19_800.0, "5.5 h")],
)
def test_a_time_is_told_as_a_person_counts_it(seconds: float, words: str) -> None:
    assert spoken(seconds) == words


@pytest.mark.parametrize(("share", "left"), [(0.09, None), (0.11, 81.0)])
def test_a_slow_start_is_not_the_pace(share: float, left: float | None) -> None:
    """The first figure of a report loads what all of them need."""
    clock = Clock()
    pace = Pace(clock)
    clock.now += 10.0
    pace.at(share)
    assert pace.left_s == (left if left is None else pytest.approx(left, rel=0.01))
    clock.now += 1.0
    pace.at(0.19)
    assert pace.left_s == pytest.approx(8.1 if left is None else 46.9, rel=0.01)


def test_a_pace_counts_down_while_no_news_comes() -> None:
    clock = Clock()
    pace = Pace(clock)
    assert pace.left_s is None
    clock.now += 40.0
    pace.at(0.25)
    assert pace.left_s == pytest.approx(120.0)
    clock.now += 100.0
    assert pace.left_s == pytest.approx(20.0)
    assert pace.words == "20 s left"
    clock.now += 100.0
    assert (pace.left_s, pace.words) == (0.0, "")
    pace.at(0.5)  # later than it looked
    assert pace.left_s == pytest.approx(240.0)
    assert pace.words == "4 min left"
    pace.at(0.4)
    assert (pace.share, pace.left_s) == (0.5, pytest.approx(240.0))
