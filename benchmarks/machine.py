"""What the figures were measured with: kind of processor and versions, nothing that names the machine."""

from __future__ import annotations

import platform
import re
import subprocess
from importlib import metadata
from pathlib import Path

_PACKAGES = ("ffc-id", "numpy", "scipy", "numba", "llvmlite", "nlopt", "pandas", "deap")


def processor() -> str:
    """Kind of processor."""
    try:
        found = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    except OSError:
        found = None
    return found[1].strip() if found else platform.processor() or platform.machine()


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that matter; "absent" where one is not there."""
    result = {"Python": platform.python_version()}
    for name in _PACKAGES:
        try:
            result[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            result[name] = "absent"
    return result


def compiler(command: str) -> str:
    """The C compiler's own word for itself."""
    try:
        done = subprocess.run([command, "--version"], capture_output=True, text=True, check=False)
    except OSError:
        return "absent"
    return done.stdout.splitlines()[0] if done.stdout else "unknown"
