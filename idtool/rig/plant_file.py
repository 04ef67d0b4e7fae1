"""The TOML file of a simulated rig, read strictly: an unknown or missing key is an error.

description = "one line for a person"      # never a number of the truth
period_s = 0.005
sensors = "lab"                            # or "dynamixel", "ideal"
[axis]        kind = "rotary", torque_constant_nm_per_a
[plant]       inertia_kg_m2
[gravity]     kind = "slide": base_nm, per_payload_nm_per_kg
              kind = "arm": sine_nm, cosine_nm, and the same two per kg of payload
[friction]    coulomb_nm, static_nm, stribeck_velocity_rad_s, viscous_nm_s_per_rad,
              bristle_stiffness_nm_per_rad, bristle_damping_nm_s_per_rad
[limits]      lowest_rad, highest_rad, speed_rad_s, current_a
[drive]       optional, see `Drive`
[motor]       optional: supply_v, resistance_ohm, supply_resistance_ohm, for sensors that read the duty
[temperature] optional: ambient_degc, rise_k, time_constant_s, sensor
[[effects]]   any number: name, and its numbers as in `EFFECT_KEYS`
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from idtool.errors import InputError, in_file, nearest
from idtool.io.tables import finite, no_strangers, table_at
from idtool.io.toml import is_finite, load_toml, short
from idtool.parameters.axis import Axis
from idtool.parameters.older_files import renamed
from idtool.rig.sensors import SENSORS, Motor

#: Integration step of the plant, s. It stands here because reading a file must not load the compiler.
STEP_S = 1e-4

#: Keys of each effect; None is required, a number is the default.
EFFECT_KEYS: dict[str, dict[str, float | None]] = {
    "inertia": {"inertia_kg_m2": None, "per_payload_m2": 0.0},
    "torque_offset": {"offset_nm": None},
    "direction_asymmetry": {"asymmetry_nm_s_per_rad": None},
    "load_dependent_friction": {"mu": None},
    "drive_backdrive": {"mu_drive": None, "mu_backdrive": None},
    "position_ripple": {
        "cycles_per_turn": None,
        "amplitude_1_nm": None,
        "phase_1_rad": 0.0,
        "amplitude_2_nm": 0.0,
        "phase_2_rad": 0.0,
    },
    "position_dependent_friction": {
        "slope_1": None,
        "slope_2": 0.0,
        "center_rad": 0.0,
        "half_stroke_rad": None,
    },
    "position_stiffness": {"stiffness_nm_per_rad": None, "neutral_rad": 0.0},
    "thermal_drift": {"rate_per_k": None, "reference_degc": 25.0},
    "nonlinear_viscous": {"quadratic_nm_s2_per_rad2": None},
    "stribeck_shape": {"exponent": None},
    "backlash": {"gap_rad": None, "share_behind_gap": None},
    "hysteresis": {"stiffness_nm_per_rad": None, "yield_nm": None},
    "compliance": {"stiffness_nm_per_rad": None, "damping_nm_s_per_rad": 0.0, "load_inertia_kg_m2": None},
    "transport_delay": {"delay_s": None},
    "torque_constant_saturation": {"kappa_per_a": None},
    "external_periodic": {"frequency_hz": None, "amplitude_nm": None, "phase_rad": 0.0},
    "tilt_misalignment": {"alpha_rad": 0.0, "beta_rad": 0.0},
    "breakaway_dwell": {"gain": None, "time_constant_s": None},
}
#: Numbers of effects that must be above zero, and those that must not be below it.
_POSITIVE = {"half_stroke_rad", "exponent", "time_constant_s", "load_inertia_kg_m2", "yield_nm", "gap_rad"}
_NOT_NEGATIVE = {"inertia_kg_m2", "damping_nm_s_per_rad"}
#: Longest delay of a reading, s; the plant keeps 0.2 s of history.
_LONGEST_DELAY = 0.1

#: Numbers of the friction that are above zero, and those that are not below it.
_FRICTION_ABOVE = ("coulomb_nm", "static_nm", "stribeck_velocity_rad_s")
_FRICTION = ("viscous_nm_s_per_rad", "bristle_stiffness_nm_per_rad", "bristle_damping_nm_s_per_rad")
_GRAVITY: dict[str, dict[str, float | None]] = {
    "slide": {"base_nm": None, "per_payload_nm_per_kg": None},
    "arm": {
        "sine_nm": None,
        "cosine_nm": None,
        "sine_per_payload_nm_per_kg": 0.0,
        "cosine_per_payload_nm_per_kg": 0.0,
    },
}
_TOP = (
    "description", "period_s", "sensors", "axis", "plant", "gravity", "friction", "limits", "drive", "motor",
    "temperature", "effects",
)  # fmt: skip


@dataclass(frozen=True)
class Drive:
    """How stiffly the drive holds its axis; every number may stand in `[drive]`.

    Attributes:
        velocity_bandwidth_hz: of the velocity loop, on the bare inertia.
        position_gain_per_s: of the position loop; a sixth of the velocity loop's bandwidth, stiff enough
            for hand guiding to move as its equation says (to 3 %), slow enough to overshoot a step by
            no more than 5 %.
        velocity_profile_rad_s2: acceleration limit of velocity commands.
        position_profile_rad_s2: acceleration limit of position commands; high, so that a hand guiding
            controller can stop the axis at once.
    """

    velocity_bandwidth_hz: float = 20.0
    position_gain_per_s: float = 20.0
    velocity_profile_rad_s2: float = 8.0
    position_profile_rad_s2: float = 40.0


@dataclass(frozen=True)
class PlantFile:
    """A plant file, checked. The numbers keep the keys of the file."""

    description: str
    axis: Axis
    inertia: float
    gravity_kind: str
    gravity: dict[str, float]
    friction: dict[str, float]
    limits: dict[str, float]
    drive: Drive = field(default_factory=Drive)
    motor: Motor = field(default_factory=lambda: Motor(24.0, 10.0))
    temperature: dict[str, float] = field(default_factory=dict)
    temperature_sensor: bool = False
    effects: dict[str, dict[str, float]] = field(default_factory=dict)
    period_s: float = 0.005
    sensors: str = "lab"


def read_plant_file(path: str | Path) -> PlantFile:
    """Read and check a plant file.

    Raises:
        InputError: it names the file and the key.
    """
    file = Path(path)
    return parse_plant(load_toml(file, what="a plant file", made_by="docs/rigs.md"), file)


def parse_plant(table: dict[str, Any], file: Path) -> PlantFile:
    """Check a plant file's table."""
    with in_file(file):
        return _plant(table, f"a simulated axis ({file.stem})")


