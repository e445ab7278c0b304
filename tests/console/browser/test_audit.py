"""The page Audit: rows, filter, export, and a log that somebody has changed by hand."""

from __future__ import annotations

import csv
import io
import json
import sqlite3
from contextlib import closing
from pathlib import Path

from playwright.sync_api import Page, expect

from dva_sim.recordings.audit_log import verify_plain


def decided(page: Page) -> None:
    """Somebody acknowledges the first event and overrules the policy."""
    page.get_by_role("button", name="Event 1", exact=True).click()
    page.get_by_role("button", name="Acknowledge").click()
    expect(page.get_by_role("button", name="Acknowledge")).to_be_disabled()
    page.get_by_label("guard-1").check()
    page.get_by_label("Reason or note").fill("=1+1, a person has to look")
    page.get_by_role("button", name="Assign").click()
    expect(page.get_by_role("region", name="Event in hand")).to_contain_text("assign by")


def test_what_was_decided_stands_in_the_log_with_measures(own_world, visits) -> None:
    world, _ = own_world()
    page = visits().open(world.drive, "events")
    decided(page)
    page.get_by_role("link", name="Audit").click()

    table = page.get_by_role("table", name="Audit log")
    expect(table).to_contain_text("acknowledge")
    expect(page.get_by_role("status", name="Verification")).to_contain_text(
        "The chain holds: 3 rows"
    )
    measures = page.get_by_role("region", name="Measures")
    expect(measures).to_contain_text("1 event")
    expect(measures).to_contain_text("Overrides of the policy1, expected 33 s later (median)")
    page.get_by_text("What the policy would have done").click()
    expect(measures).to_contain_text("would have sent robot-2 (41 s)")


def test_rows_are_filtered_by_words(own_world, visits) -> None:
    world, _ = own_world()
    page = visits().open(world.drive, "events")
    decided(page)
    page.get_by_role("link", name="Audit").click()
    rows = page.get_by_role("table", name="Audit log").locator("tbody tr")
    expect(rows).to_have_count(3)

    page.get_by_label("Filter").fill("assign guard-1")
    expect(rows).to_have_count(1)
    page.get_by_label("Filter").fill("nothing of the kind")
    expect(rows).to_have_text("No row fits.")


def test_the_log_is_exported_with_its_hashes_and_without_formulas(own_world, visits) -> None:
    world, _ = own_world()
    page = visits().open(world.drive, "events")
    decided(page)
    page.get_by_role("link", name="Audit").click()
    texts = []
    for name in ("Export as CSV", "Export as JSON"):
        with page.expect_download() as download:
            page.get_by_role("link", name=name).click()
        texts.append(Path(download.value.path()).read_text(encoding="utf-8"))

    rows = list(csv.DictReader(io.StringIO(texts[0])))
    assert [row["action"] for row in rows] == ["begin", "acknowledge", "assign"]
    assert rows[2]["cause"].startswith("'=1+1")  # a spreadsheet computes nothing
    plain = json.loads(texts[1])["rows"]
    assert plain[2]["cause"].startswith("=1+1")
    assert verify_plain(plain).problem is None


def test_a_row_changed_by_hand_is_found_out(own_world, visits, tmp_path: Path) -> None:
    file = tmp_path / "audit.sqlite"
    world, _ = own_world("--audit", str(file))
    page = visits().open(world.drive, "events")
    decided(page)
    page.get_by_role("link", name="Audit").click()
    expect(page.get_by_role("status", name="Verification")).to_contain_text("The chain holds")

    with closing(sqlite3.connect(file, isolation_level=None)) as by_hand:
        by_hand.execute("DROP TRIGGER audit_is_not_changed")
        by_hand.execute("UPDATE audit SET subject = 'robot-2' WHERE action = 'assign'")
    page.get_by_role("button", name="Verify").click()
    expect(page.get_by_role("status", name="Verification")).to_contain_text(
        "Broken: row 3 was changed"
    )


def test_who_may_look_reads_the_log(fake, visit) -> None:
    page = visit.open(fake().look, "audit")

    expect(page.get_by_role("table", name="Audit log")).to_contain_text("begin")
