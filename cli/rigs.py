"""`ffc-id rigs` and `ffc-id recipes`: what there is to run, and on what."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import click

from .common import Output, output_options
from .lazy import LazyGroup
from .moving import EXAMPLE_RIG
from .progress import Progress
from .words import complete_bundled

if TYPE_CHECKING:
    from .screen import Screen


@click.command()
@click.option(
    "--scan",
    is_flag=False,
    flag_value="",
    metavar="[DEVICE]",
    help="Look for servos on every USB serial port, or on this one.",
)
@output_options
def rigs(output: Output, scan: str | None) -> int:
    """List the rigs: simulated ones by name, a plant file of yours, a servo on a bus, a log.

    \b
    ffc-id rigs
    ffc-id rigs --scan                  which servos are there (some seconds a port)
    """
    from idtool.rig import forms, named_rigs

    if scan is not None:
        return _scan(scan, output)
    found = named_rigs()
    others = forms()

    output.result({"rigs": found, "forms": others}, lambda screen: _list(screen, {**found, **others}))
    output.next("run-sweep", "--rig", EXAMPLE_RIG, "-o", "sweep.csv")
    return 0


def _scan(device: str, output: Output) -> int:
    from idtool.errors import RigFault
    from idtool.rig.bus.scan import Found, scan
    from idtool.rig.scanners import ports, scanners

    devices = [device] if device else ports()
    if not devices:
        raise RigFault("there is no USB serial port; plug the adapter in, or name the device after --scan")
    servos: list[Found] = []
    faulty: set[str] = set()
    with Progress(output) as progress:
        for port, scanner in product(devices, scanners()):
            if port in faulty:
                continue
            for found in scan(port, scanner, progress=lambda what: progress.say(f"asking {what}")):
                if isinstance(found, RigFault):
                    faulty.add(port)
                    output.warn(str(found))
                else:
                    servos.append(found)
    document = [
        {"rig": s.spec, "device": s.device, "baud": s.baud, "id": s.id}
        | {"model_number": s.model_number, "model": s.model}
        for s in servos
    ]

    words = {s.spec: s.model or f"model number {s.model_number}, not known" for s in servos}
    output.result({"servos": document}, lambda screen: _list(screen, words))
    if not servos:
        raise RigFault(f"no servo answered on {', '.join(devices)}; check its power and its cable")
    return 0


#: Below so many columns names and what they are stand below each other.
_ROOM_FOR_TWO = 60

#: sub-command -> (module beside this one, function, help line)
COMMANDS: dict[str, tuple[str, str, str]] = {
    "list": ("rigs", "list_recipes", "List the bundled recipes."),
    "show": ("rigs", "show_recipe", "Print a bundled recipe."),
}


@click.command(cls=LazyGroup, commands_of=COMMANDS, invoke_without_command=True)
@click.option("--json", "as_json", is_flag=True, help="One JSON document on standard output.")
@click.pass_context
def recipes(ctx: click.Context, as_json: bool) -> None:
    """List the experiment recipes; `recipes show NAME` prints one to edit.

    \b
    ffc-id recipes show sweep > my-sweep.toml
    ffc-id run --recipe my-sweep.toml --rig sim:paper -o sweep.csv

    \b
    A [[trials]] table has a kind and its keys (m for rad where axis = "linear"):
      back_and_forth  speed_rad_s, travel_rad, and if need be repeats,
                      acceleration_rad_s2, dwell_s (rest before each way)
      sine            frequency_hz, amplitude_rad_s, duration_s
      multisine       frequencies_hz (a list), amplitude_rad_s, duration_s
    and, there or in [setup], payload_kg, tilt_alpha_rad, tilt_beta_rad,
    temperature_degc, rest_s. A list makes one trial of each of its values.
    """
    if ctx.invoked_subcommand is None:
        ctx.invoke(list_recipes, json=as_json)


@click.command("list")
@output_options
def list_recipes(output: Output) -> None:
    """List the bundled recipes.

    \b
    ffc-id recipes list --json
    """
    from idtool.experiment.recipe import recipe_names

    found = recipe_names()
    output.result({"recipes": found}, lambda screen: _list(screen, found))
    output.next("run", "--recipe", "sweep", "--rig", EXAMPLE_RIG, "-o", "sweep.csv")


@click.command("show")
@click.argument("name", shell_complete=complete_bundled)
def show_recipe(name: str) -> None:
    """Print a bundled recipe.

    \b
    ffc-id recipes show sweep > my-sweep.toml
    """
    from idtool.experiment.recipe import recipe_text

    click.echo(recipe_text(name), nl=False)


def _list(screen: Screen, found: dict[str, str]) -> None:
    if screen.width < _ROOM_FOR_TWO:
        for name, text in found.items():
            screen.print(name, bold=True)
            screen.print(f"  {text}", indent=2)
        return
    first = max(map(len, found), default=0) + 2
    for name, text in found.items():
        screen.print(f"{name.ljust(first)}{text}", indent=first)
