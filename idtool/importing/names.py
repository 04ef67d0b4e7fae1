"""What a column of somebody else's recording means, by its name and the unit in it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from idtool.errors import InputError, UsageError, nearest, sentence
from idtool.importing.conversion import Unit, is_unit, named_unit
from idtool.log.format import columns_of
from idtool.model.units import Kind


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: role -> names of it, without marks, units and the words below
_ALIASES: dict[str, str] = {
    "trial": "trial trialid run runid repetition rep episode experimentid",
    "time": "time t timestamp timestamps stamp seconds sec elapsed elapsedtime clock",
    "position": "position pos q qm qpos angle theta phi encoder displacement travel",
    "velocity": "velocity vel speed dq qdot qvel dqdt omega angularvelocity w rpm",
    "current": "current cur curr i iq amps amperage",
    "torque": "torque tau effort moment trq force thrust",
    "payload": "payload payloadmass",
    "tilt_alpha": "tiltalpha",
    "tilt_beta": "tiltbeta",
    "temperature": "temperature temp",
    "supply_voltage": "supplyvoltage voltage vbus busvoltage vin inputvoltage inputvolts vdc",
    "bus_current": "buscurrent supplycurrent inputcurrent ibus idc batterycurrent",
    "duty": "duty dutycycle pwm presentpwm pwmduty",
    "drive_on": "driveon torqueenable torqueenabled enabled",
}
_ROLE_OF = {alias: role for role, aliases in _ALIASES.items() for alias in aliases.split()}
#: Names that mean a command by themselves.
_COMMAND_ALIASES = {"qg": "position", "qref": "position", "qdes": "position", "qcmd": "position"}
_COMMAND_WORDS = _words(
    "cmd command commands commanded ref reference des desired target goal setpoint sp demand nominal"
)
_MEASURED_WORDS = _words(
    "meas measured actual act present feedback fb value motor mot joint jnt axis shaft "
    "mos winding coil estimated"
)
_LINEAR_NAMES = frozenset(("force", "thrust", "displacement", "travel"))
#: A quantity and the unit in brackets behind it.
_BRACKET = re.compile(r"^(.*?)[\s_]*[\[(]\s*([^\])]+?)\s*[\])]\s*$")
#: Roles whose choice decides the result; two candidates for one of these are never guessed between.
NEEDED = ("time", "position", "velocity", "current", "torque", "bus_current", "duty")
#: Roles that a unit tells where a name says nothing.
_TOLD_BY_UNIT = ("time", "position", "velocity", "current", "torque")
#: Words of a column that has the unit of one of these and is not what the axis does.
_OTHER_WORDS = _words("error err deviation lag residual limit max min offset threshold hand external ext")
#: A rate is written with a mark: m/s is no ms, turn/s no turns.
_RATE = re.compile(r"[/_·*^]|per|\s")


@dataclass(frozen=True)
class Meaning:
    """What a column's name says.

    Attributes:
        source: the column.
        role: a role of `columns_of`.
        unit: the unit in the name, as spelt there; "" if none.
        commanded: a set value, not a measured one.
        linear: the word itself belongs to a linear axis ("force").
        by_unit: the name says nothing, its unit alone tells the role.
    """

    source: str
    role: str
    unit: str = ""
    commanded: bool = False
    linear: bool = False
    by_unit: bool = False


@dataclass(frozen=True)
class Taken:
    """One column of the log and where it came from.

    Attributes:
        column: its name in the log.
        role: its role.
        source: its name in the recording.
        unit: the unit it had there.
        why: "given" (by an option), "named" (the name says all), "presumed" (the unit is a guess) or "unit"
            (the unit alone tells what it is).
        commanded: the recording holds no measured value; this is the commanded one.
    """

    column: str
    role: str
    source: str
    unit: Unit
    why: str
    commanded: bool = False


def meaning(name: str) -> Meaning | None:
    """What a column's name says, or None if it says nothing we know.

    >>> meaning("motorSpeed [rpm]").role, meaning("tau_cmd").commanded
    ('velocity', True)
    """
    for base, unit in _splits(name):
        found = _classify(base)
        if found is None:
            continue
        role, commanded, linear = found
        if not unit or is_unit(unit, role):
            return Meaning(name, role, unit, commanded, linear)
    return None


def meaning_by_unit(name: str, stated: str = "") -> Meaning | None:
    """What the unit of a column says where its name says nothing; None where it says nothing either.

    Args:
        name: of the column; a unit in brackets at its end is taken.
        stated: the unit that the recording states beside its name, "" if none.

    >>> meaning_by_unit("Weg [mm]").role, meaning_by_unit("Zeit", "ms").role, meaning_by_unit("x", "m/s").role
    ('position', 'time', 'velocity')
    """
    bracket = _BRACKET.match(name)
    base, unit = (bracket[1], bracket[2]) if bracket else (name, stated)
    if not unit or set(_words_of(base)) & (_COMMAND_WORDS | _OTHER_WORDS):
        return None
    roles = [role for role in _TOLD_BY_UNIT if is_unit(unit, role)]
    if len(roles) > 1:
        roles = [role for role in roles if (role == "velocity") == bool(_RATE.search(unit))]
    return Meaning(name, roles[0], unit, by_unit=True) if len(roles) == 1 else None


def passed_by(names: Sequence[str], kind: Kind) -> dict[str, str]:
    """Columns that tell what a log has no column for, and that its reader passes by for their name or unit.

    Returns:
        Their names, and those that they have after an import.

    >>> passed_by(["time_s", "position_deg", "note"], "rotary")
    {'position_deg': 'position_rad'}
    """
    known = columns_of(kind)
    said = ((name, meaning(name)) for name in names if name not in known.values())
    return {
        name: known[what.role]
        for name, what in said
        if what is not None and not what.commanded and known[what.role] not in names
    }


def unit_at_end(name: str, role: str) -> str:
    """The unit of a role that a column's name ends in, whatever the rest of it says; "" if none.

    >>> unit_at_end("cur_mA", "current"), unit_at_end("x12", "current")
    ('mA', '')
    """
    return next((unit for _, unit in _splits(name) if unit and is_unit(unit, role)), "")


def _splits(name: str) -> Iterator[tuple[str, str]]:
    """Every way to split a name into a quantity and a unit, the longest unit first."""
    if bracket := _BRACKET.match(name):
        yield bracket[1], bracket[2]
        return
    parts = [part for part in re.split(r"[_\s.\-/:]+", name) if part]
    for count in range(min(4, len(parts) - 1), 0, -1):
        yield "_".join(parts[:-count]), "_".join(parts[-count:])
    if parts and parts[-1].lower() == "rpm":  # a unit that is a quantity too
        yield "_".join(parts), "rpm"
    yield name, ""


def _words_of(base: str) -> list[str]:
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", base)]


def _classify(base: str) -> tuple[str, bool, bool] | None:
    words = _words_of(base)
    commanded = any(word in _COMMAND_WORDS for word in words)
    rest = [word for word in words if word not in _COMMAND_WORDS]
    for kept in (rest, [word for word in rest if word not in _MEASURED_WORDS and word not in ("m", "raw")]):
        joined = "".join(kept)
        if joined in _COMMAND_ALIASES:
            return _COMMAND_ALIASES[joined], True, False
        if joined in _ROLE_OF:
            return _ROLE_OF[joined], commanded, joined in _LINEAR_NAMES
    return None


def role_of(text: str) -> tuple[str, Kind | None]:
    """The role that the left side of an option names, itself or by a column, and the kind it implies.

    Raises:
        UsageError: neither a role nor a column of a log.
    """
    rotary, linear = columns_of("rotary"), columns_of("linear")
    name = "torque" if text == "force" else text
    if name in rotary:
        return name, "linear" if text == "force" else None
    for kind, columns in (("rotary", rotary), ("linear", linear)):
        for role, column in columns.items():
            if column == text:
                alike = rotary[role] == linear[role]
                return role, None if alike else "linear" if kind == "linear" else "rotary"
    if text.lower() in _ROLE_OF:
        return _ROLE_OF[text.lower()], None
    advice = nearest(text, {*rotary, *rotary.values(), *linear.values()})
    if not advice.startswith("did you mean"):
        advice = f"name {', '.join(rotary)}"
    raise UsageError(sentence(f'"{text}" is no column of a log', advice))


def check_kind(chosen: Iterable[Meaning], kind: Kind) -> None:
    """Refuse a column that an option names though the unit in its name is of the other kind of axis.

    Raises:
        InputError: naming the column.
    """
    for item in chosen:
        if item.unit and not named_unit(item.unit, item.role, kind):
            raise InputError(
                f'"{item.source}" is in {item.unit}, no unit of {item.role} on a {kind} axis',
                remedy="choose columns of one kind, and check --map and --kind",
            )


def choose_kind(meanings: Iterable[Meaning], stated: Mapping[str, Kind]) -> Kind:
    """Rotary or linear: as an option states, else as units and words tell, else rotary.

    Args:
        meanings: the columns that may be taken.
        stated: what in the options implies a kind -> that kind.

    Raises:
        UsageError: options that contradict each other.
        InputError: units of both kinds.
    """
    if len(set(stated.values())) > 1:
        texts = " and ".join(f"{text} ({kind})" for text, kind in stated.items())
        raise UsageError(f"{texts} do not fit one axis; name columns of one kind.")
    if stated:
        return next(iter(stated.values()))
    hints: dict[Kind, str] = {}
    for item in meanings:
        if item.role in ("position", "velocity", "torque"):
            fits: list[Kind] = [
                k for k in ("rotary", "linear") if item.unit and named_unit(item.unit, item.role, k)
            ]
            if len(fits) == 1:
                hints.setdefault(fits[0], item.source)
            elif item.linear:
                hints.setdefault("linear", item.source)
    if len(hints) == 2:
        raise InputError(
            f'"{hints["rotary"]}" belongs to a rotary axis and "{hints["linear"]}" to a linear one',
            remedy="choose with --kind rotary or --kind linear",
        )
    return next(iter(hints), "rotary")


def choose(meanings: Iterable[Meaning], role: str, kind: Kind) -> Meaning | None:
    """The column taken for a role, or None where no column is it.

    Raises:
        InputError: two columns are equally good for a role that decides the result.
    """
    column = columns_of(kind)[role]
    fitting = [m for m in meanings if m.role == role and (not m.unit or named_unit(m.unit, role, kind))]
    exact = [m for m in fitting if m.source == column]
    fitting = exact or fitting
    if len(fitting) < 2:
        return fitting[0] if fitting else None
    if role not in NEEDED:
        return None
    names = ", ".join(f'"{m.source}"' for m in fitting[:4])
    raise InputError(
        f"columns {names} may all be the {role}", remedy=f"choose with --map {column}={fitting[0].source}"
    )


def as_command(item: Meaning) -> Meaning:
    """A commanded position or velocity under the role that a log has for it."""
    return replace(item, role=f"{item.role}_command") if item.role in ("position", "velocity") else item
