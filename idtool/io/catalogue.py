"""Recordings to try the tool on: a session that comes with it, and public ones by address."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

import msgspec

from idtool.errors import InputError, UnknownNameError, nearest
from idtool.io.atomic import refuse_existing, write_whole
from idtool.io.download import download

SCHEMA = "ffc-id/catalogue/1"
#: The session that comes with the package: needs no network.
_SAMPLE_FOLDER = "session"
#: The checksums of a folder, kept at the first download.
SUMS = "SHA256SUMS"


@dataclass(frozen=True, kw_only=True)
class Source:
    """A file of a recording.

    Attributes:
        url: where it is; with the commit in it, so that it stays what it is.
        name: what it is called here.
        sha256: of its bytes; "" where nobody tells it: then that of the first download is kept.
        published: whether the source publishes that sum; if not, it is that of our own first copy.
    """

    url: str
    name: str
    sha256: str = ""
    published: bool = False

    @property
    def sum_in_words(self) -> str:
        """The checksum, and whose it is."""
        if not self.sha256:
            return "none published; that of your first download is kept"
        return self.sha256 if self.published else f"{self.sha256} (of our first copy; none is published)"


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A recording.

    Attributes:
        title: the machine.
        by: whose it is, as it wants to be cited.
        licence: under which it may be used.
        page: where it is described.
        files: of which it consists; empty for the session that comes with the package.
        elsewhere: why it is not fetched from here, without a full stop; "" where it is.
        next: words after `ffc-id` of the command that makes logs of them.
    """

    title: str
    by: str
    licence: str
    page: str = ""
    files: tuple[Source, ...] = ()
    elsewhere: str = ""
    next: str = ""


@dataclass(frozen=True, kw_only=True)
class Catalogue:
    """All of them, by name."""

    schema: str
    recordings: dict[str, Entry] = field(default_factory=dict)

    def get(self, name: str) -> Entry:
        """The recording of that name.

        Raises:
            InputError: there is none; the sentence suggests the nearest.
        """
        if name not in self.recordings:
            raise UnknownNameError(f'there is no recording "{name}"', remedy=nearest(name, self.recordings))
        return self.recordings[name]


def read_catalogue(file: Path | None = None) -> Catalogue:
    """The catalogue that comes with the package, or one of your own.

    Raises:
        InputError: the file cannot be read, or a key is missing or of the wrong type.
    """
    try:
        source = file or resources.files("idtool.data") / "recordings.toml"
        catalogue = msgspec.toml.decode(source.read_text(encoding="utf-8"), type=Catalogue)
    except FileNotFoundError as error:
        raise InputError("no such file", file=file, remedy="name a catalogue") from error
    except (OSError, UnicodeDecodeError, msgspec.MsgspecError) as error:
        raise InputError(
            f"is no catalogue ({error})", file=file, remedy="see data/recordings.toml"
        ) from error
    if catalogue.schema != SCHEMA:
        raise InputError(
            f"schema is {catalogue.schema!r}", file=file, place="schema", remedy=f'expected "{SCHEMA}"'
        )
    return catalogue


def fetch(
    entry: Entry, folder: Path, *, force: bool = False, progress: Callable[[int, int], None] | None = None
) -> dict[Path, str]:
    """Bring the files of a recording into a folder, which is made if it is missing.

    A file that is there as it was fetched is left alone, so that what was cut short is gone on with.

    Returns:
        Each file and its SHA-256, hexadecimal. They are kept in `SHA256SUMS` of the folder, as
        `sha256sum --check` reads it; a later fetch into the folder must bring the same bytes.

    Raises:
        InputError: it is not to be had from here, another file of that name is there and `force` is not
            given, it cannot be fetched or written, or it is not what the catalogue, or else the first
            download, says.
    """
    if entry.elsewhere:
        raise InputError(f"is not fetched from here: {entry.elsewhere}", file=entry.page, remedy="see there")
    sample = {} if entry.files else _sample_files()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be made ({error.strerror})", file=folder, remedy="name another") from error
    sums = _read_sums(folder / SUMS)
    wanted = {name: hashlib.sha256(content).hexdigest() for name, content in sample.items()}
    wanted |= {source.name: source.sha256 or sums.get(source.name, "") for source in entry.files}
    missing = [name for name in wanted if force or not _is_there(folder / name, wanted[name])]
    for name in missing:
        refuse_existing(folder / name, force)
    urls = {source.name: source.url for source in entry.files}
    for name in missing:
        if name in sample:
            write_whole(folder / name, sample[name])
        else:
            wanted[name] = download(urls[name], folder / name, sha256=wanted[name] or None, progress=progress)
        sums[name] = wanted[name]
        # after each, in case the next one is cut short
        write_whole(folder / SUMS, "".join(f"{checksum}  {file}\n" for file, checksum in sums.items()))
    return {folder / name: checksum for name, checksum in wanted.items()}


def _is_there(file: Path, checksum: str) -> bool:
    """Whether a file is there and what it should be."""
    return file.is_file() and hashlib.sha256(file.read_bytes()).hexdigest() == checksum


def _read_sums(file: Path) -> dict[str, str]:
    """Name -> SHA-256 of what was fetched before.

    Raises:
        InputError: the file is there and cannot be read.
    """
    if not file.exists():
        return {}
    try:
        pairs = [line.split(maxsplit=1) for line in file.read_text(encoding="utf-8").splitlines()]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot be read ({error})", file=file, remedy="remove it") from error
    return {pair[1]: pair[0] for pair in pairs if len(pair) == 2}


def _sample_files() -> dict[str, bytes]:
    inside = resources.files("idtool.data") / _SAMPLE_FOLDER
    return {
        entry.name: entry.read_bytes()
        for entry in sorted(inside.iterdir(), key=lambda entry: entry.name)
        if entry.name.endswith(".gz")
    }
