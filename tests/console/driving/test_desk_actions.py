"""The desk: history and instructions of events, and work that people hand over to each other."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.console.simulated_phone import FIRE, PhonePage

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.recordings.reading import Opened

STEPS = "# Fire\nPeople first.\n- [ ] Ring 112\n- Close the doors\n"


@pytest.fixture
def desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> PhonePage:
    """Ana and Ben at pages of their own, a fire that waits, and instructions for it."""
    (tmp_path / "fire.md").write_text(STEPS)
    changes = {"events": FIRE, "dispatch__mode": "ask_first"}
    instructions = {"instructions": {"fire": str(tmp_path / "fire.md")}}
    one = PhonePage(monkeypatch, client="a1", **changes, **instructions)
    one.are_open("a1", "b1", role="supervise")
    for client, name in (("a1", "ana"), ("b1", "ben")):
        assert one.do("room_join", client=client, name=name, role="supervise")[0]
    one.until(lambda: one.lines_of("events") and one.lines_of("events")[-1]["events"])
    one.let(0.3)
    return one


def details(one: PhonePage, **about: Any) -> dict[str, Any]:
    assert one.do("event_details", **about)[0]
    found: dict[str, Any] = one.lines_of("done")[-1]["details"]
    return found


def happened(one: PhonePage) -> list[tuple[str, str, str]]:
    return [(s["what"], s["who"], s["device"]) for s in details(one, event=1)["history"]]


def control(one: PhonePage) -> dict[str, Any]:
    one.let(0.3)
    line: dict[str, Any] = one.lines_of("control")[-1]
    return line


def row(one: PhonePage) -> dict[str, Any]:
    one.let(0.3)
    shown: dict[str, Any] = one.lines_of("events")[-1]["events"][0]
    return shown


def offered(one: PhonePage, client: str = "a1", **about: Any) -> tuple[bool, str]:
    done: tuple[bool, str] = one.do("hand_over", client=client, **{"to": "ben", "note": ""} | about)
    return done


def answered(one: PhonePage, accept: bool = True, client: str = "b1") -> tuple[bool, str]:
    (offer,) = control(one)["offers"]
    about = {"offer": offer["number"], "accept": accept, "role": "supervise"}
    done: tuple[bool, str] = one.do("hand_over_answer", client=client, within=60.0, **about)
    return done


# --- history and instructions -----------------------------------------------------------------


def test_the_history_of_an_event_says_who_did_what(desk):
    assert desk.do("event_acknowledge", event=1)[0]
    assert desk.do("mission", robot="robot-1", event=1, role="supervise")[0]
    desk.let(0.5)
    assert happened(desk) == [
        ("reported", "", ""),
        ("acknowledge", "ana", ""),
        ("assign", "ana", "robot-1"),
    ]
    assert desk.do("mission_found", event=1, finding="confirmed")[0]
    desk.let(0.5)
    assert ("confirmed", "", "robot-1") in happened(desk)


def test_a_recording_has_the_same_history(desk):
    about = {"event": 1, "decisions": None}
    assert desk.do("event_acknowledge", event=1)[0]
    assert desk.do("event_note", event=1, text="smoke")[0]
    assert desk.do("mission", robot="robot-1", role="supervise", reason="nearest", **about)[0]
    desk.let(5.0)
    assert desk.do("event_false_alarm", reason="toast", **about)[0]
    desk.let(0.5)
    run = desk.world.run
    playback = replace(run.recording(), events=[run.dva.core.events.get(1)])
    run_so_far = RecordedRun(Opened(playback, {}, None, 0.0), "desk")
    recorded = run_so_far.system.room(run.clock.now).histories
    steps = [(step.what, step.who, step.reason) for step in recorded[1].steps]
    assert len(steps) == 5
    live = details(desk, event=1)["history"]
    assert steps == [(step["what"], step["who"], step["reason"]) for step in live]


def test_a_shift_begins_with_the_newest_steps_of_all_events(desk):
    about = {"kind": "flood", "severity": "low", "x_m": 20.0, "y_m": 12.0}
    assert desk.do("event_raise", **about)[0]
    desk.let(0.5)
    assert {step["event"] for step in details(desk)["history"]} == {1, 2}


def test_the_history_of_an_event_that_is_not_there_is_refused(desk):
    assert desk.do("event_details", event=99) == (False, "there is no event 99")


def test_steps_of_the_instructions_are_ticked_for_everybody_and_can_be_taken_back(desk):
    lines = details(desk, event=1)["instructions"]
    assert [(line["text"], line["step"]) for line in lines] == [
        ("Fire", None),
        ("People first.", None),
        ("Ring 112", 0),
        ("Close the doors", 1),
    ]
    assert desk.do("event_tick", event=1, step=1, done=True) == (True, "done: Close the doors")
    done = [line["done"] for line in details(desk, client="b1", event=1)["instructions"]]
    assert [by and by["label"] for by in done] == [None, None, None, "ana"]

    assert desk.do("event_tick", event=1, step=1, done=False)[0]
    assert not any(line["done"] for line in details(desk, event=1)["instructions"])


@pytest.mark.parametrize(("event", "step"), [(1, 2), (99, 0)])
def test_a_step_that_is_not_there_is_refused(desk, event, step):
    assert not desk.do("event_tick", event=event, step=step, done=True)[0]


def test_a_robot_that_a_person_drives_to_an_event_is_assigned_to_it(desk):
    about = {"event": 1, "reason": "I know the way", "role": "supervise", "within": 60.0}
    done, text = desk.do("take_over", robot="robot-1", **about)
    assert done, text
    assert row(desk)["state"] == "assigned"
    assert row(desk)["assigned"] == ["robot-1", "console-1"]


# --- handing over -----------------------------------------------------------------------------


def test_a_colleague_who_accepts_answers_for_the_event_and_its_robot(desk):
    assert desk.do("event_acknowledge", event=1)[0]
    assert desk.do("mission", robot="robot-1", event=1, role="supervise")[0]
    assert offered(desk, note="smoke already")[0]
    (offer,) = control(desk)["offers"]
    about = [offer[key] for key in ("sender", "to", "events", "robots", "note", "whole")]
    assert about == ["ana", "ben", [1], ["robot-1"], "smoke already", True]

    done, text = answered(desk)
    assert done, text
    assert control(desk)["owners"] == [{"event": 1, "label": "ben"}]
    assert row(desk)["assigned"] == ["robot-1", "ben"]
    assert row(desk)["note"] == "handed over by ana to ben: smoke already"
    desk.let(10.0)
    assert desk.robot(0).controller.mode is Mode.MISSION

    about = {"event": 1, "finding": "confirmed"}
    assert not desk.do("mission_found", client="a1", **about)[0]
    assert desk.do("mission_found", client="b1", **about)[0]
    assert row(desk)["state"] == "confirmed"


def test_a_robot_in_the_hands_of_who_goes_is_in_those_of_who_comes(desk):
    assert desk.do("take", robots=["robot-2"])[0]
    assert offered(desk)[0]
    assert answered(desk)[0]
    held = [drive["label"] for drive in seat(desk, "b1")["drives"]]
    assert held == ["robot-2"]
    assert not seat(desk, "a1")["drives"]


def seat(one: PhonePage, client: str) -> dict[str, Any]:
    """The newest line about a page's seat, with labels for numbers."""
    one.let(0.5)
    lines = [line for line in one.lines_of("seat") if line["seat"] == client]
    things = {thing["i"]: thing["label"] for thing in one.lines_of("scene")[-1]["things"]}
    newest: dict[str, Any] = dict(lines[-1])
    newest["drives"] = [drive | {"label": things[drive["i"]]} for drive in newest["drives"]]
    return newest


