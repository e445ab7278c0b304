"""The program itself: a drive over 500 ms to a fire, a real link, the camera of a live run."""

import re
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from helpers.console import driving_page
from helpers.console.console_program import started
from helpers.console.keyboard_driver import NEAR_FIRE, Driver
from helpers.network.emulated_link import need_link
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.wording import unnamed
from playwright.sync_api import TimeoutError, expect

DELAY_S = 0.5
NEAR_M = 2.5  # of the fire: there it can be seen


def test_of_a_real_link_nothing_can_be_chosen_but_the_robots_computers(visit, programs):
    _, address = started(programs, "--links", "real")
    page = visit.open(address, "network")

    expect(page.get_by_role("status", name="Link")).to_have_text("real")
    expect(page.get_by_role("slider")).to_have_count(1)
    expect(page.get_by_role("slider", name="Processing time")).to_be_enabled()
    expect(page.get_by_role("button", name="Pause")).to_be_disabled()
    expect(page.get_by_role("button", name="Take the tour")).to_have_count(0)
    page.get_by_role("link", name="Drive").click()
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("button", name="Release control")).to_be_enabled()
    expect(page.locator(".picture-age")).to_contain_text("old")


ROUND_TRIP = "import('/static/js/store.js').then(store => store.driveOf(0)?.round_trip_ms ?? 0)"


def test_who_drives_over_an_emulated_link_sees_what_it_takes(visit, programs):
    need_link()
    console, address = started(programs, "--links", "real", "--link", "delay_s=0.3")
    page = visit.open(address, "network")

    expect(page.get_by_role("status", name="Link")).to_have_text("emulated 300 ms")
    page.get_by_label("Pattern of robot-1").select_option("req-rep")
    page.get_by_role("link", name="Drive").click()
    start = page.get_by_role("button", name="Start", exact=True)
    take = page.get_by_role("button", name="Take control")

    def holds() -> bool:
        """Over that link it takes some seconds until the DVA knows the robot."""
        if take.is_enabled() and not start.is_enabled():
            with suppress(TimeoutError):  # an earlier click may be answered meanwhile
                take.click(timeout=1000)
        return start.is_enabled()

    assert becomes(holds)
    driving_page.start(page)
    page.keyboard.down("ArrowUp")
    # The first command opens a connection, which takes three round trips more.
    assert becomes(lambda: 600 <= page.evaluate(ROUND_TRIP) < 1200)
    page.keyboard.up("ArrowUp")
    page.close()
    console.send(signal.SIGINT)
    assert console.ends() == 0
    assert unnamed(console.output, "S1 held", "to the robots: ") == []
    assert programs.processes() == {}


def test_a_fire_is_reached_by_keys_over_500_ms_and_confirmed(tmp_path, visit, programs):
    record = tmp_path / "drive.mcap"
    # No guards: the fire waits for whoever takes control, however late the page opens.
    words = ["--record", record, "--set", "guard.count=0", *NEAR_FIRE]
    console, address = started(programs, *words)
    page = visit.open(address, "drive")
    base = address.partition("?")[0]
    page.get_by_role("slider", name="Delay").fill(str(1000 * DELAY_S))
    expect(page.get_by_role("status", name="Link")).to_contain_text("modelled 500 ms")

    order = page.get_by_role("region", name="Order in hand")
    expect(order).to_contain_text("fire", timeout=1000 * PATIENCE_S)
    robot = re.findall(r"Drive (\S+) there", order.inner_text())[0]
    if page.get_by_role("button", name=f"Choose {robot}").count():
        page.get_by_role("button", name=f"Choose {robot}").click()
    driver = Driver(page, base, robot, DELAY_S)
    fire = next(event for event in driver.state()["events"] if event["kind"] == "fire")
    page.get_by_role("button", name="Take control").click()
    driver.drive_to(fire["x_m"], fire["y_m"], NEAR_M)
    page.get_by_role("button", name="Confirm").click()

    assert becomes(lambda: "confirmed" in str(driver.state()["events"]))
    page.close()  # it would complain that nobody is there any more
    console.send(signal.SIGINT)
    assert console.ends() == 0
    checked = programs.start("check", record)
    assert checked.ends() == 0, checked.complained


@contextmanager
def page_of_this_machine(folder: Path, text: str) -> Iterator[str]:
    """Address of a page that another port of this machine serves."""
    (folder / "page.html").write_text(text, encoding="utf-8")
    handler = partial(SimpleHTTPRequestHandler, directory=folder)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/page.html"
        server.shutdown()


def test_an_image_element_shows_what_a_robot_of_a_live_run_sees(programs, browser, tmp_path):
    run = programs.start("live", "drive-to-event", "--camera-port", "0")
    run.wait_to_say("shows pictures of the robots at http://")
    url = re.search(r"at (http://127\.0\.0\.1:\d+/camera/)LABEL", run.output)
    assert url is not None
    page = browser.new_page()
    with page_of_this_machine(tmp_path, f'<img src="{url[1]}robot-1.mjpg">') as address:
        page.goto(address, wait_until="commit")
        page.wait_for_function("document.images[0]?.naturalWidth === 320")
        page.close()
