"""The program itself: an event is acknowledged, a robot sent, taken over, driven, confirmed."""

import re
import signal
from itertools import pairwise

from helpers.console.console_program import started
from helpers.console.keyboard_driver import NEAR_FIRE, Driver
from helpers.processes.patience import PATIENCE_S, becomes
from playwright.sync_api import Page, expect

from dva_sim.console.replay.recorded_run import RecordedRun
from dva_sim.protocol.mistakes import check_message
from dva_sim.recordings.audit_log import read_rows
from dva_sim.recordings.reading import read_recording

DELAY_S = 0.25
NEAR_M = 2.5  # of the fire: there it can be seen
ASKS = ("--set", "dispatch.mode=ask_first", *NEAR_FIRE)  # the policy
# What goes by in this order, each as a part of a message.
MESSAGES = (
    *(b"<GetProposal>", b"<Acknowledge>", b"<Assign>", b"<Revoke>", b"<Assign>"),
    *(b"<PermissionRequest>", b"<StartTeleOp", b"<SetTeleOp>", b"<Finding>confirmed<"),
)
STEPS = "reported", "acknowledge", "assign", "confirmed"
ROWS = (
    "begin",
    "acknowledge",
    "assign",
    "revoke",
    "assign",
    "take over",
    "start",
    "confirm",
    "end",
)


def fire_in_hand(page: Page) -> None:
    """Wait for the fire, and for what the policy proposes."""
    page.get_by_role("button", name=re.compile("^Event 1 Fire")).click(timeout=1000 * PATIENCE_S)
    expect(page.get_by_role("region", name="Proposal")).to_contain_text(
        "min_eta", timeout=1000 * PATIENCE_S
    )


def in_order(wanted: tuple[str, ...] | tuple[bytes, ...], lines: list[str] | list[bytes]) -> None:
    """Assert that the wanted texts occur in this order."""
    at = -1
    for one in wanted:
        found = (n for n, text in enumerate(lines) if n > at and one in text)
        at = next(found, -1)
        assert at >= 0, one


def test_a_fire_is_acknowledged_sent_to_taken_over_reached_over_250_ms_and_confirmed(
    tmp_path, visit, programs
):
    record, audit = tmp_path / "story.mcap", tmp_path / "audit.sqlite"
    words = ["--record", record, "--audit", audit, "--set", f"link.delay_s={DELAY_S}"]
    words += ["--set", "operator.count=2"]  # one of them a person, the other one simulated
    console, address = started(programs, *ASKS, *words)
    page = visit.open(address, "events")
    base = address.partition("?")[0]
    fire_in_hand(page)

    page.get_by_role("button", name="Acknowledge", exact=True).click()
    expect(page.get_by_role("button", name="Acknowledge", exact=True)).to_have_count(0)
    robot = page.locator(".candidate").filter(has_text=re.compile("robot-.*free")).first
    label = robot.locator("span").first.inner_text()
    robot.get_by_role("radio").check()
    page.get_by_role("button", name=f"Send {label}").click()
    expect(page.get_by_role("region", name="Events")).to_contain_text(label)
    expect(page.get_by_role("region", name="Event in hand")).to_contain_text("assign by supervise")
    picture = page.get_by_role("region", name=f"Picture of {label}")
    expect(picture).to_contain_text("held by operator-1", timeout=1000 * PATIENCE_S)
    # What another operator's robot finds is not this person's to say.
    expect(page.get_by_role("button", name="Confirm")).to_have_count(0)
    page.get_by_label("Reason or note").fill("I drive it there by hand")
    page.get_by_role("button", name=f"Take over {label}").click()

    order = page.get_by_role("region", name="Order in hand")
    expect(order).to_contain_text("fire", timeout=1000 * PATIENCE_S)
    driver = Driver(page, base, label, DELAY_S)
    fire = next(event for event in driver.state()["events"] if event["kind"] == "fire")
    driver.drive_to(fire["x_m"], fire["y_m"], NEAR_M)
    page.get_by_role("button", name="Confirm").click()
    assert becomes(lambda: "confirmed" in str(driver.state()["events"]))

    page.get_by_role("link", name="Audit").click()
    expect(page.get_by_role("status", name="Verification")).to_contain_text("Verified")
    expect(page.get_by_role("region", name="Measures")).to_contain_text("1 event")
    page.close()  # it would complain that nobody is there any more
    console.send(signal.SIGINT)
    assert console.ends() == 0
    for file in (record, audit):
        checked = programs.start("check", file)
        assert checked.ends() == 0, checked.output + checked.complained
    in_order(ROWS, [row.action for row in read_rows(audit)])
    opened = read_recording(record)
    (history,) = RecordedRun(opened, record.name).system.room(opened.lasted).histories.values()
    in_order(STEPS, [step.what for step in history.steps])
    assert len({*history.steps}) == len(history.steps)
    sent = list(opened.playback.recorder.traffic or ())
    reports = [one.payload for one in sent if isinstance(one.payload, bytes)]
    in_order(MESSAGES, reports)
    assert [found for data in reports for found in check_message(data)] == []
    assert all(one.time <= later.time for one, later in pairwise(sent))


def test_people_decide_over_real_links_too(tmp_path, visit, programs):
    audit = tmp_path / "audit.sqlite"
    console, address = started(programs, *ASKS, "--links", "real", "--audit", audit)
    page = visit.open(address, "events")
    fire_in_hand(page)

    page.get_by_role("button", name="Acknowledge", exact=True).click()
    expect(page.get_by_role("button", name="Acknowledge", exact=True)).to_have_count(0)
    page.get_by_role("radio", name="guard-1").check()
    page.get_by_role("button", name="Send guard-1").click()
    expect(page.get_by_role("region", name="Events")).to_contain_text("guard-1")
    page.get_by_role("link", name="Audit").click()
    expect(page.get_by_role("table", name="Audit log")).to_contain_text("acknowledge")
    page.close()
    console.send(signal.SIGINT)
    assert console.ends() == 0
    checked = programs.start("check", audit)
    assert checked.ends() == 0, checked.output + checked.complained
