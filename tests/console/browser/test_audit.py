"""The page Audit: rows, filter, export, and a log that somebody has changed by hand."""

import csv
import io
import json
import re
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from dva_sim.recordings.audit_log import verify_plain


def decided(page: Page) -> None:
    """Somebody acknowledges the first event and overrules the policy."""
    page.get_by_role("button", name=re.compile("^Event 1 ")).click()
    page.get_by_role("button", name="Acknowledge").click()
    expect(page.get_by_role("button", name="Acknowledge")).to_have_count(0)
    page.get_by_role("radio", name="guard-1").check()
    page.get_by_label("Reason or note").fill("=1+1, a person has to look")
    page.get_by_role("button", name="Send guard-1").click()
    expect(page.get_by_role("region", name="Event in hand")).to_contain_text("assign by")


@pytest.fixture
def logged(own_world, visit) -> Page:
    """The page Audit of a world in which somebody has decided."""
    page = visit.open(own_world("--site", "office-block")[0].drive, "events")
    decided(page)
    page.get_by_role("link", name="Audit").click()
    return page


def test_what_was_decided_stands_in_the_log_is_measured_filtered_and_exported(logged):
    table = logged.get_by_role("table", name="Audit log")
    expect(table).to_contain_text("acknowledge")
    expect(logged.get_by_role("status", name="Verification")).to_contain_text("Verified: 3 rows")
    measures = logged.get_by_role("region", name="Measures")
    expect(measures).to_contain_text("1 event")
    expect(measures).to_contain_text("Overrides of the policy1, expected 33 s later (median)")
    logged.get_by_text("What the policy would have done").click()
    expect(measures).to_contain_text("would have sent robot-2 (41 s)")

    rows = table.locator("tbody tr")
    expect(rows).to_have_count(3)
    logged.get_by_label("Filter").fill("assign guard-1")
    expect(rows).to_have_count(1)
    logged.get_by_label("Filter").fill("nothing of the kind")
    expect(rows).to_have_text("No row fits.")

    texts = []
    for name in ("Export as CSV", "Export as JSON"):
        with logged.expect_download() as download:
            logged.get_by_role("link", name=name).click()
        texts.append(Path(download.value.path()).read_text(encoding="utf-8"))
    kept = list(csv.DictReader(io.StringIO(texts[0])))
    assert [row["action"] for row in kept] == ["begin", "acknowledge", "assign"]
    assert kept[2]["cause"].startswith("'=1+1")  # a spreadsheet computes nothing
    plain = json.loads(texts[1])["rows"]
    assert plain[2]["cause"].startswith("=1+1")
    assert verify_plain(plain).problem is None


def test_a_row_changed_by_hand_is_found_out_by_who_may_look_too(own_world, visits, tmp_path):
    file = tmp_path / "audit.sqlite"
    world, _ = own_world("--site", "office-block", "--audit", str(file))
    page = visits().open(world.drive, "events")
    decided(page)
    page.get_by_role("link", name="Audit").click()
    expect(page.get_by_role("status", name="Verification")).to_contain_text("Verified")

    with closing(sqlite3.connect(file, isolation_level=None)) as by_hand:
        by_hand.execute("DROP TRIGGER audit_is_not_changed")
        by_hand.execute("UPDATE audit SET subject = 'robot-2' WHERE action = 'assign'")
    page.get_by_role("button", name="Verify").click()
    looker = visits().open(world.look, "audit")
    for each in (page, looker):
        expect(each.get_by_role("status", name="Verification")).to_contain_text(
            "Broken: row 3 was changed"
        )
    expect(looker.get_by_role("table", name="Audit log")).to_contain_text("begin")
