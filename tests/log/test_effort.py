"""What stands for the torque where nobody measured the motor's current."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, InputError, Log
from idtool.log.effort import DRIVE_OFF, DUTY_FULL, DUTY_SMALL, effort_of
from idtool.signals import record

_ROWS = 400
_TIME = np.arange(_ROWS) * 0.01
_DUTY = 0.4 * np.sin(_TIME)


def log(axis: Axis | None = None, **columns: Sequence[float] | np.ndarray) -> Log:
    frame = {"trial": 0, "time_s": _TIME, "position_rad": np.sin(2 * _TIME), **columns}
    return Log(pd.DataFrame(frame), axis or Axis())


SUPPLY = np.linspace(12.0, 11.0, _ROWS)


@pytest.mark.parametrize(
    ("axis", "columns", "unit", "expected"),
    [
        (Axis("rotary", 2.0), {"torque_nm": _DUTY, "current_a": _DUTY}, "torque", _DUTY),
        (Axis("rotary", 2.0), {"current_a": _DUTY}, "torque", 2.0 * _DUTY),
        (Axis(), {"current_a": _DUTY}, "current", _DUTY),
        (Axis("rotary", 2.0), {"bus_current_a": _DUTY**2, "duty": _DUTY}, "torque", 2.0 * _DUTY),
        (Axis(), {"bus_current_a": _DUTY**2, "duty": _DUTY}, "current", _DUTY),
        (Axis(), {"duty": _DUTY, "supply_voltage_v": SUPPLY}, "voltage", _DUTY * SUPPLY),
        (
            Axis(torque_per_volt=0.1),
            {"duty": _DUTY, "supply_voltage_v": SUPPLY},
            "torque",
            0.1 * _DUTY * SUPPLY,
        ),
        # a constant decides between two that are there
        (
            Axis(torque_per_volt=0.1),
            {"current_a": _DUTY, "duty": _DUTY, "supply_voltage_v": SUPPLY},
            "torque",
            0.1 * _DUTY * SUPPLY,
        ),
    ],
    ids=[
        "torque",
        "current",
        "current, no K",
        "supply",
        "supply, no K",
        "volts",
        "torque per volt",
        "chosen",
    ],
)
def test_the_first_whose_constant_is_known(
    axis: Axis, columns: dict[str, np.ndarray], unit: str, expected: np.ndarray
) -> None:
    effort = effort_of(log(axis, **columns))
    assert effort.unit == unit
    fit = ~effort.unfit.get(DUTY_SMALL, np.zeros(_ROWS, dtype=bool))
    np.testing.assert_allclose(effort.values[fit], expected[fit], rtol=1e-9, atol=1e-12)


def test_rows_that_say_nothing_of_friction_are_named() -> None:
    on = np.ones(_ROWS)
    on[100:200] = 0
    duty = np.clip(3.0 * np.sin(3 * _TIME), -1.0, 1.0)
    effort = effort_of(log(duty=duty, supply_voltage_v=SUPPLY, drive_on=on))
    assert effort.unfit[DRIVE_OFF][99:201].all()
    assert not effort.unfit[DRIVE_OFF][:99].any()
    np.testing.assert_array_equal(effort.unfit[DUTY_FULL], np.abs(duty) >= 0.995)
    assert (effort.values[100:200] == 0.0).all()
    recording = record([log(duty=duty, supply_voltage_v=SUPPLY, drive_on=on)])
    assert not recording.usable[np.abs(duty) == 1.0].any()
    assert not recording.usable[100:200].any()
    assert DRIVE_OFF in recording.lost


def test_a_duty_below_full_that_the_drive_caps_is_saturated_too() -> None:
    noise = np.random.default_rng(0).normal(size=_ROWS)
    duty = np.clip(1.5 * np.sin(3 * _TIME) + 0.02 * noise, -0.8, 0.8)
    effort = effort_of(log(duty=duty, supply_voltage_v=SUPPLY))
    assert effort.unfit[DUTY_FULL][np.abs(duty) == 0.8].all()


def test_the_back_emf_brakes_where_the_resistance_is_known() -> None:
    axis = Axis("rotary", 0.5, resistance=2.0)  # K / R = 0.25 N m/V, K^2 / R = 0.125 N m s/rad
    volts = 12.0 * _DUTY
    split = record([log(axis, duty=_DUTY, supply_voltage_v=np.full(_ROWS, 12.0))])
    whole = record([log(Axis(torque_per_volt=0.25), duty=_DUTY, supply_voltage_v=np.full(_ROWS, 12.0))])
    np.testing.assert_allclose(whole.torque, 0.25 * volts, atol=1e-12)
    np.testing.assert_allclose(split.torque, 0.25 * volts, atol=1e-12)
    np.testing.assert_allclose(split.motion.braking, 0.125 * split.motion.velocity, atol=1e-12)
    assert not whole.motion.braking.any()


BAD = {
    "per cent": ("duty,supply_voltage_v", "40,12", 'line 2: column "duty" holds 40, not a share'),
    "counts": ("duty,supply_voltage_v", "-885,12", 'line 2: column "duty" holds -885, not a share'),
    "no duty": ("bus_current_a", "0.4", 'column "bus_current_a" is the current of the supply'),
    "no supply": ("duty", "0.4", 'column "duty" says nothing of the motor without'),
    "millivolts": (
        "duty,supply_voltage_v",
        "0.4,7400",
        'column "supply_voltage_v" holds 7400, not the voltage',
    ),
    "drive half on": ("current_a,drive_on", "0.4,0.5", 'line 2: column "drive_on" holds 0.5, not 0 (off)'),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_sentence(tmp_path: Path, case: str) -> None:
    names, row, expected = BAD[case]
    file = tmp_path / "log.csv"
    file.write_text(f"time_s,position_rad,{names}\n0,0,{row}\n1,1,{row}\n")
    with pytest.raises(InputError) as caught:
        Log.read(file)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_supply_of_nothing_is_said_of_the_supply() -> None:
    with pytest.raises(InputError, match='column "supply_voltage_v" is 0'):
        effort_of(log(duty=_DUTY, supply_voltage_v=np.zeros(_ROWS)))


def test_logs_of_two_quantities_are_no_one_fit() -> None:
    volts = log(duty=_DUTY, supply_voltage_v=SUPPLY)
    with pytest.raises(InputError, match=r"gives a current .* and log a voltage"):
        record([volts, log(current_a=_DUTY)])


def test_a_supply_read_within_the_cycle_of_the_bridge_counts_as_its_sag() -> None:
    time = np.arange(0.0, 5.0, 0.005)
    duty = 0.6 * np.sin(2.0 * time)
    sag = 7.4 - 0.5 * duty**2
    frame = pd.DataFrame({"trial": 0, "time_s": time, "position_rad": np.sin(time), "duty": duty})
    ripple = np.abs(duty) * np.where(np.random.default_rng(0).random(len(time)) < 0.5, 1.0, -1.0)
    log = Log(frame.assign(supply_voltage_v=sag + ripple), Axis())
    assert np.abs(effort_of(log).values - duty * sag).max() < 0.06
    slow = Log(frame.assign(supply_voltage_v=sag + 0.3 * np.sin(time)), Axis())
    assert effort_of(slow).values == pytest.approx(duty * (sag + 0.3 * np.sin(time)))


def test_a_duty_of_nothing_is_the_same_on_every_row() -> None:
    with pytest.raises(InputError, match='column "duty" is the same on every row'):
        effort_of(log(duty=np.zeros(_ROWS), supply_voltage_v=SUPPLY))


def test_an_effort_of_the_wrong_sign_is_named_by_its_column() -> None:
    time = np.arange(1200) * 0.01
    swing, speed = np.sin(0.6 * time), 0.6 * np.cos(0.6 * time)
    torque = swing + 0.3 * np.sign(speed) + 0.3 * speed
    noise = np.random.default_rng(0).normal(0.0, 3e-3, (2, len(time)))
    frame = {"trial": 0, "time_s": time, "position_rad": swing + 0.03 * noise[0]}
    duty = noise[1] - 0.3 * torque
    by_voltage = pd.DataFrame(frame | {"duty": duty, "supply_voltage_v": 7.4 + 0.0 * time})
    (said,) = record([Log(by_voltage, Axis())]).wiring[0]
    assert '"duty" or the position is inverted (`ffc-id import --unit duty=-` turns it round' in said
    by_bus = pd.DataFrame(frame | {"duty": 0.0 * time - 0.5, "bus_current_a": -0.5 * duty})
    (said,) = record([Log(by_bus, Axis())]).wiring[0]
    assert "`ffc-id import --unit bus_current=-` turns it round" in said


def test_a_log_of_an_axis_that_stands_still_says_so() -> None:
    noise = np.random.default_rng(0).normal(0.0, 1e-4, (2, _ROWS))
    columns = {"duty": 0.2 + noise[0], "supply_voltage_v": 12.0 + 0.0 * _TIME, "position_rad": 0.3 + noise[1]}
    with pytest.raises(InputError, match="nothing moves"):
        _ = record([log(**columns)]).operator


def test_below_a_twentieth_the_supply_s_current_tells_nothing() -> None:
    duty = np.linspace(-0.2, 0.2, _ROWS)
    unfit = effort_of(log(Axis("rotary", 2.0), bus_current_a=duty**2, duty=duty)).unfit[DUTY_SMALL]
    np.testing.assert_array_equal(unfit, np.abs(duty) < 0.05)
