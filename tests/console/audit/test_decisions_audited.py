"""The audit log of an attached console: its own decisions by their answers, others by the DVA's."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers.console.remote_console import OWN, RemotePage, attached
from helpers.wording import unnamed

from dva_sim.agents.device import AUDIT
from dva_sim.console.audit.audit_measures import measured
from dva_sim.protocol import messages as m
from dva_sim.recordings.audit_log import verify


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[RemotePage]:
    with attached(monkeypatch, tmp_path) as one:
        assert unnamed(one.ask("room_join", name="ana")["text"], "ana", "supervise") == []
        yield one


def silence_records(page: RemotePage) -> None:
    """Whatever the DVA publishes of decisions is lost."""
    publish = page.world.world.run.network.publish

    def lossy(node: str, topic: str, payload: object, size: int) -> None:
        if topic != AUDIT:
            publish(node, topic, payload, size)

    page.world.world.run.network.publish = lossy  # type: ignore[method-assign]


def test_a_decision_is_one_row_by_the_person_at_the_page_with_what_the_policy_advised(page):
    assert page.ask("event_acknowledge", event=1)["ok"]
    assert page.ask("event_assign", event=1, device="guard-1", reason="is near")["ok"]
    rows = page.written()

    (seen,) = [row for row in rows if row.action == "acknowledge"]
    assert (seen.author, seen.device, seen.role, seen.event) == ("ana", OWN, "supervise", 1)
    assert seen.details["waited_s"] > 0
    (sent,) = [row for row in rows if row.action == "assign"]
    assert (sent.author, sent.subject, sent.cause) == ("ana", "guard-1", "is near")
    assert sent.details["advised"]
    assert sent.details["arrival_s"] > 0
    assert measured(rows)["assigned_by_people"] == 1
    assert verify(page.keeper.path).problem is None


def test_a_decision_whose_record_is_lost_is_a_row_all_the_same(page):
    silence_records(page)
    assert page.ask("event_assign", event=1, device="guard-1", reason="is near")["ok"]
    rows = page.written()

    (sent,) = [row for row in rows if row.action == "assign"]
    assert (sent.author, sent.device, sent.role) == ("ana", OWN, "supervise")
    assert (sent.subject, sent.cause, sent.outcome) == ("guard-1", "is near", "done")
    assert "advised" not in sent.details  # unknown is no override
    assert measured(rows)["overrides"] == 0


def test_a_refusal_is_one_row_with_its_reason(page):
    refused = page.ask("event_assign", event=77, device="guard-1")
    page.let(1.0)

    (row,) = [row for row in page.written() if row.action == "assign"]
    assert (row.author, row.outcome, row.text) == ("ana", "refused", refused["text"])


def test_whether_an_order_was_done_that_nobody_answered_is_unknown(page):
    assert page.world.do("server_stop")[0]
    answer = page.ask("event_assign", event=1, device="guard-1", reason="is near")
    assert (answer["ok"], "DVA" in answer["text"]) == (False, True)

    (row,) = [row for row in page.written() if row.action == "assign"]
    assert (row.author, row.outcome, row.text) == ("ana", "unknown", answer["text"])


def test_what_others_and_the_policy_decide_is_a_row_by_the_dvas_record(page):
    world = page.world
    world.do("room_join", name="bob", role="supervise")
    world.do("event_acknowledge", event=1, role="supervise")
    world.do("event_note", event=1, text="smoke", role="supervise")
    world.do("dispatch_mode", mode="automatic", role="supervise")
    page.until(lambda: "min_eta" in str(page.lines_of("story")))
    page.let(0.5)
    rows = {(row.author, row.action): row for row in page.written()}

    assert {("bob", "acknowledge"), ("min_eta", "assign")} <= rows.keys()
    assert rows["bob", "note"].text == "smoke"
    assert rows["bob", "set dispatch"].details["mode"] == "automatic"


def test_what_was_decided_without_an_answer_is_told_once_the_dva_publishes_it(page):
    record = m.AuditRecord(OWN, "control room", "escalate", "", m.OK, "", "supervise", 1)
    page.pages.hear_record(record)

    (row,) = [row for row in page.written() if row.action == "escalate"]
    assert (row.author, row.outcome) == ("control room", "done")


def test_without_a_name_one_is_called_by_ones_page(page):
    assert page.ask("event_note", client="program-drive", event=1, text="smoke")["ok"]
    assert page.ask("room_join", client="c2", name="")["text"].startswith("you are supervise-1")
    page.actions.take({"id": "bye-1", "client": "c2", "do": "release"})
    page.let(1.0)
    assert [room["label"] for room in page.lines_of("control")[-1]["rooms"]] == ["ana"]

    rows = page.written()
    (note,) = [row for row in rows if row.action == "note"]
    assert (note.author, note.text.split(": ")[0]) == ("program", "smoke")
    assert "release" not in {row.action for row in rows}  # the page that left held nothing


def test_pages_are_told_how_the_log_stands(page):
    assert page.ask("event_acknowledge", event=1)["ok"]
    page.let(0.5)
    line = page.lines_of("audit")[-1]

    assert (line["rows"], line["lasting"], line["problem"]) == (page.keeper.number, True, "")
    assert line["hash"] == page.keeper.head
