"""What the unit of a column says, and what a minus does to it."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool.errors import InputError
from idtool.importing import import_recording
from tests.importing.test_importing import put


@pytest.mark.parametrize(
    ("name", "mapping", "turned", "says"),
    [
        ("current [mA]", {}, -2e-3, "-mA"),
        ("x12_mA", {"current": "x12_mA"}, -2e-3, "-mA"),
        ("current", {}, -2.0, "-A"),
    ],
)
def test_a_minus_alone_turns_a_column_round_in_the_unit_that_it_has(
    tmp_path: Path, name: str, mapping: dict[str, str], turned: float, says: str
) -> None:
    """What `check` recommends for an inverted current read mA as A where it was a factor."""
    file = put(tmp_path, f"t_s,q_rad,{name}\n0,1,2\n0.01,1,3\n")
    imported = import_recording(file, mapping=mapping, units={"current": "-"})
    assert imported.log.frame["current_a"][0] == pytest.approx(turned)
    assert imported.taken[-1].unit.text == says


@pytest.mark.parametrize(
    ("names", "taken"),
    [
        ("Zeit [ms];Weg [mm];Rate [mm/s];Strom [A]", ["time_s", "position_m", "velocity_m_s", "current_a"]),
        ("t [s];x [mm];v [m/s];Kraft [N]", ["time_s", "position_m", "velocity_m_s", "force_n"]),
        ("clock [s];joint [deg];following error [deg];Strom [A]", ["time_s", "position_rad", "current_a"]),
        # a name goes before a unit, and a motion that is named says what kind of axis it is
        ("t [s];pos [deg];gap [mm];i [A]", ["time_s", "position_rad", "current_a"]),
        ("t [s];angle;gap [mm/s];i [A]", ["time_s", "position_rad", "current_a"]),
        ("t [s];x [mm];i [A];Kraft [N]", ["time_s", "position_m", "current_a"]),
    ],
)  # fmt: skip
def test_a_unit_tells_where_a_name_says_nothing(tmp_path: Path, names: str, taken: list[str]) -> None:
    imported = import_recording(put(tmp_path, names + "\n0;1;2;3\n0.01;1;3;4\n"))
    assert [item.column for item in imported.taken] == taken
    whys = dict.fromkeys(("t [s]", "clock [s]", "pos [deg]", "i [A]"), "named") | {"angle": "presumed"}
    assert all(item.why == whys.get(item.source, "unit") for item in imported.taken)


def test_a_unit_that_two_columns_have_tells_nothing_but_the_kind_of_axis(tmp_path: Path) -> None:
    file = put(tmp_path, "t [s];Soll [mm];Ist [mm];Strom [A];Kraft [N]\n0;1;2;3;4\n0.01;1;3;4;5\n")
    with pytest.raises(InputError) as refused:
        import_recording(file)
    assert "--map position_m=COLUMN or velocity_m_s=COLUMN, --map force_n=COLUMN or" in str(refused.value)


@pytest.mark.parametrize(
    ("more", "duty", "supply"),
    [("", [0.8, -0.4, 0.0], 7.5), (",supply_V", [0.5, -0.25, 0.0], 12.0)],
)
def test_a_voltage_at_the_motor_is_a_share_of_its_supply(
    tmp_path: Path, more: str, duty: list[float], supply: float
) -> None:
    """As a lab's amplifier or a drive in voltage mode logs it; a supply that nobody told is more than it."""
    volts = (6.0, -3.0, 0.0)
    rows = "\n".join(f"{k / 100},{k},{u}{',12' if more else ''}" for k, u in enumerate(volts))
    file = put(tmp_path, f"time_s,position_rad,u_V{more}\n{rows}\n")
    mapping = {"duty": "u_V"} | ({"supply_voltage": "supply_V"} if more else {})
    imported = import_recording(file, mapping=mapping)
    assert imported.log.frame["duty"].tolist() == pytest.approx(duty)
    assert imported.log.frame["supply_voltage_v"].tolist() == pytest.approx([supply] * 3)
    assert any("share of 7.5 V" in note for note in imported.notes) == (not more)


def test_a_log_with_a_voltage_alone_is_told_how(tmp_path: Path) -> None:
    file = put(tmp_path, "time_s,position_rad,u_V\n0,1,2\n0.01,1,3\n")
    with pytest.raises(InputError, match="or the motor's voltage with --map duty=COLUMN"):
        import_recording(file)