def test_one_event_is_given_to_a_colleague(desk):
    assert offered(desk, event=1)[0]
    assert control(desk)["offers"][0]["whole"] is False
    assert answered(desk)[0]
    assert control(desk)["owners"] == [{"event": 1, "label": "ben"}]


def test_who_declines_changes_nothing(desk):
    assert desk.do("event_acknowledge", event=1)[0]
    assert offered(desk)[0]
    assert answered(desk, accept=False)[0]
    assert control(desk)["owners"] == []
    assert any("ben declines event 1 of ana" in line["what"] for line in desk.lines_of("story"))


def test_who_offers_sees_the_answer_until_the_next_offer_or_the_end_of_the_page(desk):
    for accept in (False, True):
        assert offered(desk, event=1)[0]
        (offer,) = control(desk)["offers"]
        assert offer["accepted"] is None
        assert answered(desk, accept)[0]
        (offer,) = control(desk)["offers"]
        assert offer["accepted"] is accept
    desk.actions.take({"id": "bye-release-a1", "client": "a1", "do": "release"})
    assert control(desk)["offers"] == []


@pytest.mark.parametrize(
    ("about", "words"),
    [({"to": "eve"}, "'eve' is not there"), ({"to": "ana"}, "already"), ({"event": 9}, "not open")],
)
def test_work_is_offered_only_to_somebody_else_who_is_there(desk, about, words):
    done, text = offered(desk, **about)
    assert not done
    assert words in text


def test_only_the_colleague_answers_an_offer_and_only_once(desk):
    assert offered(desk, event=1)[0]
    (offer,) = control(desk)["offers"]
    about = {"offer": offer["number"], "accept": True}
    assert desk.do("hand_over_answer", client="a1", **about) == (False, "that offer is over")
    assert desk.do("hand_over_answer", client="b1", role="supervise", **about)[0]
    assert desk.do("hand_over_answer", client="b1", **about) == (False, "that offer is over")


def test_an_offer_to_a_page_that_is_gone_is_withdrawn(desk):
    assert offered(desk, event=1)[0]
    desk.actions.take({"id": "bye-release-b1", "client": "b1", "do": "release"})
    assert control(desk)["offers"] == []


def test_a_new_offer_replaces_the_one_before(desk):
    assert offered(desk, event=1, note="first")[0]
    assert offered(desk, event=1, note="second")[0]
    (offer,) = control(desk)["offers"]
    assert offer["note"] == "second"
