from helpers.studies import synthetic_results

from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.answer_table import spread_table


def test_the_table_holds_both_sides_and_the_effect_at_every_stop():
    runs = synthetic_results.columns(synthetic_results.drive_rows(6, 3))
    names = (("pattern", synthetic_results.PATTERNS), ("link.delay_s", synthetic_results.DELAYS))
    pattern, delay = (Factor(name, tuple(levels)) for name, levels in names)
    profile = Factor("profile", ("default", "dissertation"))
    part = RunGrid(runs, "drive", [pattern, delay, profile])
    contrast = ("req-rep", "latest-wins")
    view = StudyView(part, "drive_time_s", pattern, delay, contrast, {"profile": "default"})
    table = spread_table(view)
    assert len(table.rows) == 3 * 6
    assert [row[:2] for row in table.rows[-3:]] == [
        ["1\N{NO-BREAK SPACE}s", "REQ/REP"],
        ["1\N{NO-BREAK SPACE}s", "latest-wins PUB/SUB"],
        ["1\N{NO-BREAK SPACE}s", "REQ/REP − latest-wins PUB/SUB"],
    ]
