"""A recording in a real browser: it plays, stands and jumps, and nobody can be told to act."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from helpers.console.accessibility import faults
from helpers.processes.patience import becomes
from helpers.processes.programs import Programs, all_gone_after
from playwright.sync_api import Page, expect
from recordings.runs import drill, drive

from dva_sim.recordings.audit_log import AuditEntry, AuditLog, plain_row
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.full.measures import tables_of


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings, and a report beside them."""
    folder = tmp_path_factory.mktemp("kept")
    for run in (drive, drill):
        write_recording(run(), folder / f"{run.__name__}.mcap", tables=tables_of(run()))
    text = "<!doctype html><html lang=en><title>R</title><h1>The report</h1>"
    text += "<script>document.title = 'a script ran'</script>"
    (folder / "report.html").write_text(text)
    return folder


@pytest.fixture
def audited(folder: Path, tmp_path: Path) -> Path:
    """A recording with an audit log, of which it holds the end alone."""
    log = AuditLog(tmp_path / "audit.sqlite")
    actions = ("begin", "take", "acknowledge", "end")
    entries = [
        AuditEntry(time_s=t, at_utc="", author="ana", action=a) for t, a in enumerate(actions)
    ]
    rows = [(row.time_s, plain_row(row)) for row in log.append(entries)[1:]]
    log.close()
    write_recording(drill(), tmp_path / "audited.mcap", audit=rows)
    return tmp_path / "audited.mcap"


@pytest.fixture
def address(tmp_path: Path) -> Iterator[Callable[..., str]]:
    """Starts a command and gives the address that it prints."""
    for programs in all_gone_after(tmp_path):

        def start(programs: Programs, *words: str | Path) -> str:
            console = programs.start(*words, "--no-open", "--port", "0")
            console.wait_to_say("Console:")
            return re.findall(r"^Console: +(\S+)", console.said, re.MULTILINE)[0]

        yield lambda *words, programs=programs: start(programs, *words)


def shown(page: Page) -> float:
    """The moment that is shown [s]."""
    hours, minutes, seconds = (page.locator(".bar .time .figure").inner_text()).split(":")
    return 3600 * int(hours) + 60 * int(minutes) + int(seconds)


def choose(page: Page, name: str) -> None:
    """Play one of the list, once the page may say so."""

    def chosen() -> bool:
        page.get_by_role("button", name=name).click()
        with suppress(AssertionError):
            expect(page.get_by_role("region", name="Replay")).to_be_visible(timeout=10_000)
            return True
        return False

    becomes(chosen)


def test_a_recording_plays_stands_and_jumps(address, visit, folder: Path) -> None:
    page = visit.open(address("replay", folder / "drill.mcap", "--console"))
    expect(page.get_by_role("region", name="Replay")).to_be_visible()
    becomes(lambda: shown(page) >= 1)

    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Play")).to_be_visible()

    def goes_on() -> bool:
        page.get_by_role("button", name="Next event").click()
        return shown(page) >= 70  # by then something has been reported

    becomes(goes_on)
    there = shown(page)
    expect(page.get_by_role("region", name="Events").locator("li")).not_to_have_count(0)

    page.get_by_role("slider", name="Replay position").focus()
    page.keyboard.press("Home")
    becomes(lambda: shown(page) == 0)
    expect(page.get_by_text("Nothing has been reported.")).to_be_visible()
    page.get_by_role("slider", name="Replay speed").focus()
    page.keyboard.press("End")
    page.get_by_role("button", name="Play").click()
    becomes(lambda: shown(page) > there)


def test_nothing_in_it_can_be_told_to_act(address, visit, folder: Path) -> None:
    page = visit.open(address("replay", folder / "drill.mcap", "--console"))
    expect(page.get_by_role("region", name="Replay")).to_be_visible()

    expect(page.get_by_role("button", name="Emergency stop")).to_have_count(0)
    expect(page.get_by_role("link", name="Drive")).to_have_count(0)
    page.goto(page.url.partition("#")[0] + "#/drive")
    expect(page.get_by_role("button", name="Take control")).to_have_count(0)
    expect(page.get_by_role("region", name="Map")).to_be_visible()


