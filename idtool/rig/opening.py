"""From a word on the command line to a rig.

sim:paper                       a simulated rig that comes with the package
sim:my_plant.toml               one of your own
sim:result/params.toml          what was identified, effects included (`identified`)
sim:paper,sensors=dynamixel     with other sensors
replay:sweep.csv                a log played back
dynamixel:/dev/ttyUSB0,id=1     a servo on a bus; options as in `bus.settings`
feetech:/dev/ttyACM0,id=1       likewise
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from idtool.errors import InputError, UnknownNameError, in_file, misspelt, nearest
from idtool.io.entry_points import load, outside
from idtool.io.read_file import read_bytes
from idtool.io.toml import MOST_BYTES
from idtool.rig.base import Rig
from idtool.rig.bus.settings import OPTIONS, Settings
from idtool.rig.plant_file import PlantFile, check_sensors, read_plant_file

_FOLDER = Path(__file__).parent
#: By which a parameter file is told from a plant file.
PARAMETER_SCHEMA = re.compile(rb'^schema *= *["\']ffc-id/params/', re.MULTILINE)
#: The entry points by which other packages add kinds of rigs.
GROUP = "ffc_id.rigs"


@dataclass(frozen=True)
class RigKind:
    """What the word before the colon of a rig stands for.

    Attributes:
        form: as a person writes it, "sim:FILE.toml".
        description: a line for `ffc-id rigs`.
        open: what follows the colon, the options and a seed -> the rig; raises InputError or RigFault.
        options: keys that may follow after a comma; None where a comma is a part of what follows the colon.
    """

    form: str
    description: str
    open: Callable[[str, Mapping[str, str], int], Rig]
    options: tuple[str, ...] | None = ()


def named_rigs() -> dict[str, str]:
    """The rigs that come with the package: name as `open_rig` takes it, and one line about each."""
    return {f"sim:{path.stem}": read_plant_file(path).description for path in sorted(_FOLDER.glob("*.toml"))}


def forms() -> dict[str, str]:
    """What `open_rig` takes besides: form, and one line about it. Those of other packages come last."""
    kinds = (*_KINDS.values(), *map(_from_outside, outside(GROUP, _KINDS)))
    return {kind.form: kind.description for kind in kinds}


def open_rig(spec: str, *, seed: int = 0) -> Rig:
    """Open a rig.

    Args:
        spec: see the head of this module.
        seed: of a simulation; the same seed gives the same readings.

    Raises:
        InputError: the word, an option or the plant file is wrong.
        RigFault: the rig cannot be reached.
    """
    word, _, rest = spec.partition(":")
    names = (*_KINDS, *outside(GROUP, _KINDS))
    if word not in names or not rest.partition(",")[0]:
        target = rest.partition(",")[0]
        if target and (wrong := misspelt(names, [word])):
            raise UnknownNameError(f'unknown rig "{spec}"', remedy=f'did you mean "{wrong[1]}:{target}"')
        raise UnknownNameError(
            f'unknown rig "{spec}"', remedy=nearest(spec.partition(",")[0], [*named_rigs(), *forms()])
        )
    kind = _KINDS.get(word) or _from_outside(word)
    if kind.options is None:
        return kind.open(rest, {}, seed)
    target, *parts = rest.split(",")
    return kind.open(target, _options(parts, kind.options, spec), seed)


def _from_outside(word: str) -> RigKind:
    return load(GROUP, word, RigKind)


def _simulated(target: str, options: Mapping[str, str], seed: int) -> Rig:
    sensors = check_sensors(options["sensors"]) if "sensors" in options else None
    file = read_plant(target)
    from idtool.rig.simulated import SimulatedRig  # the compiled plant loads here, not at start-up

    return SimulatedRig(file, seed=seed, sensors=sensors)


def _dynamixel(device: str, options: Mapping[str, str], seed: int) -> Rig:
    from idtool.rig.bus.rig import ServoRig
    from idtool.rig.dynamixel.servo import DYNAMIXEL

    return ServoRig(device, Settings.read(options), DYNAMIXEL)


def _feetech(device: str, options: Mapping[str, str], seed: int) -> Rig:
    from idtool.rig.bus.rig import ServoRig
    from idtool.rig.feetech.servo import FEETECH

    return ServoRig(device, Settings.read(options), FEETECH)


def _replay(log: str, options: Mapping[str, str], seed: int) -> Rig:
    from idtool.rig.replay import ReplayRig

    return ReplayRig(log)


_KINDS = {
    "sim": RigKind(
        "sim:FILE.toml",
        "a simulated axis of your own, with any effect, or a parameter file (see docs/rigs.md)",
        _simulated,
        ("sensors",),
    ),
    "dynamixel": RigKind(
        "dynamixel:DEVICE[,id=N]", "a DYNAMIXEL servo on a bus (see docs/hardware.md)", _dynamixel, OPTIONS
    ),
    "feetech": RigKind(
        "feetech:DEVICE[,id=N]",
        "a Feetech STS or SMS servo on a bus (see docs/hardware.md)",
        _feetech,
        OPTIONS,
    ),
    "replay": RigKind("replay:LOG", "a log played back", _replay, None),
}


def read_plant(target: str) -> PlantFile:
    """The plant of a named rig ("paper"), or of a file.

    Raises:
        InputError: no such rig, or the file is none.
    """
    if target.endswith(".toml"):
        return _plant_or_parameters(Path(target))
    names = [name.removeprefix("sim:") for name in named_rigs()]
    if target not in names:
        raise UnknownNameError(f'unknown simulated rig "{target}"', remedy=nearest(target, names))
    return read_plant_file(_FOLDER / f"{target}.toml")


def _plant_or_parameters(file: Path) -> PlantFile:
    """A plant file, or a parameter file, which says so in its schema."""
    content, _ = read_bytes(file, what="a plant file", limit=MOST_BYTES)
    if PARAMETER_SCHEMA.search(content) is None:
        return read_plant_file(file)
    from idtool.parameters import Parameters
    from idtool.rig.identified import plant_of

    parameters = Parameters.read(file)
    with in_file(file):
        return plant_of(parameters, file)


def _options(parts: list[str], known: tuple[str, ...], spec: str) -> dict[str, str]:
    options: dict[str, str] = {}
    for part in parts:
        key, equals, value = part.partition("=")
        if key not in known:
            raise InputError(f'unknown option "{key}" of rig "{spec}"', remedy=nearest(key, known))
        if not equals or not value or key in options:
            raise InputError(
                f'option "{part}" of rig "{spec}" is not one key=value', remedy=f"write {key}=VALUE"
            )
        options[key] = value
    return options
