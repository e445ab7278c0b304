"""A scripted dispatcher in a run: what it does, in which order, by messages anybody can send."""

from functools import cache
from typing import Any

import pytest
from helpers.wording import unnamed

from dva_sim.core.events import State
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.protocol.facts import Fact
from dva_sim.simulation.full.recording import Recording
from dva_sim.simulation.full.run import simulate
from dva_sim.simulation.full.stage import id_of
from dva_sim.simulation.measures.episodes import event_rows, measures_of, run_row
from dva_sim.simulation.scenario import Scenario, build

ROOM = id_of("control-room", 1)
EXACT = {
    "acknowledge_s": {"median": 8.0, "spread": 0.0},
    "decide_s": {"median": 12.0, "spread": 0.0},
}
ALARM = {"kind": "gas_leak", "at_s": 5.0, "room": "Workshop", "reported": True}
TEAM = {"robot": {"count": 2}, "guard": {"count": 1}, "operator": {"count": 1}}


def scenario(mode: str = "ask_first", **person: Any) -> Scenario:
    dispatch = {"mode": mode, "person": EXACT | person, "decide_within_s": 60.0}
    data = {**TEAM, "events": [ALARM], "dispatch": dispatch, "horizon_s": 150.0}
    return build(data, {})


@cache
def played(mode: str, sends: str = "") -> Recording:
    overrules = [{"sends": sends}] if sends else []
    return simulate(scenario(mode, overrules=overrules), seed=3, keep_traffic=True)


def of_people(recording: Recording) -> list[Fact]:
    return [fact for fact in recording.facts if fact.role is not None]


def test_asked_first_it_acknowledges_after_8_s_and_sends_as_proposed_12_s_later():
    recording = played("ask_first")
    seen, sent = of_people(recording)
    assert (seen.action, sent.action, sent.author) == ("acknowledge", "assign", ROOM)
    assert seen.time == pytest.approx(5.0 + 8.0, abs=0.05)
    assert sent.time == pytest.approx(5.0 + 8.0 + 12.0, abs=0.1)
    assert sent.device == sent.advised
    assert not sent.overrides
    assert recording.events[0].times["assigned"] == sent.time


def test_what_it_says_are_messages_of_the_protocol():
    traffic = played("ask_first").recorder.traffic or []
    reports = [decode(sent.payload).body for sent in traffic if sent.source == ROOM]
    kinds = [type(body) for body in reports if not isinstance(body, m.Heartbeat)]
    wanted = [m.Registration, m.Acknowledge, m.GetProposal, m.Assign]
    assert list(dict.fromkeys(kind for kind in kinds if kind in wanted)) == wanted
    heard = [decode(sent.payload).body for sent in traffic if sent.destination == ROOM]
    states = [body.event_state for body in heard if isinstance(body, m.EventStatus)]
    assert list(dict.fromkeys(states))[:2] == ["pending", "assigned"]
    assert any(isinstance(body, m.AuditRecord) for body in heard)


def test_automatic_it_watches_and_sends_another_where_its_rule_says_so():
    recording = played("automatic", "guard")
    by_itself, *rest = [f for f in recording.facts if f.action == "assign"]
    assert (by_itself.role, by_itself.time) == (None, pytest.approx(5.0, abs=0.01))
    if by_itself.device == id_of("guard", 1):
        assert rest == []
    else:
        assert (rest[0].device, rest[0].overrides) == (id_of("guard", 1), True)
        assert rest[0].advised == by_itself.device


@pytest.mark.parametrize(
    ("sends", "state"), [("nobody", State.REFUTED), ("others", State.ESCALATED)]
)
@pytest.mark.invariant("S6")
def test_it_may_end_an_event_and_no_rule_is_broken(sends, state):
    recording = played("ask_first", sends)
    assert recording.events[0].state is state
    assert recording.recorder.violations == {}
    assert run_row(recording)["dismissed"] == 1


def test_the_same_seed_makes_the_same_decisions():
    again = simulate(scenario("ask_first", overrules=[]), seed=3)
    assert again.facts == played("ask_first").facts


def test_its_delays_change_nobody_elses_random_numbers():
    """The other people draw the same numbers with or without a dispatcher."""
    alone = simulate(build({**TEAM, "events": [ALARM], "horizon_s": 60.0}, {}), seed=3)
    room = played("automatic")
    assert alone.events[0].times["assigned"] == room.events[0].times["assigned"]
    assert alone.incidents[0].hazard.position == room.incidents[0].hazard.position


def test_a_run_says_how_long_it_took_and_what_the_policy_would_have_done():
    recording = played("ask_first")
    row, (event,) = run_row(recording), event_rows(recording)
    assert row["acknowledge_mean_s"] == pytest.approx(8.0, abs=0.05)
    assert row["assign_mean_s"] == pytest.approx(20.0, abs=0.1)
    assert (row["person_orders"], row["overrides"], row["unanswered"]) == (1, 0, 0)
    assert event["acknowledge_s"] == row["acknowledge_mean_s"]
    assert event["decided_by"] == "person"
    assert event["policy_would_send"] == event["responder"]


def test_without_a_control_room_no_row_says_a_word_of_one():
    plain = build({**TEAM, "events": [ALARM], "horizon_s": 60.0}, {})
    recording = simulate(plain, seed=3)
    assert "overrides" not in measures_of(plain)
    assert "overrides" not in run_row(recording)
    assert "decided_by" not in event_rows(recording)[0]
    assert "mode" not in plain.model_dump(mode="json")["dispatch"]


def test_who_may_only_look_is_refused_and_the_policy_goes_on():
    recording = simulate(scenario("ask_first", role="look"), seed=3)
    assert [f.code for f in of_people(recording)] == [m.NOT_PERMITTED]
    assert recording.events[0].times["assigned"] == pytest.approx(5.0, abs=0.01)


def test_too_slow_it_is_told_that_the_policy_was_first():
    slowly = {"median": 70.0, "spread": 0.0}
    slow = scenario("ask_first", decide_s=slowly, overrules=[{"sends": "guard"}])
    recording = simulate(slow, seed=3)
    orders = [f for f in recording.facts if f.action == "assign" and f.code == m.OK]
    assert orders[0].role is None
    assert unnamed(orders[0].cause, "60 s") == []
    assert orders[0].time == pytest.approx(65.0, abs=1.1)
    assert run_row(recording)["unanswered"] == 1


def test_a_median_that_is_given_alone_leaves_the_usual_spread():
    person = scenario("ask_first", decide_s={"median": 70.0}).dispatch.person
    assert (person.decide_s.median, person.decide_s.spread) == (70.0, 0.5)
