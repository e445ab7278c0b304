"""Several DVAs on the pages: the map with its regions, the column, and the alarm on each page."""

from helpers.network.free_ports import free_port
from helpers.processes.patience import becomes
from playwright.sync_api import expect

WEST = "west: {polygon: [[0, 0], [20, 0], [20, 24], [0, 24]]}"
REGIONS = "--set", f"dva.regions={{{WEST}, east: {{rest: true}}}}"
WRITTEN = """window.words = new Set(); const write = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...at) {
    window.words.add(text); return write.call(this, text, ...at); };"""


def test_regions_are_on_the_map_in_the_table_and_an_alarm_if_their_dva_dies(console, visit):
    at = console(*REGIONS)
    visit.context.add_init_script(WRITTEN)
    page = visit.open(at.drive)
    states = page.get_by_role("region", name="Regions").locator(".state")
    expect(states).to_have_text(["served by dva-west", "served by dva-east"])
    named = {"west: served by dva-west", "east: served by dva-east"}
    assert becomes(lambda: named <= set(page.evaluate("[...window.words]")))

    page.goto(f"{at.base}#/devices")
    table = page.get_by_role("table", name="Devices")
    expect(table.get_by_role("columnheader", name="DVA")).to_be_visible()
    robot = table.get_by_role("row").filter(has_text="robot-1").first
    expect(robot.get_by_role("cell").nth(1)).to_have_text("dva-west")

    stop = {"id": "stop", "action": "server_stop", "arguments": {}}
    assert visit.context.request.post(f"{at.base}api/actions", data=stop).ok
    strip = page.get_by_role("region", name="Worst alarm")
    expect(strip).to_contain_text("Region west: dva-west is silent: nobody serves it")
    deputy = "served by dva-east, its deputy, as dva-west is silent"
    expect(strip).to_contain_text(f"Region west: {deputy}")
    page.goto(f"{at.base}#/map")
    expect(states).to_have_text([deputy, "served by dva-east"])
    assert becomes(lambda: f"west: {deputy}" in page.evaluate("[...window.words]"))

    port = {"port": free_port()}
    start = {"id": "start", "action": "server_start", "arguments": port}
    assert visit.context.request.post(f"{at.base}api/actions", data=start).ok
    button = page.get_by_role("button", name="Give west back")
    expect(button).to_be_enabled()
    button.click()
    expect(states).to_have_text(["served by dva-west", "served by dva-east"])


def test_of_one_dva_no_page_speaks_of_regions(console, shared):
    page = shared(console().drive, "devices")
    table = page.get_by_role("table", name="Devices")
    expect(table.get_by_role("columnheader", name="Label")).to_be_visible()
    expect(table.get_by_role("columnheader", name="DVA")).to_have_count(0)
    page.evaluate("location.hash = '#/map'")
    expect(page.get_by_role("region", name="Robots")).to_be_visible()
    expect(page.get_by_role("region", name="Regions")).to_have_count(0)