def _plant(table: dict[str, Any], usual: str) -> PlantFile:
    no_strangers(table, _TOP, "")
    axis_table = _table(table, "axis")
    no_strangers(axis_table, ("kind", "torque_constant_nm_per_a", "force_constant_n_per_a"), "axis.")
    axis = Axis.from_table(axis_table)
    if axis.kind != "rotary" or axis.torque_constant is None:
        raise InputError(
            "a simulated rig needs a rotary axis with its torque constant",
            place="axis.torque_constant_nm_per_a",
            remedy="state it at the shaft where the motor's current is a torque",
        )
    gravity = dict(_table(table, "gravity"))
    kind = gravity.pop("kind", "slide")
    if kind not in _GRAVITY:
        raise InputError(
            f"unknown kind of gravity {short(kind)}",
            place="gravity.kind",
            remedy=nearest(str(kind), _GRAVITY),
        )
    wanted = dict.fromkeys((*_FRICTION_ABOVE, *_FRICTION))
    friction = _numbers(_table(table, "friction"), wanted, "friction.", _FRICTION_ABOVE, _FRICTION)
    wanted = dict.fromkeys(("lowest_rad", "highest_rad", "speed_rad_s", "current_a"))
    limits = _numbers(_table(table, "limits"), wanted, "limits.", ("speed_rad_s", "current_a"))
    if limits["lowest_rad"] >= limits["highest_rad"]:
        raise InputError("lowest_rad is not below highest_rad", place="limits", remedy="swap the two")
    plant = _numbers(_table(table, "plant"), {"inertia_kg_m2": None}, "plant.", ("inertia_kg_m2",))
    temperature, sensor = _temperature(table)
    effects = _effects(table.get("effects", []))
    _check_speed_of_effects(effects, plant["inertia_kg_m2"])
    return PlantFile(
        description=_description(table.get("description", usual)),
        axis=axis,
        inertia=plant["inertia_kg_m2"],
        gravity_kind=kind,
        gravity=_numbers(gravity, _GRAVITY[kind], "gravity."),
        friction=friction,
        limits=limits,
        drive=_drive(table),
        motor=_motor(table, axis.torque_constant, limits),
        temperature=temperature,
        temperature_sensor=sensor,
        effects=effects,
        period_s=_period(table.get("period_s", 0.005)),
        sensors=check_sensors(table.get("sensors", "lab")),
    )


def check_sensors(name: Any) -> str:
    """A known set of sensors.

    Raises:
        InputError: it is not known.
    """
    if name in SENSORS:
        return str(name)
    raise InputError(f"unknown sensors {short(name)}", place="sensors", remedy=nearest(str(name), SENSORS))


def _description(text: Any) -> str:
    if not isinstance(text, str) or "\n" in text:
        raise InputError("not one line of text", place="description", remedy="write one line")
    return text


def _period(value: Any) -> float:
    steps = value / STEP_S if is_finite(value) else 0.0
    if not 10.0 <= steps <= 1000.0 or abs(steps - round(steps)) > 1e-6:
        raise InputError(
            f"{short(value)} is no sampling period",
            place="period_s",
            remedy="give 0.001 to 0.1 s, in whole steps of 0.1 ms",
        )
    return float(value)


def _drive(table: dict[str, Any]) -> Drive:
    defaults: dict[str, float | None] = {item.name: float(item.default) for item in fields(Drive)}  # type: ignore[arg-type]
    return Drive(**_numbers(table_at(table.get("drive", {}), "drive"), defaults, "drive.", defaults))


#: Supply of a plant that names none, V, and the share of it that its highest current and speed together take.
_SUPPLY, _USED = 24.0, 0.9


