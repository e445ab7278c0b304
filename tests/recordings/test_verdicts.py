"""Outcomes of runs in words, and which of two was ahead."""

from math import inf
from types import SimpleNamespace

import pytest
from helpers.wording import unnamed

from dva_sim.recordings.pictures.run_endings import decided_at, story, verdicts
from dva_sim.simulation.full import Ending


def run(*endings, duration=235.0, false=(), pattern="req-rep"):
    incidents = [SimpleNamespace(false_alarm=n in false) for n in range(len(endings))]
    scenario = SimpleNamespace(pattern=pattern)
    ended = [Ending(*ending) for ending in endings]
    return SimpleNamespace(incidents=incidents, endings=ended, duration=duration, scenario=scenario)


LATE, EARLY = run(("confirmed", 234.4)), run(("confirmed", 127.3), pattern="latest-wins")
NEVER = run(("open", inf), duration=600.0)


@pytest.mark.parametrize(
    ("ended", "text", "good"),
    [
        (LATE, "confirmed at 234.4 s", True),
        (NEVER, "not confirmed within 600 s", False),
        (run(("undetected", inf), duration=420.0), "not reported within 420 s", False),
        (run(("escalated", 121.0)), "not confirmed, escalated at 121.0 s", False),
        (run(("refuted", 80.0)), "wrongly refuted at 80.0 s", False),
        (run(("refuted", 80.0), false=(0,)), "refuted at 80.0 s", True),
        (run(("confirmed", 80.0), false=(0,)), "wrongly confirmed at 80.0 s", False),
        (run(("confirmed", 9.0), ("confirmed", 5.0)), "both events confirmed at 9.0 s", True),
        (run(*[("confirmed", 9.0)] * 3), "all 3 events confirmed at 9.0 s", True),
        (run(("confirmed", 9.0), ("refuted", 5.0), false=(1,)), "both events settled at 9.0 s", 1),
        (run(("confirmed", 9.0), ("open", inf)), "1 of 2 events confirmed within 235 s", False),
        (run(), "", False),  # nothing is known, as of a recording that was cut short
    ],
)
def test_a_run_tells_how_it_ended(ended, text, good):
    (verdict,) = verdicts([ended])
    assert (verdict.full_text, verdict.good) == (text, good)
    assert verdict.time <= ended.duration


def test_of_two_runs_the_one_that_was_ahead_says_by_how_much():
    late, early = verdicts([LATE, EARLY])
    assert late.full_text == "confirmed at 234.4 s"
    assert early.full_text.split(", ") == ["confirmed at 127.3 s", "107 s ahead"]
    assert late.ahead == -early.ahead == pytest.approx(-107.1)
    assert verdicts([EARLY, LATE])[0] == early


def test_a_lead_of_a_moment_is_told_in_tenths_and_one_too_short_to_tell_not_at_all():
    reports = [verdicts([LATE, run(("confirmed", t))])[1].full_text for t in (233.0, 234.38)]
    assert [line.split(", ")[1:] for line in reports] == [["1.4 s ahead"], []]


def test_who_is_alone_in_coming_to_an_end_says_so():
    alone, never = (v.full_text for v in verdicts([EARLY, NEVER]))
    assert unnamed(alone, "confirmed at 127.3 s", "other") == []
    assert unnamed(never, "not confirmed", "600 s") == []
    assert [v.ahead for v in verdicts([NEVER, NEVER])] == [0, 0]


def test_two_runs_differ_most_when_the_first_is_done():
    assert decided_at(verdicts([LATE, EARLY])) == 127.3
    assert decided_at(verdicts([NEVER, LATE])) == 234.4
    assert decided_at(verdicts([NEVER, NEVER])) is None


def test_two_runs_are_told_beside_each_other_by_the_names_that_reports_use():
    names = ["REQ/REP".ljust(21), "latest-wins PUB/SUB  "]
    reports = [verdict.full_text for verdict in verdicts([LATE, EARLY])]
    assert story([LATE, EARLY]) == [
        f"{name}{line}" for name, line in zip(names, reports, strict=True)
    ]
