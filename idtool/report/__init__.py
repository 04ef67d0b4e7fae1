"""The fit report: figures, and one HTML page that holds them.

    from idtool.report import write_report
    write_report(Path("result"))

The figures that the single fits draw are here too; `save_figure` writes one as PNG or SVG.
"""

from idtool.presentation.style import save as save_figure
from idtool.report.friction_figures import stribeck_figure
from idtool.report.gravity_figures import arm_figure, gravity_figure
from idtool.report.loop_figures import dynamic_figure
from idtool.report.page import write_report

__all__ = ["arm_figure", "dynamic_figure", "gravity_figure", "save_figure", "stribeck_figure", "write_report"]
