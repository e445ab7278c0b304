"""A robot's windows in a browser: over modelled links, over real ones, with hostile names."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from helpers.console import driving_page
from helpers.console.accessibility import faults
from helpers.console.changed_lines import HOSTILE, renamed, sockets_of
from helpers.console.console_program import started
from helpers.processes.patience import becomes
from helpers.processes.programs import all_gone_after
from helpers.wording import unnamed
from playwright.sync_api import Page, expect

REGIONS = "Log", "Side view", "Top view", "Manual control", "Latency", "Camera"
QUIET = "--set", "guard.count=0", "--set", "bystander.count=0", "--set", "operator.count=1"


@pytest.fixture(scope="module")
def addresses(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[str]]:
    """Addresses of a console on modelled links, for driving and for looking."""
    for programs in all_gone_after(tmp_path_factory.mktemp("consoles")):
        console, drive = started(programs, *QUIET)
        console.wait_to_say("Look only:")
        yield [drive, *re.findall(r"^Look only: +(\S+)$", console.output, re.MULTILINE)]


@pytest.fixture(scope="module")
def console(addresses: list[str]) -> str:
    return addresses[0]


@pytest.fixture
def opened(shared, console: str) -> Callable[..., Page]:
    """Opens the windows of a robot to somebody."""
    return lambda **look: windows_of(shared(console, "robots/robot-1", **look))


def windows_of(page: Page) -> Page:
    """A robot's windows, once they are there."""
    expect(page.get_by_role("region", name="Manual control")).to_be_visible()
    expect(page.get_by_role("list", name="State")).to_be_visible()
    return page


def take(page: Page) -> None:
    """Take it in hand, again and again where this machine is late: robots are held then."""
    button = page.get_by_role("button", name="Take manual control")
    hint = page.get_by_role("status", name="Manual control")

    def is_taken() -> bool:
        if button.is_enabled():
            button.click()
        page.wait_for_timeout(200)
        return "You control it manually" in hint.inner_text()

    assert becomes(is_taken)


def release(page: Page) -> None:
    """Release all robots after an emergency."""
    page.get_by_role("button", name=re.compile("^Release robot")).first.click()
    expect(page.locator(".emergency-bar")).to_have_count(0)


@contextmanager
def in_hand(page: Page) -> Iterator[None]:
    """The robot is in the hand of this page."""
    take(page)
    yield
    page.get_by_role("button", name="Release manual control").click()
    expect(page.get_by_role("button", name="Take manual control")).to_be_enabled()


@contextmanager
def held(page: Page, *keys: str) -> Iterator[None]:
    for key in keys:
        page.keyboard.down(key)
    yield
    for key in keys:
        page.keyboard.up(key)


def side(page: Page) -> str:
    return str(
        page.get_by_role("region", name="Side view").get_by_role("img").get_attribute("aria-label")
    )


def spokes(page: Page) -> str:
    return str(page.locator(".spokes").first.get_attribute("transform"))


@contextmanager
def driving(page: Page) -> Iterator[None]:
    """Somebody drives the robot from the page for driving, in another tab."""
    page.get_by_role("link", name="Drive").click()
    driving_page.take(page)
    driving_page.start(page)
    yield
    driving_page.release(page)


def test_the_list_leads_to_the_windows_of_each_robot(shared, console):
    page = shared(console)
    page.get_by_role("link", name="Robots").click()
    cards = page.get_by_role("list", name="Robots")
    expect(cards.get_by_role("listitem")).to_have_count(2)
    card = cards.get_by_role("listitem").filter(has_text="robot-2")
    expect(card.get_by_role("img", name="What robot-2 sees")).to_be_visible()
    expect(card).to_contain_text("South corridor")
    card.get_by_role("link", name="robot-2").click()

    expect(page.get_by_role("heading", name="robot-2", level=1)).to_be_visible()
    for region in REGIONS:
        expect(page.get_by_role("region", name=region, exact=True)).to_have_count(1)
    page.reload()
    expect(page.get_by_role("heading", name="robot-2", level=1)).to_be_visible()