def test_two_people_see_the_same_moment(address, visits, folder: Path) -> None:
    where = address("replay", folder / "drill.mcap", "--console")
    one, two = visits().open(where), visits().open(where)
    one.get_by_role("button", name="Pause").click()
    one.get_by_role("button", name="Next event").click()

    becomes(lambda: shown(one) == shown(two) > 0)
    expect(two.get_by_role("button", name="Play")).to_be_visible()


def test_a_line_of_the_story_leads_to_its_moment(address, visit, folder: Path) -> None:
    page = visit.open(address("replay", folder / "drill.mcap", "--console"))
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("link", name="Story").click()
    later = page.get_by_role("list", name="Still to come").get_by_role("button")
    text = later.nth(2).inner_text()
    later.nth(2).click()

    told = page.get_by_role("list", name="Told so far")
    expect(told.get_by_role("button").last).to_have_text("".join(text.split("\n")))
    minutes, seconds = map(int, re.search(r"0:(\d\d):(\d\d)", text).groups())
    becomes(lambda: shown(page) == 60 * minutes + seconds)


def test_the_log_holds_what_was_asked_up_to_the_moment(address, visit, folder: Path) -> None:
    page = visit.open(address("replay", folder / "drill.mcap", "--console"))
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("link", name="Main").click()
    rows = page.get_by_role("table", name="Requests").locator("tbody tr")
    position = page.get_by_role("slider", name="Replay position")
    position.focus()
    page.keyboard.press("End")
    expect(rows.filter(has_text="EventReport")).not_to_have_count(0)
    position.focus()
    page.keyboard.press("Home")
    expect(rows.filter(has_text="EventReport")).to_have_count(0)


def test_the_camera_shows_a_picture_with_its_age(address, visit, folder: Path) -> None:
    page = visit.open(address("replay", folder / "drive.mcap", "--console"))
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("link", name="Robots").click()
    page.get_by_role("link", name="robot-1").click()
    page.get_by_role("slider", name="Replay position").focus()
    page.keyboard.press("End")

    expect(page.locator(".camera canvas[data-frame]")).to_be_visible(timeout=60_000)
    expect(page.get_by_text(re.compile(r"\d s old"))).not_to_have_count(0)


def test_recordings_of_a_folder_are_a_click_away_and_its_report_runs_no_script(
    address, visit, folder: Path
) -> None:
    where = address("console", "--results", folder)
    page = visit.tab()
    page.goto(where)
    rows = page.get_by_role("table", name="Recordings").locator("tbody tr")
    expect(rows).to_have_count(2)
    choose(page, "drill.mcap")
    expect(page.get_by_role("region", name="Map")).to_be_visible()
    expect(page.get_by_role("status", name="Link")).to_have_text("recording drill.mcap")

    page.get_by_role("link", name="Recordings").click()
    with visit.context.expect_page() as opened:
        page.get_by_role("link", name="Report of the study").click()
    expect(opened.value.get_by_role("heading", name="The report")).to_be_visible()
    assert opened.value.title() == "R"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_axe_finds_nothing_serious_and_all_fits(
    address, visits, folder: Path, scheme: str, width: int
) -> None:
    page = visits(width, 800, color_scheme=scheme).tab()
    page.goto(address("console", "--results", folder))
    choose(page, "drill.mcap")
    for name in ("Map", "Main", "Devices", "Robots", "Events", "Story", "Recordings"):
        link = page.get_by_role("link", name=name, exact=True)
        link.click()
        expect(link).to_have_attribute("aria-current", "page")
        assert faults(page) == []
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_the_audit_log_of_a_recording_is_shown_with_its_chain(
    address, audited: Path, folder: Path, visit
) -> None:
    page = visit.open(address("replay", audited, "--console"), "audit")

    table = page.get_by_role("table", name="Audit log")
    expect(table.locator("tbody tr")).to_have_count(3)
    expect(table).to_contain_text("acknowledge")
    state = page.get_by_role("status", name="Verification")
    expect(state).to_contain_text("The chain holds")
    expect(page.get_by_text("It is kept in audited.mcap.")).to_be_visible()
    assert faults(page) == []


def test_a_recording_without_an_audit_log_has_no_page_of_it(address, folder: Path, visit) -> None:
    page = visit.open(address("replay", folder / "drill.mcap", "--console"), "events")

    expect(page.get_by_role("link", name="Story")).to_be_visible()
    expect(page.get_by_role("link", name="Audit")).to_have_count(0)
