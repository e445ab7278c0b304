"""Control rooms in a run: their messages, priority, and driving a robot themselves."""

import json
from base64 import b64decode
from collections.abc import Callable
from typing import Any

import pytest

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.core.events import Cause, State
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode
from dva_sim.simulation.full.dva_trace import replay_dva, traced
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.simulation.scenario import build

ROBOT, GUARD, OPERATOR = id_of("robot", 1), id_of("guard", 1), id_of("operator", 1)
ALARM = {"kind": "gas_leak", "at_s": 5.0, "room": "Workshop", "reported": True}
TEAM = {"robot": {"count": 1}, "guard": {"count": 1}, "operator": {"count": 1}}
ROLES = {"control-room-1": "supervise", "control-room-2": "dispatch"}


class Staffed:
    """A run with two control rooms; the DVA asks them first."""

    def __init__(self, trace: Callable[[str], object] | None = None, **dispatch: Any) -> None:
        data = {**TEAM, "events": [ALARM], "dva": {"control_rooms": ROLES}, "horizon_s": 200.0}
        data["dispatch"] = {"mode": "ask_first", "decide_within_s": 100.0} | dispatch
        self.run = Run(build(data, {}), seed=3)
        if trace is not None:
            self.run.dva.core = traced(self.run.dva.core, trace, self.run.stage, None)
        self.rooms = [
            ControlRoomAgent(self.run.stage.device("control-room", number)) for number in (1, 2)
        ]
        for room in self.rooms:
            room.start()

    def until(self, time: float) -> None:
        self.run.clock.run(time)

    def ask(self, room: int, *bodies: m.Body) -> list[m.Reply]:
        """Replies to these requests, one after the other."""
        replies: list[m.Reply] = []
        for body in bodies:
            self.rooms[room].ask(body, replies.append)
            self.until(self.run.clock.now + 0.5)
        return replies

    @property
    def event(self) -> Any:
        return self.run.dva.core.events.get(1)


@pytest.fixture
def staffed() -> Staffed:
    staffed = Staffed()
    staffed.until(8.0)
    return staffed


def test_each_control_room_is_told_what_changes_and_of_each_decision(staffed):
    records: list[m.AuditRecord] = []
    first, other = staffed.rooms
    other.on_record = records.append
    assert first.dispatch is not None
    assert (first.dispatch.dispatch_mode, first.dispatch.role) == ("ask_first", "supervise")
    assert other.events[1].proposed is not None
    staffed.ask(0, m.Acknowledge(1), m.Assign(1, GUARD, decisions=0), m.AddNote(1, "mind the step"))
    reported = other.events[1]
    assert reported.acknowledged is not None
    assert (reported.acknowledged.label, reported.responder) == ("control-room-1", GUARD)
    assert (reported.event_state, reported.note, reported.proposed) == (
        "assigned",
        "mind the step",
        None,
    )
    assert [record.action for record in records] == ["acknowledge", "assign", "note"]


def test_of_two_who_decide_at_the_same_moment_one_wins(staffed):
    replies: dict[int, m.Reply] = {}
    for number, body in enumerate((m.Assign(1, GUARD, decisions=0), m.FalseAlarm(1, "toast", 0))):
        staffed.rooms[number].ask(body, lambda r, n=number: replies.update({n: r}))  # type: ignore[misc]
    staffed.until(10.0)
    assert sorted(reply.code for reply in replies.values()) == [m.OK, m.OUT_OF_ORDER]
    loser = next(n for n, reply in replies.items() if reply.code != m.OK)
    assert f"control-room-{2 - loser}" in replies[loser].text
    assert staffed.run.recorder.violations == {}


@pytest.mark.invariant("S2")
def test_a_supervisor_takes_a_robot_from_its_driver_and_drives_it_to_the_event(staffed):
    """Sent by hand, taken over from its operator, sent on a mission, and the leak is confirmed."""
    room = staffed.rooms[0]
    staffed.ask(0, m.Acknowledge(1), m.Assign(1, ROBOT))
    staffed.until(20.0)
    assert staffed.run.field.robots[ROBOT].controller.owner == OPERATOR
    permission = None
    while permission is None and staffed.run.clock.now < 40.0:
        (reply,) = staffed.ask(0, m.PermissionRequest(ROBOT, "missions", (), "force"))
        permission = reply.content if isinstance(reply.content, m.Permission) else None
    assert permission is not None
    (sent,) = staffed.ask(0, m.Assign(1, ROBOT, room.device.id_tag))
    assert (sent.code, room.orders[1].device) == (m.OK, ROBOT)
    event, answers = staffed.event, list[m.Reply]()
    inspect = m.Inspect(1, event.kind, event.position)
    room.device.ask(ROBOT, inspect, answers.append, session=permission.session)
    staffed.until(90.0)
    assert [answer.code for answer in answers] == [m.OK]
    room.device.progress(1, "arrived")
    report = m.EventReport(1, event.kind, event.position, 0.5, 0.9, "confirmed")
    assert staffed.ask(0, report)[0].code == m.OK
    assert event.state is State.CONFIRMED
    assert staffed.run.recorder.violations == {}
    actions = [fact.action for fact in staffed.run.dva.facts if fact.code == m.OK]
    assert actions[:2] == ["acknowledge", "assign"]
    assert "take_over" in [f.action for f in staffed.run.dva.facts]


