"""A recording in a real browser: it plays, stands and jumps, and nobody can be told to act."""

import functools
import json
import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from helpers.console.accessibility import faults
from helpers.processes.patience import becomes
from helpers.processes.programs import Programs, all_gone_after
from playwright.sync_api import Page, TimeoutError, WebSocketRoute, expect
from recordings.runs import drill, drive

from dva_sim.recordings.audit_log import AuditEntry, AuditLog, plain_row
from dva_sim.recordings.writing import write_recording
from dva_sim.simulation.measures.episodes import tables_of


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


@pytest.fixture(scope="module")
def audited(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with an audit log, of which it holds the end alone."""
    place = tmp_path_factory.mktemp("audited")
    log = AuditLog(place / "audit.sqlite")
    actions = ("begin", "take", "acknowledge", "end")
    entries = [
        AuditEntry(time_s=t, at_utc="", author="ana", action=a) for t, a in enumerate(actions)
    ]
    rows = [(row.time_s, plain_row(row)) for row in log.append(entries)[1:]]
    log.close()
    write_recording(drill(), place / "audited.mcap", audit=rows)
    return place / "audited.mcap"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., str]]:
    """Starts a command, once for all tests, and gives the address that it prints."""
    for programs in all_gone_after(tmp_path_factory.mktemp("consoles")):

        @functools.cache
        def start(*words: str | Path, programs: Programs = programs) -> str:
            console = programs.start(*words, "--no-open", "--port", "0")
            console.wait_to_say("Console:")
            return re.findall(r"^Console: +(\S+)", console.output, re.MULTILINE)[0]

        yield start


@pytest.fixture
def drilled(address, shared, folder: Path) -> Callable[..., Page]:
    """Opens a page of the drill, which stands at its beginning."""

    def opened(name: str = "map", **options: Any) -> Page:
        page = shared(address("replay", folder / "drill.mcap", "--console"), name, **options)
        expect(page.get_by_role("region", name="Replay")).to_be_visible()
        pause, play = (
            page.get_by_role("button", name=word, exact=True) for word in ("Pause", "Play")
        )

        def is_paused() -> bool:
            if pause.is_visible():
                with suppress(TimeoutError):  # at its end it stands by itself meanwhile
                    pause.click(timeout=5_000)
            return play.is_visible()

        assert becomes(is_paused)
        page.get_by_role("slider", name="Replay position").press("Home")
        assert becomes(lambda: shown(page) == 0)
        return page

    return opened


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

    assert becomes(chosen)


def test_a_recording_plays_stands_and_jumps(drilled):
    page = drilled()
    page.get_by_role("button", name="Play").click()
    assert becomes(lambda: shown(page) >= 1)

    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Play")).to_be_visible()

    def goes_on() -> bool:
        page.get_by_role("button", name="Next event").click()
        return shown(page) >= 70  # by then something has been reported

    assert becomes(goes_on)
    there = shown(page)
    expect(page.get_by_role("region", name="Events").locator("li")).not_to_have_count(0)

    page.get_by_role("slider", name="Replay position").focus()
    page.keyboard.press("Home")
    assert becomes(lambda: shown(page) == 0)
    expect(page.get_by_text("Nothing has been reported.")).to_be_visible()
    page.get_by_role("slider", name="Replay speed").focus()
    page.keyboard.press("End")
    page.get_by_role("button", name="Play").click()
    assert becomes(lambda: shown(page) > there)


def test_nothing_in_it_can_be_told_to_act(drilled):
    page = drilled()

    expect(page.get_by_role("button", name="Emergency stop")).to_have_count(0)
    for name in ("Drive", "Audit"):  # it has no audit log
        expect(page.get_by_role("link", name=name)).to_have_count(0)
    page.goto(page.url.partition("#")[0] + "#/drive")
    expect(page.get_by_role("button", name="Take control")).to_have_count(0)
    expect(page.get_by_role("region", name="Map")).to_be_visible()


def test_two_people_see_the_same_moment(drilled):
    one, two = drilled(person=1), drilled(person=2)
    one.get_by_role("button", name="Next event").click()

    assert becomes(lambda: shown(one) == shown(two) > 0)
    two.get_by_role("button", name="Play").click()
    one.get_by_role("button", name="Pause").click()
    expect(two.get_by_role("button", name="Play")).to_be_visible()


def test_a_line_of_the_story_leads_to_its_moment(drilled):
    page = drilled("story")
    reported = page.get_by_role("list", name="Story so far")
    expect(reported).to_have_count(0)  # the time in the bar may be ahead of the lists
    later = page.get_by_role("list", name="Still to come").get_by_role("button")
    text = later.nth(2).inner_text()
    later.nth(2).click()

    expect(reported.get_by_role("button").last).to_have_text("".join(text.split("\n")))
    minutes, seconds = map(int, re.search(r"0:(\d\d):(\d\d)", text).groups())
    assert becomes(lambda: shown(page) == 60 * minutes + seconds)


def test_the_log_holds_what_was_asked_up_to_the_moment(drilled):
    page = drilled("main")
    rows = page.get_by_role("table", name="Requests").locator("tbody tr")
    position = page.get_by_role("slider", name="Replay position")
    position.focus()
    page.keyboard.press("End")
    expect(rows.filter(has_text="EventReport")).not_to_have_count(0)
    position.focus()
    page.keyboard.press("Home")
    expect(rows.filter(has_text="EventReport")).to_have_count(0)


def test_the_camera_shows_a_picture_with_its_age(address, visit, folder):
    page = visit.open(address("replay", folder / "drive.mcap", "--console"), "robots/robot-1")
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("slider", name="Replay position").focus()
    page.keyboard.press("End")

    expect(page.locator(".camera canvas[data-frame]")).to_be_visible(timeout=60_000)
    expect(page.get_by_text(re.compile(r"\d s old"))).not_to_have_count(0)


def test_recordings_of_a_folder_are_a_click_away_and_its_report_runs_no_script(
    address, visit, folder
):
    page = visit.tab()
    page.goto(address("console", "--results", folder))
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
    opened.value.close()

    for scheme, width in (("light", 360), ("dark", 1280)):
        page.set_viewport_size({"width": width, "height": 800})
        page.emulate_media(color_scheme=scheme)
        for name in ("Map", "Main", "Devices", "Robots", "Events", "Story", "Recordings"):
            link = page.get_by_role("link", name=name, exact=True)
            link.click()
            expect(link).to_have_attribute("aria-current", "page")
            assert faults(page) == [], (name, width)
            assert page.evaluate("document.documentElement.scrollWidth") <= width, name


def test_a_late_reply_leads_nobody_away_from_the_page_they_went_to(address, visit, folder):
    page = visit.context.new_page()
    held: list[Callable[[], None]] = []

    def hold_replies(socket: WebSocketRoute) -> None:
        server = socket.connect_to_server()

        def to_page(line: str | bytes) -> None:
            is_reply = json.loads(line)["k"] == "done"
            held.append(lambda: socket.send(line)) if is_reply else socket.send(line)

        server.on_message(to_page)

    page.route_web_socket("**/ws/drive*", hold_replies)
    page.goto(f"{address('console', '--results', folder)}#/recordings")
    choose(page, "drill.mcap")
    page.get_by_role("link", name="Events").click()
    assert becomes(lambda: page.evaluate("location.hash") == "#/events" and bool(held))

    held[0]()
    assert page.evaluate("location.hash") == "#/events"


def test_the_audit_log_of_a_recording_is_shown_with_its_chain(address, audited, folder, visit):
    page = visit.open(address("replay", audited, "--console"), "audit")

    table = page.get_by_role("table", name="Audit log")
    expect(table.locator("tbody tr")).to_have_count(3)
    expect(table).to_contain_text("acknowledge")
    state = page.get_by_role("status", name="Verification")
    expect(state).to_contain_text("Verified")
    expect(page.get_by_text("Saved in audited.mcap.")).to_be_visible()
    assert faults(page) == []
