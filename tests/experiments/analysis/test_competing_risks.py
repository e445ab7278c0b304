import csv
import io
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.studies import synthetic_results
from helpers.wording import unnamed

from dva_sim.experiments.analysis.competing_risks import NOTHING, Endings, horizon_of, with_endings
from dva_sim.experiments.analysis.run_grid import Factor, RunGrid
from dva_sim.experiments.analysis.study_view import StudyView, finding_of
from dva_sim.experiments.report.figures.endings import EndingsInTime
from dva_sim.experiments.report.outcome_table import in_a_line, sentences, table

LEVELS = ("short", "long")
HORIZON_S = 100.0


def event(person, line, **how):
    """Event row of a run with one event, open until the horizon by default."""
    row = {"part": "drive", "cell": LEVELS.index(line), "person": person, "trial": 0}
    row |= {"command.timeout_s": line, "is_reference": False, "is_true": True, "outcome": "open"}
    row |= {"confirmation_s": np.nan, "closing_s": np.nan, "watched_s": HORIZON_S}
    return row | how


def confirmed(person, line, at=30.0):
    return event(person, line, outcome="confirmed", confirmation_s=at, closing_s=at)


def escalated(person, line, at=20.0):
    return event(person, line, outcome="escalated", closing_s=at)


def endings(events, how="lost link", factors=()):
    """The events, and runs that say how their last drive ended."""
    runs = [
        {key: row[key] for key in ("part", "cell", "person", "trial", "is_reference")}
        | {name: row[name] for name in ("command.timeout_s", *(f.name for f in factors))}
        | {"seed": 1}
        | {"confirmed": row["outcome"] == "confirmed", "drive_time_s": 50.0 + row["person"]}
        | {"outcome": how if row["outcome"] == "escalated" else "timeout"}
        for row in events
    ]
    table_of_runs = synthetic_results.columns(runs)
    part = RunGrid(table_of_runs, "drive", [Factor("command.timeout_s", LEVELS), *factors])
    view = StudyView(part, "drive_time_s", part.factors[0], None, LEVELS, {})
    return Endings(view, synthetic_results.columns(events), table_of_runs, HORIZON_S), view


def three_of_four_lost():
    """Under `short` 3 of 4 persons lose the link; under `long` 3 confirm and 1 comes to nothing."""
    short = [escalated(0, "short"), escalated(1, "short"), escalated(2, "short")]
    long = [confirmed(0, "long"), confirmed(1, "long"), confirmed(2, "long"), event(3, "long")]
    return endings([*short, confirmed(3, "short"), *long])


def test_every_way_has_its_share_and_they_add_up_to_one():
    found, _ = three_of_four_lost()
    assert found.ways == ("confirmed", "link lost", NOTHING)
    shares = {way: share.mean for way, share in found.at("short", None).shares.items()}
    assert shares == pytest.approx({"confirmed": 0.25, "link lost": 0.75, NOTHING: 0.0})
    shares = {way: share.mean for way, share in found.at("long", None).shares.items()}
    assert shares == pytest.approx({"confirmed": 0.75, "link lost": 0.0, NOTHING: 0.25})


def test_what_did_not_happen_has_an_interval_too():
    found, _ = three_of_four_lost()
    lost = found.at("long", None).shares["link lost"]
    assert lost.low == 0.0
    assert 0.3 < lost.high < 0.9  # 4 persons rule out little


@pytest.mark.parametrize(
    ("how", "way"),
    [("lost link", "link lost"), ("gave up", "given up"), ("timeout", "escalated")],
)
def test_an_escalated_event_is_told_by_how_the_drive_to_it_ended(how, way):
    found, _ = endings([escalated(0, "short"), escalated(1, "short")], how)
    assert found.ways == (way, NOTHING)


def test_where_a_run_has_several_events_its_drive_tells_of_none_of_them():
    found, _ = endings([escalated(0, "short"), escalated(0, "short", at=40.0)])
    assert found.ways == ("escalated", NOTHING)


def test_what_comes_first_counts():
    late = confirmed(0, "short", at=10.0) | {"outcome": "escalated", "closing_s": 60.0}
    found, _ = endings([late, event(1, "short", outcome="contained", confirmation_s=5.0)])
    assert list(found.way) == ["confirmed", "confirmed"]


def test_a_confirmation_after_the_horizon_is_none_by_then():
    found, _ = endings([confirmed(0, "short", at=101.0), confirmed(1, "short", at=99.0)])
    assert found.at("short", None).shares["confirmed"].mean == pytest.approx(0.5)
    assert not found.is_right.all()


def test_false_alarms_are_cleared_and_an_event_that_nobody_reported_counts():
    refuted = event(0, "short", outcome="refuted", closing_s=9.0)
    unseen = event(2, "short", outcome="undetected", watched_s=np.nan)
    found, _ = endings([refuted | {"is_true": False}, refuted | {"person": 1}, unseen])
    assert list(found.way) == ["cleared", "refuted", "never reported"]
    shares = found.at("short", None).shares
    assert [shares[way].mean for way in found.ways] == pytest.approx([1 / 3, 1 / 3, 1 / 3, 0])


