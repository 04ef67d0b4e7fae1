"""ffc-id: identify gravity, friction and whatever else one current-controlled servo axis feels.

    from idtool import Log, Parameters, identify, ForceFreeController

    result = identify(["gravity.csv", "sweep.csv", "sine.csv"])   # logs or paths, one or several
    result.summary()                      # parameters, verdict, what was found, what is left
    result.parameters.to_frame()          # a table; .write("params.toml") for the other programs
    result.plot("stribeck")               # any figure of the report
    result.predict("other-day.csv")       # .frame, .errors
    result.report("result")               # the folder that `ffc-id identify -o result` writes

    Log.read("sweep.csv").plot()          # a first look, before any fit
    ForceFreeController(Parameters.read("params.toml"), period_s=0.01)

`help(idtool.identify)` and the others say what they take. Bad input raises `InputError`, a rig that
failed `RigFault`; the text of both is one sentence.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from idtool.api.identify import identify
    from idtool.api.result import Result
    from idtool.control.force_free import ForceFreeController
    from idtool.errors import InputError, RigFault
    from idtool.log import Log
    from idtool.parameters import Parameters
    from idtool.parameters.axis import Axis
    from idtool.version import __version__

_EXPORTS = {
    "Axis": "idtool.parameters.axis",
    "ForceFreeController": "idtool.control.force_free",
    "InputError": "idtool.errors",
    "Log": "idtool.log",
    "Parameters": "idtool.parameters",
    "Result": "idtool.api.result",
    "RigFault": "idtool.errors",
    "__version__": "idtool.version",
    "identify": "idtool.api.identify",
}
__all__ = [
    "Axis",
    "ForceFreeController",
    "InputError",
    "Log",
    "Parameters",
    "Result",
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
    return list(__all__)