def _motor(table: dict[str, Any], constant: float, limits: dict[str, float]) -> Motor:
    """The motor; one that the file does not describe has a winding that fits its limits."""
    given = table_at(table.get("motor", {}), "motor")
    supply = given.get("supply_v", _SUPPLY)
    supply = float(supply) if is_finite(supply) else _SUPPLY  # what is no number is named below
    left = max(_USED * supply - constant * limits["speed_rad_s"], (1.0 - _USED) * supply)
    defaults: dict[str, float | None] = {
        "supply_v": supply,
        "resistance_ohm": left / limits["current_a"],
        "supply_resistance_ohm": 0.0,
    }
    above, not_below = ("supply_v", "resistance_ohm"), ("supply_resistance_ohm",)
    return Motor(*_numbers(given, defaults, "motor.", above, not_below).values())


def _temperature(table: dict[str, Any]) -> tuple[dict[str, float], bool]:
    values = dict(table_at(table.get("temperature", {}), "temperature"))
    sensor = values.pop("sensor", False)
    if not isinstance(sensor, bool):
        raise InputError("not true or false", place="temperature.sensor", remedy="write true")
    defaults: dict[str, float | None] = {"ambient_degc": 25.0, "rise_k": 0.0, "time_constant_s": 900.0}
    return _numbers(values, defaults, "temperature.", ("time_constant_s",)), sensor


def _effects(entries: Any) -> dict[str, dict[str, float]]:
    if not isinstance(entries, list):
        raise InputError("not a list", place="effects", remedy="write each as [[effects]]")
    effects: dict[str, dict[str, float]] = {}
    for number, entry in enumerate(entries, start=1):
        values = renamed(entry) if isinstance(entry, dict) else {}
        name = values.pop("name", None)
        if name not in EFFECT_KEYS:
            raise InputError(
                f"unknown effect {short(name)}",
                place=f"effects[{number}].name",
                remedy=nearest(str(name), EFFECT_KEYS),
            )
        if name in effects:
            raise InputError(f"a second {name}", place=f"effects[{number}]", remedy="merge them")
        above = _POSITIVE | ({"stiffness_nm_per_rad"} if name == "compliance" else set())
        checked = _numbers(values, EFFECT_KEYS[name], f"{name}.", above, _NOT_NEGATIVE)
        if not 0.0 <= checked.get("delay_s", 0.0) <= _LONGEST_DELAY:
            raise InputError(
                f"{checked['delay_s']} s is no delay",
                place=f"{name}.delay_s",
                remedy=f"give 0 to {_LONGEST_DELAY} s",
            )
        effects[name] = checked
    return effects


def _check_speed_of_effects(effects: dict[str, dict[str, float]], inertia: float) -> None:
    """Refuse what is too fast for the plant's step, which would blow up instead of moving.

    A spring k and damper d between two inertias of reduced inertia m, advanced speed first and then
    position, is stable while k h^2 / m + 2 d h / m < 4 (half of that is allowed here).
    """
    if "compliance" in effects:
        c = effects["compliance"]
        motor = inertia + effects.get("inertia", {}).get("inertia_kg_m2", 0.0)
        reduced = 1.0 / (1.0 / motor + 1.0 / c["load_inertia_kg_m2"])
        pace = STEP_S * (c["stiffness_nm_per_rad"] * STEP_S + 2.0 * c["damping_nm_s_per_rad"]) / reduced
        if pace > 2.0:
            raise InputError(
                "the spring and damper are too stiff for their inertia to be simulated",
                place="compliance",
                remedy="lower stiffness_nm_per_rad or damping_nm_s_per_rad, or raise load_inertia_kg_m2",
            )
    dwell = effects.get("breakaway_dwell", {}).get("time_constant_s", 1.0)
    if dwell < 10.0 * STEP_S:
        raise InputError(
            f"{dwell:g} s is too short to be simulated",
            place="breakaway_dwell.time_constant_s",
            remedy=f"give {10.0 * STEP_S:g} s or more",
        )


def _table(table: dict[str, Any], name: str) -> Mapping[str, Any]:
    if name not in table:
        raise InputError("is missing", place=f"[{name}]", remedy=f"add [{name}]")
    return table_at(table[name], name)


def _numbers(
    table: Mapping[str, Any],
    wanted: dict[str, float | None],
    prefix: str,
    above_zero: Container[str] = (),
    not_below_zero: Container[str] = (),
) -> dict[str, float]:
    """The wanted keys of a table as finite numbers; nothing else may stand in it."""
    no_strangers(table, wanted, prefix)
    numbers = {}
    for key, default in wanted.items():
        value = table.get(key, default)
        if value is None:
            raise InputError("is missing", place=f"{prefix}{key}", remedy="add it, in SI units")
        numbers[key] = finite(value, f"{prefix}{key}")
    for key, number in numbers.items():
        if (low := key in above_zero and number <= 0.0) or (key in not_below_zero and number < 0.0):
            problem = f"{number:g} is {'not above' if low else 'below'} zero"
            raise InputError(problem, place=f"{prefix}{key}", remedy="correct it")
    return numbers
