"""`ffc-id data`: recordings to try the tool on."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from pathlib import Path

import click

from .common import PATH, Output, force_option, output_options
from .lazy import LazyGroup
from .progress import Progress

#: sub-command -> (module beside this one, function, help line)
COMMANDS: dict[str, tuple[str, str, str]] = {
    "list": ("data", "list_recordings", "List the recordings, with source and licence."),
    "get": ("data", "get_recording", "Bring one of them into a folder."),
}

_catalogue = click.option(
    "--catalogue",
    type=PATH,
    metavar="FILE",
    help="A catalogue of yours, in place of the one that comes along.",
)


@click.command(cls=LazyGroup, commands_of=COMMANDS)
def data() -> None:
    """Recordings to try it on: one that comes along (no network), and public ones of real machines.

    \b
    ffc-id data get sample
    ffc-id identify sample/gravity.csv.gz sample/sweep.csv.gz sample/sine.csv.gz -o result
    """


@click.command("list")
@_catalogue
@output_options
def list_recordings(catalogue: Path | None, output: Output) -> None:
    """List the recordings, with source, licence and checksum.

    \b
    ffc-id data list
    """
    from idtool.io.catalogue import read_catalogue

    known = read_catalogue(catalogue).recordings

    lines = []
    for name, entry in known.items():
        lines.append(f"{name}: {entry.title}")
        lines.append(f"  {entry.by}; {entry.licence}" + (f"; {entry.page}" if entry.page else ""))
        lines += [f"  {source.name}: SHA-256 {source.sum_in_words}" for source in entry.files]
        if entry.elsewhere:
            lines.append(f"  not fetched from here: {entry.elsewhere}")
    output.result({"recordings": {name: asdict(entry) for name, entry in known.items()}}, lines)
    output.next("data", "get", next(iter(known), "sample"))


@click.command("get")
@click.argument("name")
@click.option("-o", "--output", "folder", type=PATH, help="Where to [a folder of its name].")
@_catalogue
@force_option
@output_options
def get_recording(
    name: str, folder: Path | None, catalogue: Path | None, force: bool, output: Output
) -> None:
    """Bring a recording into a folder: its source, licence and checksum are shown.

    A download that was cut short goes on where it stopped. It must agree with the checksum of the catalogue,
    which is that of our first copy where the source publishes none; where there is neither, that of the
    first download is kept in SHA256SUMS of the folder, and a later one must agree with it. Public recordings
    are no logs yet: the command that makes logs of them is told at the end.

    \b
    ffc-id data get sample
    ffc-id data get emps
    """
    from idtool.io.catalogue import fetch, read_catalogue

    entry = read_catalogue(catalogue).get(name)
    place = folder or Path(name)
    output.say(f"{entry.title}\n  {entry.by}\n  licence: {entry.licence}")
    for source in entry.files:
        output.say(f"  from {source.url}")
    with Progress(output, f"fetching {name}") as bar:
        found = fetch(entry, place, force=force, progress=lambda done, of: bar.at(done, of or done))

    lines = [f"{path}: {path.stat().st_size} bytes, SHA-256 {checksum}" for path, checksum in found.items()]
    files = {str(path): checksum for path, checksum in found.items()}
    output.result({"name": name, "licence": entry.licence, "page": entry.page, "files": files}, lines)
    words = shlex.split(entry.next)
    output.next(
        *(f"{place}{word.removeprefix(name)}" if word.startswith(f"{name}/") else word for word in words)
    )
