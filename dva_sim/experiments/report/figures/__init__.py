"""The figures of a report: each one object, drawn wherever its tables and columns are there.

Reads a study's results and what `analysis` makes of them; draws in the look of `style`, in the
colours of `palette`. Begin with `ReportFigure`, then `registry`, which holds all of them in their
order; what a figure of one's own needs is offered here.
"""

from dva_sim.experiments.analysis.run_grid import Floats, nan_mean, person_means
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.csv_numbers import Numbers, with_unit
from dva_sim.experiments.report.figures.legend import legend
from dva_sim.experiments.report.figures.palette import Look, looks
from dva_sim.experiments.report.figures.style import (
    Drawn,
    ReportFigure,
    axis_label,
    dodge,
    label_panels,
    panel_grid,
    panels,
    stops_axis,
)

__all__ = [
    "Drawn",
    "Floats",
    "Look",
    "Numbers",
    "ReportFigure",
    "StudyView",
    "axis_label",
    "dodge",
    "label_panels",
    "legend",
    "looks",
    "nan_mean",
    "panel_grid",
    "panels",
    "person_means",
    "stops_axis",
    "with_unit",
]
