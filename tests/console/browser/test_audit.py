"""The page Audit: rows, filter, export, and a log that somebody has changed by hand."""

import csv
import io
import json
import re
import sqlite3
from contextlib import closing
from pathlib import Path

from helpers.console.console_program import OFFICE, addresses_of, started
from helpers.console.desk import ASKS, NOTHING_YET, another, raised, sends
from playwright.sync_api import Page, expect

from dva_sim.recordings.audit_log import verify_plain

WORDS = *ASKS, *NOTHING_YET


def decided(page: Page) -> str:
    """Somebody raises an event and overrules the policy; return who is sent."""
    expect(page.locator(".desk-head")).to_contain_text("supervise-1")
    raised(page)
    page.get_by_role("button", name="Acknowledge", exact=True).click()
    expect(page.get_by_role("button", name="Acknowledge", exact=True)).to_have_count(0)
    guard = another(page)
    page.get_by_label("Reason or note").fill("=1+1, a person has to look")
    sends(page, guard).click()
    expect(page.get_by_role("region", name="Event in hand")).to_contain_text("assign by")
    page.get_by_role("link", name="Audit").click()
    return guard


def test_what_was_decided_stands_in_the_log_is_measured_filtered_and_exported(programs, visit):
    logged = visit.open(started(programs, OFFICE, *WORDS)[1], "events")
    guard = decided(logged)
    table = logged.get_by_role("table", name="Audit log")
    expect(table).to_contain_text("acknowledge")
    expect(logged.get_by_role("status", name="Verification")).to_contain_text("Verified: 5 rows")
    measures = logged.get_by_role("region", name="Measures")
    expect(measures).to_contain_text("1 event")
    expect(measures).to_contain_text("Overrides of the policy1, expected")
    logged.get_by_text("What the policy would have done").click()
    expect(measures).to_contain_text(re.compile(r"would have sent guard-\d \(100 min\)"))

    rows = table.locator("tbody tr")
    expect(rows).to_have_count(5)
    logged.get_by_label("Filter").fill(f"assign {guard}")
    expect(rows).to_have_count(1)
    logged.get_by_label("Filter").fill("nothing of the kind")
    expect(rows).to_have_text("No row fits.")

    texts = []
    for name in ("Export as CSV", "Export as JSON"):
        with logged.expect_download() as download:
            logged.get_by_role("link", name=name).click()
        texts.append(Path(download.value.path()).read_text(encoding="utf-8"))
    kept = list(csv.DictReader(io.StringIO(texts[0])))
    actions = ["begin", "room join", "raise", "acknowledge", "assign"]
    assert [row["action"] for row in kept] == actions
    assert kept[4]["cause"].startswith("'=1+1")  # a spreadsheet computes nothing
    plain = json.loads(texts[1])["rows"]
    assert plain[4]["cause"].startswith("=1+1")
    assert verify_plain(plain).problem is None


def test_a_row_changed_by_hand_is_found_out_by_who_may_look_too(programs, visits, tmp_path):
    file = tmp_path / "audit.sqlite"
    running = addresses_of(programs, *WORDS, "--audit", file)
    page = visits().open(running.drive, "events")
    decided(page)
    expect(page.get_by_role("status", name="Verification")).to_contain_text("Verified")

    with closing(sqlite3.connect(file, isolation_level=None)) as by_hand:
        by_hand.execute("DROP TRIGGER audit_is_not_changed")
        by_hand.execute("UPDATE audit SET subject = 'robot-2' WHERE action = 'assign'")
    page.get_by_role("button", name="Verify").click()
    looker = visits().open(running.look, "audit")
    for each in (page, looker):
        expect(each.get_by_role("status", name="Verification")).to_contain_text(
            "Broken: row 5 was changed"
        )
    expect(looker.get_by_role("table", name="Audit log")).to_contain_text("begin")
