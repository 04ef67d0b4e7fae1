"""What a command that ends can go on with: logs of the user's own, and the rig that they came from."""

from __future__ import annotations

import gzip
import re
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from idtool.parameters import Parameters

#: Files of a folder that are looked at, and bytes of each: a log says what it is in its first lines.
_MOST_FILES = 200
_HEAD = 4096
_EXPERIMENT = re.compile(rb'^# experiment = "([\w-]+)"', re.MULTILINE)
#: What stands for a rig that nobody knows.
ANY_RIG = "SPEC"


def logs_beside(given: Sequence[Path], experiments: Sequence[str]) -> list[Path]:
    """Logs that lie beside the given ones, one of each of these experiments; rather one that is named so."""
    found: dict[str, Path] = {}
    for folder in dict.fromkeys(path.parent for path in given):
        for path in sorted((*folder.glob("*.csv"), *folder.glob("*.csv.gz")))[:_MOST_FILES]:
            name = _experiment(path)
            if name not in found or path.name.partition(".")[0] == name:
                found[name] = path
    return [found[name] for name in experiments if name in found]


def logs_of(*files: Parameters) -> list[Path]:
    """Logs that parameter files were fitted to and that are still where they were."""
    named = dict.fromkeys(log for file in files for log in file.logs)
    return [path for log in named if (path := Path(log)).is_file()]


def _experiment(path: Path) -> str:
    """What the head of a log says it is; "" of anything else, a pipe that would be waited for among it."""
    if not path.is_file():
        return ""
    try:
        with (gzip.open if path.suffix == ".gz" else open)(path, "rb") as stream:
            head = stream.read(_HEAD)
    except (OSError, EOFError, zlib.error):
        return ""
    said = _EXPERIMENT.search(head) if head.startswith(b"# ffc-id-log") else None
    return said[1].decode() if said else ""
