"""One session in both clocks: a robot's decisions do not depend on the clock."""

import math
from collections import Counter

import pytest
from helpers.network.scripted_session import (
    Decided,
    Way,
    forged,
    in_virtual_time,
    one_by_one,
    over_sockets,
    pipelined,
    published,
    story_in_virtual_time,
)
from helpers.wording import unnamed

from dva_sim.protocol import messages as m

pytestmark = pytest.mark.system

WAYS = {"req-rep": one_by_one, "pipelined": pipelined, "pub-sub": published}


def of_the_session(decisions: list[Decided]) -> list[Decided]:
    """All decisions but on the grant: it and the start may overtake each other on the network."""
    return [d for d in decisions if d.message != "PermissionGrant"]


@pytest.mark.parametrize("pattern", WAYS)
def test_a_session_leads_to_the_same_decisions_in_both_clocks(pattern):
    way: Way = WAYS[pattern]
    virtual = of_the_session(in_virtual_time(way, pattern=pattern))
    live = of_the_session(over_sockets(way, pattern=pattern))
    assert live == virtual

    refused = 0 if pattern == "pub-sub" else 1  # who only listens while driven hears nothing else
    assert Counter(d.message for d in live) == {
        "StartTeleOp": 2,
        "SetTeleOp": 200 + refused + 10,
        "Emergency": 1,
        "StopTeleOp": 1,
        "PermissionRevocation": 1,
    }
    assert [d.code for d in live if d.code != m.OK] == [m.WRONG_MODE] * refused


def test_the_session_is_what_it_says():
    decisions = of_the_session(in_virtual_time())
    start, first, *_ = decisions
    assert start == Decided("StartTeleOp", m.OK, "", "Teleoperation", 0.0, 0.0)
    assert first == Decided("SetTeleOp", m.OK, "", "Teleoperation", 0.1, 0.0)
    turn = pytest.approx(0.3 * math.sin(19.9))
    assert decisions[1 + 199] == Decided("SetTeleOp", m.OK, "", "Teleoperation", 0.1, turn)
    assert decisions[1 + 200] == Decided("Emergency", m.OK, "stopped", "Idle", 0.0, 0.0)
    refused = decisions[1 + 201]
    assert (refused.code, refused.mode, refused.speed) == (m.WRONG_MODE, "Idle", None)
    assert [d.message for d in decisions[-2:]] == ["StopTeleOp", "PermissionRevocation"]


WHOLE = [("starts", 200), ("200 of 200", "obeyed"), ("emergency", "obeyed"), ("wrong mode",)]
WHOLE += [("starts", 10), ("10 of 10", "obeyed"), ("stops", "obeyed")]
LATE = {"robot.processing_s": 0.3, "robot.max_age_s": 0.2}
GIVEN_UP = [("starts", 200), ("1 of 200", "stale", "10 s"), ("stops", "obeyed")]


@pytest.mark.parametrize(("changes", "words"), [({}, WHOLE), (LATE, GIVEN_UP)])
def test_the_operator_tells_what_was_done_and_gives_up_a_robot_that_obeys_no_more(changes, words):
    reported = story_in_virtual_time(**changes)
    missing = [unnamed(line, "robot-1", *each) for line, each in zip(reported, words, strict=True)]
    assert missing == [[]] * len(words)


@pytest.mark.parametrize(
    "changed",
    [{"robot.max_age_s": 0.2}, {"robot.processing_s": 0.3, "robot.watchdog_s": 0.2}],
)
def test_a_shorter_limit_leads_to_other_decisions(changed):
    """So it is no wonder of the comparison that both clocks agree."""
    usual, strict = (of_the_session(in_virtual_time(**c)) for c in ({}, changed))
    assert strict != usual
    assert m.STALE in {d.code for d in strict}
    assert m.STALE not in {d.code for d in usual}


@pytest.mark.invariant("S2", "S8")
@pytest.mark.parametrize("live", [False, True])
def test_a_grant_forged_in_the_dvas_name_is_found_out_by_asking_the_dva(live):
    decisions = over_sockets(forged) if live else in_virtual_time(forged)
    reports = [d.message for d in decisions]
    assert reports.count("PermissionGrant") == 2
    started = next(d for d in decisions if d.message == "StartTeleOp")
    assert (started.code, started.mode) == (m.OK, "Teleoperation")
    assert reports.count("SetTeleOp") == 211
