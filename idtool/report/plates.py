"""Every figure of a report, in its order."""

from __future__ import annotations

from idtool.report.evidence import Evidence
from idtool.report.gallery import Plate, model_plates, uncertainty_plates
from idtool.report.residual_gallery import residual_plates


def all_plates(evidence: Evidence) -> list[Plate]:
    """The figures that these data give."""
    return [*model_plates(evidence), *residual_plates(evidence), *uncertainty_plates(evidence)]