def test_a_hand_turns_the_wheels_by_speed_and_turn_rate_and_letting_go_stops(opened):
    page = opened()
    with in_hand(page):
        before = spokes(page)
        with held(page, "ArrowUp", "ArrowRight"):
            expect(page.get_by_role("region", name="Side view")).to_contain_text("0.50 m/s")
            expect(page.get_by_role("region", name="Side view")).to_contain_text("5.00 rad/s")
            expect(page.get_by_role("region", name="Top view")).to_contain_text("-30°")
            assert unnamed(side(page), "0.50 m/s", "5.00 rad/s") == []
            assert becomes(lambda: spokes(page) != before)
            expect(page.get_by_role("status", name="Reason")).to_contain_text("moves")
        expect(page.get_by_role("region", name="Side view")).to_contain_text("0.00 m/s")
        expect(page.get_by_role("status", name="Reason")).to_contain_text("manual driver")
    expect(page.get_by_role("status", name="Mode")).to_contain_text("Idle")


def test_wheels_stand_still_for_who_wants_no_motion_and_the_number_is_there(opened):
    page = opened()
    page.emulate_media(reduced_motion="reduce")
    with in_hand(page):
        before = spokes(page)
        with held(page, "ArrowUp"):
            expect(page.get_by_role("region", name="Side view")).to_contain_text("5.00 rad/s")
            page.wait_for_timeout(300)
            assert spokes(page) == before
    page.emulate_media(reduced_motion="no-preference")


def test_the_slider_drives_by_keys_alone_and_springs_back(opened):
    page = opened()
    button = page.get_by_role("button", name="Take manual control")
    assert becomes(lambda: button.is_disabled() or button.press("Enter") or button.is_disabled())
    speed = page.get_by_role("slider", name="Speed")
    expect(speed).to_be_enabled()
    speed.focus()
    with held(page, "End"):
        expect(page.get_by_role("region", name="Side view")).to_contain_text("0.50 m/s")
    expect(speed).to_have_value("0")
    page.get_by_role("button", name="Release manual control").focus()
    page.keyboard.press("Space")
    expect(page.get_by_role("status", name="Mode")).to_contain_text("Idle")


def test_a_page_that_is_closed_lets_the_robot_stand_and_another_one_sees_why(
    visit, opened, console
):
    driver, other = windows_of(visit.open(console, "robots/robot-1")), opened()
    take(driver)
    driver.keyboard.down("ArrowUp")
    expect(other.get_by_role("region", name="Side view")).to_contain_text("0.50 m/s")
    expect(other.get_by_text("Another page controls it")).to_be_visible()
    driver.close()
    expect(other.get_by_role("region", name="Side view")).to_contain_text("0.00 m/s")
    other.get_by_role("button", name="Take manual control").click()
    expect(other.get_by_text("by hand").first).to_be_visible()
    other.get_by_role("button", name="Stop robot-1").click()
    expect(other.get_by_role("status", name="Mode")).to_contain_text("Emergency")
    expect(other.get_by_role("status", name="Reason")).to_contain_text("Emergency stop by")
    expect(other.get_by_role("button", name="Take manual control")).to_be_disabled()
    release(other)


def test_a_robot_in_a_hand_is_busy_for_a_driver_and_a_driven_one_goes_into_no_hand(
    opened, shared, console
):
    hand, driver = opened(), shared(console, "drive", person=2)
    with in_hand(hand):
        driver.get_by_role("button", name="Take control").click()
        driver.get_by_role("button", name="Start", exact=True).click()
        expect(driver.get_by_text("does not start yet: driven by hand")).to_be_visible()
    driving_page.start(driver)
    hand.get_by_role("button", name="Take manual control").click()
    expect(hand.get_by_text("busy: held by console-1")).to_be_visible()
    driver.get_by_role("button", name="Release control").click()
    expect(driver.get_by_role("button", name="Take control")).to_be_enabled()


def test_an_emergency_wins_over_the_hand_that_drives(opened, shared, console):
    hand, other = opened(), shared(console, "drive", person=2)
    take(hand)
    hand.keyboard.down("ArrowUp")
    expect(hand.get_by_role("region", name="Side view")).to_contain_text("0.50 m/s")
    other.get_by_role("button", name="Emergency stop").click()
    expect(hand.get_by_role("status", name="Mode")).to_contain_text("Emergency")
    expect(hand.get_by_role("region", name="Side view")).to_contain_text("0.00 m/s")
    expect(hand.get_by_role("status", name="Reason")).to_contain_text("manual control has ended")
    hand.keyboard.up("ArrowUp")
    release(hand)


