"""Outcomes of events: a line in every report, and a warning if some were missed."""

import numpy as np
import pytest
from helpers.wording import unnamed

from dva_sim.experiments.report.outcome_table import outcomes_of


def events(*rows):
    """Columns of events: real or not, outcome, kind, who looked."""
    names = "is_true", "outcome", "kind", "responder_kind"
    return dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True))


SEEN = (True, "confirmed", "fire", "robot")
LEAK = (True, "refuted", "gas_leak", "robot")


def test_missed_events_are_counted_by_kind_and_by_who_looked():
    found = outcomes_of(
        events(
            *[SEEN] * 263, *[LEAK] * 22, (True, "refuted", "gas_leak", "guard"),
            *[(True, "open", "fire", "none")] * 2,
        )
    )  # fmt: skip
    assert found.warns
    assert unnamed(
        str(found), "288", "263", "23 missed", "22 gas leaks", "robots",
        "1 gas leak inspected by a guard", "2 still open",
    ) == []  # fmt: skip


def test_nothing_is_warned_of_where_all_were_confirmed_or_contained():
    found = outcomes_of(events(SEEN, (True, "contained", "fire", "guard"), SEEN))
    assert not found.warns
    assert unnamed(str(found), "all 3", "confirmed") == []


def test_false_alarms_are_no_missed_events_and_those_believed_are_warned_of():
    cleared = (False, "refuted", "fire", "robot")
    assert not outcomes_of(events(SEEN, cleared)).warns
    found = outcomes_of(events(SEEN, cleared, (False, "confirmed", "fire", "robot")))
    assert found.warns
    assert unnamed(str(found), "2 false alarms", "1 ") == []


@pytest.mark.parametrize("table", [{}, {"outcome": np.array([])}, events(SEEN)])
def test_a_study_without_events_has_no_such_line(table):
    table.pop("is_true", None)
    assert outcomes_of(table) is None
