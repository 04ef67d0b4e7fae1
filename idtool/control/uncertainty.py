"""What the numbers of a parameter file may be off by, as the controller counts on it."""

from __future__ import annotations

import math

from idtool.control.rest_load import Uncertainty, gravity_error
from idtool.parameters import Parameter, Parameters


def per_kilogram(parameters: Parameters) -> Parameter:
    """Gravity per kilogram of payload; 0 where the file has none."""
    return parameters.gravity.get("per_payload", Parameter(0.0))


def at_rest(
    parameters: Parameters, friction_bound: float, friction: float, payload_kg: float, noise: float
) -> Uncertainty:
    """What the load and the friction at rest may be off by.

    Args:
        parameters: the file.
        friction_bound: the most that friction can hold at rest, N m (N).
        friction: by how much friction usually changes, relatively.
        payload_kg: by how much the payload may differ from the one told.
        noise: of one reading, N m (N).
    """
    per_payload = per_kilogram(parameters)
    return Uncertainty(
        gravity=gravity_error(parameters.gravity),
        payload=payload_kg * abs(per_payload.value),
        per_payload=per_payload.stderr or 0.0,
        friction=_uncertainty_of(parameters, "coulomb", friction) * friction_bound,
        noise=noise,
    )


def of_friction(parameters: Parameters, usual: float) -> dict[str, float]:
    """Those of the admittance law's friction: level and damping relative, Stribeck part in N m (N)."""
    levels = (_fit_error(parameters, name, usual) for name in ("coulomb", "static"))
    return {
        "level": _uncertainty_of(parameters, "coulomb", usual),
        "damping": _uncertainty_of(parameters, "viscous", usual),
        "stribeck": math.hypot(*levels),
    }


def _uncertainty_of(parameters: Parameters, name: str, usual: float) -> float:
    """Relative standard deviation of a friction parameter: what it changes by, and the fit's own."""
    parameter = parameters.static[name]
    fit = _of_fit(parameter) / parameter.value if parameter.value > 0.0 else 0.0
    return math.hypot(usual, min(fit, 1.0))


def _of_fit(parameter: Parameter) -> float:
    """Standard error of a parameter of friction; all of one that the data do not determine."""
    return (parameter.stderr or 0.0) if parameter.known else abs(parameter.value)


def _fit_error(parameters: Parameters, name: str, usual: float) -> float:
    """Standard deviation of a friction level's fit, N m (N); no more than the level's usual change."""
    most = usual * parameters.static["coulomb"].value
    fit = _of_fit(parameters.static[name])
    return fit * most / math.hypot(fit, most) if fit > 0.0 else 0.0
