"""People at a console's control rooms: what they decide goes by messages, and the DVA judges it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.console.simulated_phone import FIRE, PhonePage
from helpers.console.waiting_for_disk import take_what_is_safe
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.audit.audit_keeper import AuditKeeper
from dva_sim.core.events import State
from dva_sim.protocol.mistakes import check_message
from dva_sim.recordings.audit_log import AuditRow, read_rows, verify


def page(monkeypatch: pytest.MonkeyPatch, **changes: Any) -> PhonePage:
    """A fire in North office after 2 s, two robots, two guards; the policy asks first."""
    usual = {"bystander__count": 0, "events": FIRE, "dispatch__mode": "ask_first"}
    return PhonePage(monkeypatch, client="a1", **usual | changes)


@pytest.fixture
def room(monkeypatch: pytest.MonkeyPatch) -> PhonePage:
    """One person who supervises, and a fire that waits."""
    one = page(monkeypatch)
    done, text = one.do("room_join", name="ana", role="supervise")
    assert (done, unnamed(text, "ana", "supervise")) == (True, [])
    fire(one)
    return one


def fire(one: PhonePage) -> None:
    """Wait until it is reported and told."""
    one.until(lambda: events(one))
    one.let(0.3)


def events(one: PhonePage) -> list[dict[str, Any]]:
    """Events as a page receives them."""
    shown = one.lines_of("events")
    return list(shown[-1]["events"]) if shown else []


def event(one: PhonePage, number: int = 1) -> dict[str, Any]:
    one.let(0.3)
    return next(row for row in events(one) if row["number"] == number)


def alarms(one: PhonePage) -> list[dict[str, Any]]:
    one.let(1.0)
    return list(one.lines_of("alarms")[-1]["alarms"])


def sent_by(one: PhonePage, label: str) -> list[bytes]:
    """The messages that a device has sent, in their order."""
    ids = [i for i, name in one.world.run.stage.labels.items() if name == label]
    return [data for source, _, data in one.heard if source in ids and isinstance(data, bytes)]


def test_an_event_is_acknowledged_once_and_the_second_is_told_by_whom(room):
    assert room.do("event_acknowledge", event=1)[0]
    assert event(room)["acknowledged"]["label"] == "ana"

    assert room.do("room_join", client="b1", name="ben", role="dispatch")[0]
    done, text = room.do("event_acknowledge", client="b1", event=1)
    assert not done
    assert "acknowledged by ana" in text


@pytest.mark.parametrize(
    ("what", "asked"),
    [
        ("event_acknowledge", {}),
        ("event_note", {"text": "smoke"}),
        ("mission", {"robot": 0}),
        ("take_over", {"robot": 0, "reason": "closer"}),
    ],
)
def test_what_is_under_way_is_answered_though_its_person_takes_another_name(room, what, asked):
    taken = {"client": "a1", "role": "supervise"}
    about = asked if what == "take_over" else {"event": 1, **asked}
    room.actions.take({"id": "under way", "do": what, **taken, **about})
    assert room.do("room_join", name="bea", role="supervise")[0]
    room.until(lambda: any(line["id"] == "under way" for line in room.lines_of("done")))

    (line,) = (line for line in room.lines_of("done") if line["id"] == "under way")
    assert (line["ok"], "outcome" in line) == (True, False)
    room.let(0.3)
    assert [one["label"] for one in room.lines_of("control")[-1]["rooms"]] == ["bea"]
    room.until(lambda: left(room, "ana"), 400.0, 5.0)  # a robot that it has sent goes on


def left(one: PhonePage, label: str) -> bool:
    """True if a device has left."""
    return all(d.silent for d in one.world.run.stage.devices if d.label == label)


def test_who_is_sent_goes_and_what_the_policy_would_have_done_is_told(room):
    done, _ = room.do("event_proposal", event=1)
    assert done
    proposal = room.lines_of("done")[-1]["proposal"]
    assert proposal["label"]
    assert {who["label"] for who in proposal["candidates"]} >= {"guard-1", "guard-2", "robot-1"}
    other = next(
        who["label"]
        for who in proposal["candidates"]
        if who["can"] and not who["robot"] and who["label"] != proposal["label"]
    )
    done, text = room.do("event_assign", event=1, device=other, reason="knows the place")
    assert done, text
    assert event(room)["assigned"] == [other]
    assert event(room)["decided"]["reason"] == "knows the place"


def test_who_is_at_another_event_is_not_free_and_the_dva_refuses_to_send_it(room):
    about = {"kind": "flood", "severity": "low", "x_m": 8.0, "y_m": 12.0}
    assert room.do("event_raise", **about)[0]
    number = room.lines_of("done")[-1]["event"]
    assert room.do("event_assign", event=1, device="guard-1")[0]
    room.do("event_proposal", event=number)
    who = {one["label"]: one for one in room.lines_of("done")[-1]["proposal"]["candidates"]}
    assert (who["guard-1"]["free"], who["guard-2"]["free"]) == (False, True)

    done, text = room.do("event_assign", event=number, device="guard-1")
    assert not done
    assert "guard-1" in text


def test_of_two_who_decide_with_the_same_knowledge_the_second_changes_nothing(room):
    assert room.do("room_join", client="b1", name="ben", role="dispatch")[0]
    seen = event(room)["decisions"]
    assert room.do("event_assign", event=1, device="guard-1", decisions=seen)[0]
    done, text = room.do("event_assign", client="b1", event=1, device="guard-2", decisions=seen)

    assert not done
    assert "decided on since: " in text
    assert "ana" in text
    assert event(room)["assigned"] == ["guard-1"]


@pytest.mark.parametrize(
    ("what", "about", "state"),
    [
        ("event_false_alarm", {"reason": "burnt toast"}, State.REFUTED),
        ("event_escalate", {"reason": "too large for us"}, State.ESCALATED),
    ],
)
def test_an_event_is_ended_by_a_decision(room, what, about, state):
    done, text = room.do(what, event=1, **about)

    assert done, text
    assert event(room)["state"] == str(state)


def test_who_was_sent_is_taken_off_and_a_note_is_for_all(room):
    assert room.do("event_assign", event=1, device="guard-1")[0]
    assert room.do("event_take_off", event=1, device="guard-1", reason="needed here")[0]
    assert event(room)["assigned"] == []
    assert room.do("event_note", event=1, text="the door is locked")[0]
    assert event(room)["note"] == "the door is locked"


def test_an_event_is_raised_at_a_place_and_nowhere_else(room):
    about = {"kind": "flood", "severity": "critical", "x_m": 20.0, "y_m": 12.0}
    assert room.do("event_raise", **about)[0]
    number = room.lines_of("done")[-1]["event"]
    assert event(room, number)["kind"] == "flood"
    assert event(room, number)["severity"] == "critical"
    done, text = room.do("event_raise", **about | {"x_m": 1e5})
    assert not done
    assert unnamed(text, "outside", "nobody can go") == []


@pytest.mark.parametrize("role", ["look", "drive"])
def test_the_dva_refuses_what_a_role_does_not_allow_though_the_web_let_it_pass(monkeypatch, role):
    one = page(monkeypatch)
    fire(one)
    assert one.do("room_join", name="eve", role=role)[0]
    for what, about in {
        "event_acknowledge": {"event": 1},
        "event_assign": {"event": 1, "device": "guard-1"},
        "dispatch_mode": {"mode": "automatic"},
        "take_over": {"robot": "robot-1", "reason": "mine"},
    }.items():
        done, text = one.do(what, **about)
        assert not done, what
        assert f"eve has the role {role}" in text


def test_a_dispatcher_does_not_take_a_robot_from_its_holder(monkeypatch):
    one = page(monkeypatch)
    assert one.do("room_join", name="dan", role="dispatch")[0]
    done, text = one.do("take_over", robot="robot-1", reason="mine")

    assert not done
    assert "needs supervise" in text


def test_the_policy_acts_by_itself_once_it_is_let(room):
    assert event(room)["assigned"] == []
    assert room.lines_of("control")[-1]["dispatch"]["mode"] == "ask_first"
    assert room.do("dispatch_mode", mode="automatic")[0]

    room.let(1.0)
    assert event(room)["assigned"]
    shown = room.lines_of("control")[-1]["dispatch"]
    assert (shown["mode"], shown["switched"]["label"]) == ("automatic", "ana")


def test_a_robot_that_another_drives_is_taken_over_with_what_it_was_sent_to(room):
    assert room.do("take", client="b1", robots=["robot-1"], role="drive")[0]
    assert room.do("start", client="b1", within=60)[0]
    done, text = room.do("take_over", robot="robot-1", reason="ben is away", role="supervise")

    assert done, text
    assert room.robot(0).holder[0] == room.world.seating.person(1).device.id_tag
    assert room.robot(0).controller.mode is not Mode.TELEOPERATION
    assert room.seat()["drives"][0]["phase"] == "held"


@pytest.mark.parametrize("wait", [0.0, 8.0], ids=["before it is held", "while it is driven"])
def test_a_robot_is_taken_over_from_an_operator_with_the_event_it_was_sent_to(monkeypatch, wait):
    one = page(monkeypatch, operator__count=2)
    assert one.do("room_join", name="ana", role="supervise")[0]
    fire(one)
    assert one.do("event_assign", event=1, device="robot-1")[0]
    one.let(wait)
    assert event(one)["assigned"] == ["robot-1", "operator-1"]
    done, text = one.do("take_over", robot="robot-1", reason="I know the place", role="supervise")

    assert done, text
    assert event(one)["assigned"] == ["robot-1", "console-1"]
    assert event(one)["decided"]["reason"] == "I know the place"
    assert one.seat()["order"]["event"] == 1
    assert one.seat()["drives"][0]["phase"] == "held"


@pytest.mark.system
def test_a_robot_goes_and_looks_by_itself_and_is_given_back(room):
    done, text = room.do("mission", robot="robot-1", event=1)
    assert done, text
    assert room.robot(0).controller.mode is Mode.MISSION

    room.until(lambda: room.robot(0).controller.grant is None, 400.0, 5.0)


def test_an_alarm_is_seen_at_the_dva_where_an_event_is_behind_it(room):
    (alarm,) = [one for one in alarms(room) if one["event"] == 1]
    assert alarm["state"] == "unacknowledged"
    assert alarm["text"] == "Fire, North office"
    assert room.do("alarm_acknowledge", alarm=alarm["key"])[0]

    (alarm,) = [one for one in alarms(room) if one["event"] == 1]
    assert (alarm["state"], alarm["seen_by"]) == ("acknowledged", "ana")
    assert event(room)["acknowledged"]["label"] == "ana"


ENDS = ["event_false_alarm", "event_escalate"]


@pytest.mark.parametrize("what", [*ENDS, "event_assign", "event_note", "mission"])
def test_who_decides_on_an_event_has_seen_its_alarm(room, what):
    more = {
        "event_false_alarm": {"reason": "welding"},
        "event_assign": {"device": "robot-1"},
        "event_note": {"text": "smoke"},
        "mission": {"robot": "robot-1"},
    }
    assert [one["state"] for one in alarms(room) if one["event"] == 1] == ["unacknowledged"]
    done, text = room.do(what, event=1, **more.get(what, {}))
    assert done, text

    states = [one["state"] for one in alarms(room) if one["key"] == "event 1"]
    assert states == ([] if what in ENDS else ["acknowledged"])
    assert (event(room)["acknowledged"] is None) == (what in ENDS)


def test_a_decision_that_is_refused_sees_nothing(room):
    assert not room.do("event_take_off", event=1, device="robot-1")[0]
    assert [one["state"] for one in alarms(room) if one["event"] == 1] == ["unacknowledged"]


def test_a_shelved_alarm_comes_back_and_a_row_that_is_gone_is_told(room):
    (alarm,) = [one for one in alarms(room) if one["event"] == 1]
    assert not room.do("alarm_shelve", alarm=alarm["key"], for_s=60)[0]  # without a reason
    assert room.do("alarm_shelve", alarm=alarm["key"], for_s=60, reason="a drill")[0]
    assert not [one for one in alarms(room) if one["event"] == 1]
    (shelved,) = room.lines_of("alarms")[-1]["shelved"]
    assert (shelved["shelved_by"], shelved["shelved_why"]) == ("ana", "a drill")
    room.let(60.0)
    assert [one for one in alarms(room) if one["event"] == 1]
    done, _ = room.do("alarm_acknowledge", alarm="event 99")
    assert not done


def test_a_critical_alarm_is_shelved_only_once_it_is_acknowledged(room):
    about = {"kind": "flood", "severity": "critical", "x_m": 20.0, "y_m": 12.0}
    assert room.do("event_raise", **about)[0]
    number = room.lines_of("done")[-1]["event"]
    room.let(1.0)
    shelf = {"alarm": f"event {number}", "for_s": 60, "reason": "a drill"}
    done, text = room.do("alarm_shelve", **shelf)
    assert (done, unnamed(text, "critical", "acknowledged")) == (False, [])

    assert room.do("event_acknowledge", event=number)[0]
    room.let(1.0)
    assert room.do("alarm_shelve", **shelf)[0]


def test_a_page_that_is_gone_for_good_has_no_room_any_more(room):
    room.actions.take({"id": "bye-release-a1", "client": "a1", "do": "release"})
    room.let(1.0)

    assert room.lines_of("control")[-1]["rooms"] == []


def test_every_message_of_a_control_room_keeps_the_schema(room):
    room.do("event_acknowledge", event=1)
    room.do("event_assign", event=1, device="guard-1", reason='<b>why & "how"</b>')
    room.do("event_note", event=1, text="<script>alert(1)</script>")
    messages = sent_by(room, "ana")

    assert len(messages) > 5
    assert [found for data in messages for found in check_message(data)] == []


# --- the audit log ----------------------------------------------------------------------------


@pytest.fixture
def logged(room: PhonePage, tmp_path: Path) -> Iterator[PhonePage]:
    """Room with an audit log."""
    keeper = AuditKeeper(tmp_path / "audit.sqlite", lambda: room.world.clock.now, {})
    room.world.keep_audit(keeper)
    room.world.clock.every(0.05, lambda: take_what_is_safe(keeper))
    yield room
    keeper.close()


def written(one: PhonePage) -> list[AuditRow]:
    assert one.world.audited is not None
    keeper = one.world.audited.keeper
    keeper.close()
    one.world.audited = None
    return read_rows(keeper.path)


def test_each_action_is_a_row_with_author_role_cause_and_outcome(logged):
    logged.do("event_acknowledge", event=1, role="supervise")
    logged.do("event_assign", event=1, device="guard-1", reason="is near", role="supervise")
    logged.do("take", robots=["robot-1"], role="supervise")
    logged.do("event_assign", event=77, device="guard-1", role="supervise")
    rows = {(row.action, row.outcome): row for row in written(logged)}

    assert rows["acknowledge", "done"].author == "ana"
    sent = rows["assign", "done"]
    assert (sent.role, sent.subject, sent.cause, sent.event) == (
        *("supervise", "guard-1", "is near", 1),
    )
    assert sent.details["advised"]
    assert sent.details["waited_s"] > 0
    assert (rows["take", "done"].subject, rows["take", "done"].author) == ("robot-1", "ana")
    assert rows["assign", "refused"].text == "no event 77"


def test_nothing_new_is_done_while_the_log_cannot_be_written_but_whatever_stops_is(logged):
    assert logged.world.audited is not None
    keeper = logged.world.audited.keeper
    assert logged.do("take", robots=["robot-1"], role="drive")[0]
    keeper._log._file.execute("PRAGMA max_page_count = 1")
    keeper.put(keeper.entry("note", text="x" * 100_000))
    while not keeper.problem:
        keeper.take()
    done, text = logged.do("event_assign", event=1, device="guard-1", role="supervise")
    assert not done
    assert "audit log" in text
    assert event(logged)["assigned"] == []
    assert logged.do("stop")[0]
    assert logged.do("emergency", robots="all")[0]

    keeper._log._file.execute("PRAGMA max_page_count = 100000")
    keeper.put(keeper.entry("note"))
    while keeper.problem:
        keeper.take()
    assert logged.do("event_assign", event=1, device="guard-1", role="supervise")[0]
    found = [row.action for row in written(logged)]
    assert found.index("emergency") < found.index("assign")


def test_the_log_of_a_run_holds(logged):
    logged.do("event_acknowledge", event=1)
    path = logged.world.audited.keeper.path if logged.world.audited else Path()
    written(logged)

    assert verify(path).problem is None
    assert verify(path).is_ended
