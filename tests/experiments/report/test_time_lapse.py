"""The strip of moments of a run that has a way in the table of tracks, and its event in another."""

import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.studies.report_text import blank_pictures
from helpers.wording import unnamed

from dva_sim.experiments.analysis.kept_episodes import Tables, typical_and_worst
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView
from dva_sim.experiments.report.figures.style import styled
from dva_sim.experiments.report.figures.time_lapse import TypicalRun, WorstRun

LINES = ("pub-sub", "req-rep", "latest-wins")
TIMES = dict(zip(LINES, (40.0, 72.2, 90.0), strict=True))
BEGINS, EVERY_S = 2.0, 5.0


def of_run(line, **columns):
    cell = {"part": "drive", "cell": LINES.index(line), "person": 0, "trial": 0, "seed": 1}
    return cell | {"pattern": line, "is_reference": False} | columns


@pytest.fixture
def drawn(tmp_path, request):
    """The typical and the worst run; of the worst it can be that it never was confirmed."""
    runs = [of_run(line, drive_time_s=value) for line, value in TIMES.items()]
    confirmed = {line: BEGINS + value for line, value in TIMES.items()}
    confirmed |= getattr(request, "param", {})
    event = {"kind": "fire", "room": "Canteen", "is_true": True, "t_occurred_s": 20.0}
    events = [of_run(line, t_confirmed_s=t, **event) for line, t in confirmed.items()]
    place = {"agent": "robot-1", "y_m": 12.0, "heading_rad": 0.0, "mode": "x"}
    tracks = [
        of_run(line, t_s=t, x_m=12.0 + t / 10, **place)
        for line, value in TIMES.items()
        for t in np.arange(0.0, BEGINS + value + EVERY_S, EVERY_S).tolist()
    ]
    table, *others = map(synthetic_results.columns, (runs, tracks, events))
    part = RunGrid(table, "drive", [Factor("pattern", LINES)])
    view = StudyView(part, "drive_time_s", part.factors[0], None, None, {})
    tables = Tables(table, others[0], ["pattern"], others[1])
    found = typical_and_worst(tmp_path, "drive", "drive_time_s", tables)
    with styled(), blank_pictures():
        return [
            figure.drawn(view, episode, synthetic_results.SCENARIO)
            for figure, episode in zip((TypicalRun(), WorstRun()), found, strict=True)
        ]


def titles(figure):
    return [ax.get_title("left") for ax in figure.figure.axes]


def test_the_last_moment_is_that_of_the_title_and_the_robot_is_where_it_was_then(drawn):
    typical = drawn[0]
    assert unnamed(typical.title, "all configurations", "72.2\N{NO-BREAK SPACE}s", "REQ/REP") == []
    assert titles(typical)[0] == "0 s"
    assert titles(typical)[-1] == "72.2 s: confirmation"
    robot = typical.figure.axes[-1].lines[-1].get_xydata()[0]
    assert robot == pytest.approx([12.0 + (BEGINS + 72.2) / 10, 12.0])
    assert f"{BEGINS + 72.2:g},{robot[0]:g}," in typical.csv.decode()  # as all that is drawn


def test_an_event_is_named_by_its_kind_in_its_room_once_it_has_begun(drawn):
    reports = [
        [t.get_text() for t in ax.texts if "fire" in t.get_text()] for ax in drawn[0].figure.axes
    ]
    assert [len(words) for words in reports] == [0, 0, 1, 1, 1, 1]  # from 20 s on


@pytest.mark.parametrize("drawn", [{"latest-wins": np.nan}], indirect=True)
def test_a_run_in_which_it_never_came_has_times_of_the_run_to_its_end(drawn):
    assert titles(drawn[1])[-1] == "95.0 s"