@pytest.mark.invariant("S6")
def test_a_false_alarm_called_from_the_control_room_breaks_no_rule(staffed):
    staffed.ask(1, m.Assign(1, GUARD), m.FalseAlarm(1, "toast"))
    staffed.until(40.0)
    assert staffed.event.state is State.REFUTED
    assert staffed.run.recorder.violations == {}


@pytest.mark.invariant("S6")
def test_an_event_that_is_refuted_by_nobody_is_found_out(staffed):
    """The checker above can fail: the same end without anybody's word."""
    core = staffed.run.dva.core
    core.orders.transition(staffed.event, Cause.DISMISSED, staffed.run.clock.now)
    staffed.until(12.0)
    assert staffed.run.recorder.violations["S6"] > 0


def test_a_dva_whose_control_rooms_decided_is_replayed_from_its_trace(tmp_path):
    lines: list[str] = []
    staffed = Staffed(lines.append)
    staffed.until(8.0)
    staffed.ask(0, m.GetProposal(1), m.Assign(1, GUARD, decisions=0), m.SetDispatch("automatic"))
    staffed.run.dva.core.roles.appoint(id_of("control-room", 2), "supervise")
    staffed.ask(1, m.TakeOff(1, GUARD), m.SetDispatch("ask_first"), m.Escalate(1))
    staffed.run.dva.dismiss(id_of("control-room", 1))
    again = list(replay_dva(lines, tmp_path / "dva.jsonl"))
    assert len(again) > 50
    assert [one for one in again if one.then != one.now] == []
    kinds = {json.loads(line).get("do") for line in lines[1:]}
    assert "handle" in kinds


def test_after_a_lost_publication_the_list_tells(staffed):
    room = staffed.rooms[1]
    room.events.clear()
    staffed.until(25.0)
    assert 1 in room.events


def requests_seen(staffed: Staffed, room: int = 0) -> list[m.LoggedRequest]:
    (reply,) = staffed.ask(room, m.GetRequestLog())
    assert isinstance(reply.content, m.RequestLog)
    return list(reply.content.requests)


def test_requests_are_logged_once_a_control_room_has_asked_for_them(staffed):
    assert requests_seen(staffed) == []
    staffed.ask(1, m.Acknowledge(1), m.GetProposal(99))
    seen = [(decode(b64decode(entry.request)), entry) for entry in requests_seen(staffed)]
    own = [(one.body, entry.code) for one, entry in seen if one.source == id_of("control-room", 2)]
    assert (m.Acknowledge(1), m.OK) in own
    assert (m.GetProposal(99), m.UNKNOWN_EVENT) in own
    assert not any(isinstance(one.body, m.GetRequestLog) for one, _ in seen)
    assert [entry.service_time for _, entry in seen] == [0.0] * len(seen)  # the run's clock stands


def test_the_log_shows_requests_that_cannot_be_read(staffed):
    requests_seen(staffed)
    network = staffed.run.network
    wire = network.connect(id_of("control-room", 2), DVA, lambda *_: None, pipelined=False)
    wire.send(1, b"hello")
    staffed.until(staffed.run.clock.now + 1.0)
    unread = [entry for entry in requests_seen(staffed) if entry.size == 5]
    assert [(b64decode(e.request), e.code) for e in unread] == [(b"hello", m.BAD_MESSAGE)]


def test_a_run_whose_log_was_read_is_replayed_from_its_trace(tmp_path):
    lines: list[str] = []
    staffed = Staffed(lines.append)
    staffed.until(8.0)
    requests_seen(staffed)
    staffed.ask(0, m.Acknowledge(1))
    assert requests_seen(staffed)
    again = list(replay_dva(lines, tmp_path / "dva.jsonl"))
    assert len(again) > 10
    assert [one for one in again if one.then != one.now] == []
