"""What friction under load that differs between raising and lowering can have done to gravity.

Sliding either way, mu + d while raising and mu - d while lowering is the same as mu both ways and gravity
1 + d times as large: only turns tell, and a known load. Where they do not, d may be anything up to mu.
"""

from __future__ import annotations

import numpy as np

from idtool.effects import registry
from idtool.fit.joint import JointFit, pulled, refit
from idtool.fit.model import JointModel

_ALIKE, _APART = "load_dependent_friction", "drive_backdrive"


def allowing_for_sides(fit: JointFit) -> tuple[JointFit, str | None]:
    """The fit with intervals of gravity that cover it, and a sentence; the same fit where it has no friction
    under load that is alike both ways, or where its rows tell."""
    mine = [i for i, name in enumerate(fit.model.names) if name.startswith("gravity.")]
    alike = next((effect for effect in fit.model.spec.effects if effect.name == _ALIKE), None)
    if alike is None or not mine:
        return fit, None
    mu = fit.values[f"{_ALIKE}.mu"]
    spec = fit.model.spec.without(_ALIKE).adding(registry.get(_APART))
    model = JointModel.build(fit.model.recording, spec, fit.model.constants)
    larger = refit(fit, model, {f"{_APART}.mu_drive": mu, f"{_APART}.mu_backdrive": mu})
    there = [larger.model.names.index(fit.model.names[i]) for i in mine]
    told = np.hypot(larger.x[there] - fit.x[mine], np.sqrt(np.diag(larger.covariance))[there])
    most = 0.5 * abs(mu * fit.x[mine])  # two standard errors
    if np.all(told < most):
        return fit, None
    by = np.zeros(len(fit.x))
    by[mine] = most * np.sign(fit.x[mine])
    return pulled(fit, by), (
        "friction under load may differ between raising and lowering, which here is the same as a gravity "
        f"that is up to {100.0 * abs(mu):.2g} % another; its interval allows for it, a known load tells."
    )
