"""Share of runs still under way at every moment: how often it took longer than that.

A mean hides the few drives that nobody can wait for. This figure has a falling line for each level
of the compared factor: how large a share of its runs took longer than each time. Where two lines
cross, one is quicker as a rule and the other is safer.

    dva-sim report results/req-rep-vs-pub-sub --figure risk.py:Risk
    dva-sim check figure risk.py:Risk
"""

import numpy as np

from dva_sim.experiments.report.figures import (
    Numbers,
    ReportFigure,
    axis_label,
    legend,
    looks,
    panels,
)


class Risk(ReportFigure):
    """The share of runs that took longer, for each line, where delay or load is highest."""

    name = "risk"
    title = "How often it took longer than a time"

    def draw(self, view, reading):
        """One line for each level, at the last stop of the first panel."""
        panel, grid = view.panels[0], view.part.grid(view.measure)
        figure, ((ax,),) = panels(1, 1, 3.2)
        numbers = Numbers()
        for level, look in looks(view.line).items():
            values = view.curve(grid, panel, level)[-1].ravel()
            times = np.sort(values[np.isfinite(values)])
            if not len(times):
                continue
            longer = 1.0 - np.arange(1, len(times) + 1) / len(times)
            ax.step(times, longer, where="post", color=look.colour, marker=look.mark, ms=4)
            where = view.setting(panel, level) | view.at_stop(-1)
            numbers.add(where, {view.measure: times, "share_longer": longer})
        if not ax.lines:
            return None
        ax.set_xlabel(axis_label(view.measure))
        ax.set_ylabel("Share of runs that took longer")
        ax.set_ylim(bottom=0)
        legend(figure, view.line)
        caption = (
            "Each mark is a run of the last level along the report's axis: to its right lie those "
            "that took longer. Where two lines cross, one is quicker as a rule and the other safer."
        )
        return self.finish(figure, caption, numbers)
