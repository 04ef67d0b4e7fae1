"""Run a command of the documentation with the real program."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

PROGRAM = Path(sys.executable).parent / "ffc-id"


def finished(words: list[str], folder: Path) -> str:
    """What `ffc-id WORDS...` prints in a terminal as wide as the pages; it must succeed."""
    done = subprocess.run(
        [str(PROGRAM), *words],
        cwd=folder,
        env={**os.environ, "COLUMNS": "118"},
        capture_output=True,
        text=True,
        timeout=900,
        check=False,
    )
    assert done.returncode == 0, f"ffc-id {' '.join(words)}: {done.stderr}"
    return done.stdout + done.stderr
