"""ffc-id: system identification for one current-controlled servo axis.

from idtool import Log, Parameters, identify, ForceFreeController
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from idtool.version import __version__

if TYPE_CHECKING:
    from idtool.control.force_free import ForceFreeController
    from idtool.errors import InputError, RigFault
    from idtool.log import Log
    from idtool.parameters import Parameters
    from idtool.parameters.axis import Axis
    from idtool.verbs.identify import identify

_EXPORTS = {
    "Axis": "idtool.parameters.axis",
    "ForceFreeController": "idtool.control.force_free",
    "InputError": "idtool.errors",
    "Log": "idtool.log",
    "Parameters": "idtool.parameters",
    "RigFault": "idtool.errors",
    "identify": "idtool.verbs.identify",
}
__all__ = [
    "Axis",
    "ForceFreeController",
    "InputError",
    "Log",
    "Parameters",
    "RigFault",
    "__version__",
    "identify",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that `import idtool` costs nothing."""
    if name in _EXPORTS:
        value = getattr(importlib.import_module(_EXPORTS[name]), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """The public names, for those who look around before they import."""
    return sorted({*globals(), *_EXPORTS})
