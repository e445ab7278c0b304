"""The page for driving has what the tutorial tells one to press and to look at."""

import re

from helpers.console.driving_page import release, start, take
from helpers.paths import ROOT
from playwright.sync_api import expect

TUTORIAL = (ROOT / "docs/tutorials/drive.md").read_text(encoding="utf-8")
LESSON = TUTORIAL.partition("## Drive\n")[2].partition("## Tilt your phone")[0]


def test_everything_that_the_tutorial_names_in_bold_is_on_the_page(console, shared):
    page = shared(console().drive, "drive")
    named = set(re.findall(r"\*\*([^*]+)\*\*", LESSON)) - {"REQ/REP"}
    assert len(named) > 10
    page.get_by_role("button", name="Add robot-2").click()
    expect(page.get_by_text(re.compile("^Latency"))).to_be_visible()
    take(page)
    start(page)  # charts unfold with the first figures of a drive
    pressed = {"Add robot-2"}  # which is there no more
    for name in sorted(named - pressed):
        expect(page.locator("body")).to_contain_text(name, use_inner_text=True)
    release(page)
    patterns = page.get_by_label("Pattern of robot-1").locator("option").all_text_contents()
    assert {"REQ/REP", "latest-wins PUB/SUB"} <= set(patterns)