def test_events_that_are_no_longer_watched_are_cut_off_not_counted_as_nothing():
    """Aalen and Johansen by hand: 1 of 4 confirmed at 10, one cut off at 20, 1 of 2 at 30."""
    rows = [confirmed(0, "short", 10.0), event(1, "short", watched_s=20.0)]
    rows += [confirmed(2, "short", 30.0), event(3, "short")]
    found, _ = endings(rows)
    assert found.at("short", None).shares["confirmed"].mean == pytest.approx(1 / 4 + 3 / 4 / 2)


def test_the_difference_is_taken_within_persons():
    found, _ = three_of_four_lost()
    assert found.difference("long", "short", None).mean == pytest.approx(0.5)
    assert found.difference("long", "short", None).n_persons == 4


def test_the_contrast_is_told_with_intervals_and_in_points():
    found, view = three_of_four_lost()
    (text,) = sentences(found, view, finding_of(view))
    text = text.replace("\N{NO-BREAK SPACE}", " ")
    shares = ("In part drive", "by 100 s", "short: confirmed 25 % (", "link lost 75 % (")
    assert unnamed(text, *shares, "short lies 50.0", "points below long (") == []


def test_the_table_has_a_row_for_each_level():
    found, view = three_of_four_lost()
    made = table(found, view, "person")
    heads = [head.replace("\N{NO-BREAK SPACE}", " ") for head in made.heads]
    assert heads[1:] == ["events", "confirmed", "link lost", "nothing by 100 s"]
    assert [row[:2] for row in made.rows] == [["short", "4"], ["long", "4"]]


def test_where_all_were_confirmed_a_line_says_so():
    found, view = endings([confirmed(p, line) for p in range(3) for line in LEVELS])
    assert found.is_right.all()
    assert unnamed(in_a_line(found, "drive"), "part drive", "every event") == []
    assert table(found, view, "person").rows == []


def test_events_count_until_they_are_no_longer_followed_or_the_run_is_over():
    _, view = three_of_four_lost()
    assert horizon_of(view, {"horizon_s": 240.0}) == 240.0
    view.part.treated["follow_s"] = np.full(len(view.part), 600.0)
    assert horizon_of(view, {"horizon_s": 7200.0}) == 600.0


def figure_of(found, view):
    return EndingsInTime().draw(view, SimpleNamespace(endings=found))


def test_the_figure_ends_at_the_shares_of_the_table():
    found, view = three_of_four_lost()
    drawn = figure_of(found, view)
    assert drawn is not None
    rows = list(csv.DictReader(io.StringIO(drawn.csv.decode())))
    last = {row["command.timeout_s"]: row for row in rows if float(row["t_s"]) == HORIZON_S}
    assert float(last["short"]["link lost"]) == pytest.approx(0.75)
    assert float(last["long"]["confirmed"]) == pytest.approx(0.75)
    first = next(row for row in rows if row["command.timeout_s"] == "long")
    assert (float(first["confirmed"]), float(first[NOTHING])) == (0.0, 1.0)


def test_where_nothing_ever_came_of_an_event_the_figure_says_so():
    found, view = endings([event(person, line) for line in LEVELS for person in range(2)])
    rows = list(csv.DictReader(io.StringIO(figure_of(found, view).csv.decode())))
    assert {float(row["nothing"]) for row in rows} == {1.0}


def test_where_all_were_confirmed_there_is_no_figure():
    found, view = endings([confirmed(p, line) for p in range(3) for line in LEVELS])
    assert figure_of(found, view) is None


def test_a_run_without_a_drive_is_confirmed_if_its_events_were():
    """A guard goes: nobody drives, so the table of runs says nothing."""
    keys = ("part", "cell", "person", "trial", "is_reference")
    rows = [confirmed(0, "short"), escalated(1, "short"), event(2, "short")]
    rows += [event(3, "short", is_true=False, outcome="refuted")]
    runs = [{key: row[key] for key in keys} for row in rows]
    runs = synthetic_results.columns(runs) | {"outcome": np.array([None] * 4, dtype=object)}
    found = with_endings(runs, synthetic_results.columns(rows))
    assert found["confirmed"][:3].tolist() == [1.0, 0.0, 0.0]
    assert np.isnan(found["confirmed"][3])  # a false alarm is not to be confirmed
    assert found["outcome"].tolist() == ["confirmed", "escalated", "timeout", None]


def test_of_several_events_of_a_run_it_is_the_share():
    rows = [confirmed(0, "short"), escalated(0, "short"), confirmed(0, "short"), event(0, "short")]
    keys = ("part", "cell", "person", "trial", "is_reference")
    runs = synthetic_results.columns([{key: rows[0][key] for key in keys}])
    assert with_endings(runs, synthetic_results.columns(rows))["confirmed"].tolist() == [0.5]


def test_where_all_went_right_in_the_answers_panel_the_table_shows_the_others():
    rows = [confirmed(p, line) | {"guard.way_m": 5} for p in range(3) for line in LEVELS]
    far = [escalated(p, line) | {"guard.way_m": 60, "cell": 2} for p in range(3) for line in LEVELS]
    found, view = endings([*rows, *far], factors=[Factor("guard.way_m", (5, 60))])
    made = table(found, view, "person")
    assert made.heads[:2] == ["way of the guard", "time-out of a request"]
    assert [row[1:3] for row in made.rows] == [["short", "3"], ["long", "3"]]
    assert made.rows[0][0] == "60\N{NO-BREAK SPACE}m"