def test_the_log_and_the_latency_show_a_drive_in_its_order(opened, shared, console):
    windows, driver = opened(), shared(console, "drive", person=2)
    log = windows.get_by_role("table", name="Messages")
    with driving(driver), held(driver, "ArrowUp"):
        expect(log).to_contain_text("StartTeleOp")
        expect(log).to_contain_text("SetTeleOp")
        latency = windows.get_by_role("table", name="Latency")
        expect(latency.get_by_role("row", name="Client to robot")).not_to_contain_text("–")
        expect(windows.get_by_role("region", name="Log")).to_contain_text("median")
    expect(log.locator("tbody tr").last).to_contain_text("StopTeleOp")
    kinds = [row.split()[0] for row in log.locator("td.payload").all_inner_texts()]
    newest = kinds[len(kinds) - 1 - kinds[::-1].index("StartTeleOp") :]  # others drove before
    assert newest[:2] == ["StartTeleOp", "SetTeleOp"]
    assert "0 ok" in log.inner_text()


def test_a_fault_is_switched_on_and_off_and_what_it_does_is_seen(opened):
    page = opened()
    knobs = page.get_by_role("region", name="Faults")
    expect(knobs).to_contain_text("none")
    knobs.get_by_label("Lose the camera").check()
    expect(page.locator(".picture-age")).to_have_class(re.compile("hatched"))
    knobs.get_by_label("Stuck: smoke").check()
    expect(page.get_by_role("region", name="Sensors")).to_contain_text("stuck")
    expect(knobs).to_contain_text("active")
    knobs.get_by_label("Lose the camera").uncheck()
    knobs.get_by_label("Stuck: smoke").uncheck()
    expect(knobs).to_contain_text("none")
    expect(page.locator(".picture-age")).to_have_class(re.compile("fresh"))


def test_who_may_look_only_sees_all_and_changes_nothing(visit, addresses):
    page = windows_of(visit.open(addresses[1], "robots/robot-1"))
    expect(page.get_by_role("button", name="Take manual control")).to_be_disabled()
    expect(page.get_by_label("Freeze")).to_be_disabled()
    expect(page.get_by_text("This address is view-only.")).to_be_visible()


def test_over_real_links_all_windows_are_the_same(programs, visit):
    _, address = started(programs, *QUIET, "--links", "real")
    page = windows_of(visit.open(address, "robots/robot-1"))
    for region in REGIONS:
        expect(page.get_by_role("region", name=region, exact=True)).to_have_count(1)
    with in_hand(page), held(page, "ArrowUp"):
        expect(page.get_by_role("region", name="Side view")).to_contain_text("0.50 m/s")
    expect(page.locator(".picture-age")).to_contain_text("old")
    with driving(page), held(page, "ArrowUp"):
        expect(page.locator(".stop-reason")).to_contain_text("Set point 0.50 m/s")
    page.goto(f"{address}#/robots/robot-1")
    expect(page.get_by_role("table", name="Messages")).to_contain_text("SetTeleOp")


def test_a_model_car_shows_its_motor_in_per_cent_and_three_ways_to_steer(programs, visit):
    _, address = started(programs, *QUIET, "--set", "robot.profile=pibot")
    page = windows_of(visit.open(address, "robots/robot-1"))
    with in_hand(page), held(page, "ArrowUp"):
        expect(page.get_by_role("region", name="Side view")).to_contain_text("motor 100 % PWM")
        expect(page.get_by_role("region", name="Top view")).to_contain_text("straight")
        with held(page, "ArrowLeft"):
            expect(page.get_by_role("region", name="Top view")).to_contain_text("left")


def test_a_name_that_is_hostile_is_shown_as_text(visit, console):
    sockets_of(visit.context, "state", renamed("robot-2"))
    page = visit.open(console, "robots")
    page.get_by_role("list", name="Robots").get_by_role("link", name=HOSTILE).click()
    expect(page.get_by_role("heading", level=1)).to_have_text(HOSTILE)
    page.evaluate(
        "address => { location.hash = address; }", "#/robots/%3Cimg%20src=x%20onerror=alert(2)%3E"
    )
    expect(page.get_by_text("There is no robot <img src=x onerror=alert(2)>")).to_be_visible()
    page.close()
    visit.errors.clear()  # the console has no pictures of a robot of that name


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [360, 1280])
def test_axe_finds_nothing_serious_and_nothing_is_too_wide(opened, shared, console, scheme, width):
    page = opened(width=width, scheme=scheme)
    assert faults(page) == []
    assert page.evaluate("document.querySelector('.body').scrollWidth") <= width
    page = shared(console, "robots", width=width, scheme=scheme)
    expect(page.get_by_role("list", name="Robots")).to_be_visible()
    assert faults(page) == []
