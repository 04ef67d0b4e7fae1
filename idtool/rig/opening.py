"""From a word on the command line to a rig.

sim:paper                       a simulated rig that comes with the package
sim:my_plant.toml               one of your own
sim:paper,sensors=dynamixel     with other sensors
replay:sweep.csv                a log played back
dynamixel:/dev/ttyUSB0,id=1     a servo on a bus; options as in `dynamixel.settings`
"""

from __future__ import annotations

from pathlib import Path

from idtool.errors import InputError, misspelt, nearest
from idtool.rig.base import Rig
from idtool.rig.plant_file import PlantFile, check_sensors, read_plant_file

_FOLDER = Path(__file__).parent
_KINDS = ("sim", "dynamixel", "replay")


def named_rigs() -> dict[str, str]:
    """The rigs that come with the package: name as `open_rig` takes it, and one line about each."""
    return {f"sim:{path.stem}": read_plant_file(path).description for path in sorted(_FOLDER.glob("*.toml"))}


def open_rig(spec: str, *, seed: int = 0) -> Rig:
    """Open a rig.

    Args:
        spec: see the head of this module.
        seed: of a simulation; the same seed gives the same readings.

    Raises:
        InputError: the word, an option or the plant file is wrong.
        RigFault: the rig cannot be reached.
    """
    head, *rest = spec.split(",")
    kind, colon, target = head.partition(":")
    if kind not in _KINDS or not colon or not target:
        if target and (wrong := misspelt(_KINDS, [kind])):
            raise InputError(f'unknown rig "{spec}"', remedy=f'did you mean "{wrong[1]}:{target}"')
        known = [*named_rigs(), "sim:FILE.toml", "dynamixel:DEVICE", "replay:LOG"]
        raise InputError(f'unknown rig "{spec}"', remedy=nearest(head, known))
    if kind == "dynamixel":
        return _dynamixel(target, rest, spec)
    if kind == "replay":
        from idtool.rig.replay import ReplayRig

        return ReplayRig(spec.partition(":")[2])
    options = _options(rest, ("sensors",), spec)
    sensors = check_sensors(options["sensors"]) if "sensors" in options else None
    file = read_plant(target)
    from idtool.rig.simulated import SimulatedRig  # the compiled plant loads here, not at start-up

    return SimulatedRig(file, seed=seed, sensors=sensors)


def _dynamixel(device: str, words: list[str], spec: str) -> Rig:
    from idtool.rig.dynamixel.rig import DynamixelRig
    from idtool.rig.dynamixel.settings import OPTIONS, Settings

    return DynamixelRig(device, Settings.read(_options(words, OPTIONS, spec)))


def read_plant(target: str) -> PlantFile:
    """The plant of a named rig ("paper"), or of a file.

    Raises:
        InputError: no such rig, or the file is none.
    """
    if target.endswith(".toml"):
        return read_plant_file(target)
    path = _FOLDER / f"{target}.toml"
    names = [name.removeprefix("sim:") for name in named_rigs()]
    if target not in names:
        raise InputError(f'unknown simulated rig "{target}"', remedy=nearest(target, names))
    return read_plant_file(path)


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
