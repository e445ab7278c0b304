"""The founding document's lines on the DVA and its simulator, each beside a foreign client.

The table of `docs/explanation/dissertation.md` names the lines; here is one check for each.
"""

import re
from collections.abc import Callable, Iterator
from typing import NamedTuple

import pytest
from helpers.network.free_ports import free_port
from helpers.network.printed_messages import (
    DVA,
    ROBOT,
    TABLET,
    PrintedClient,
    PrintedRobot,
    field,
    printed,
)
from helpers.paths import ROOT
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.processes.programs import all_gone_after
from playwright.sync_api import Locator, Page, expect

SLOW = 250 * PATIENCE_S
DOCUMENT = ROOT / "docs" / "explanation" / "dissertation.md"
LINES = re.findall(
    r"^\| (.+?) \| (.+?) \|$",
    DOCUMENT.read_text(encoding="utf-8").partition("## Line by line")[2].partition("\n## ")[0],
    re.MULTILINE,
)[1:]


class Foreign(NamedTuple):
    """A bare DVA, its page, and those of another make beside it."""

    dva: str
    address: str
    client: PrintedClient
    robot: PrintedRobot
    show: Callable[..., Page]

    def page(self, name: str) -> Page:
        """A page of the DVA, with the client and the robot registered."""
        assert field("Code", self.client.register()) == "0"
        assert field("Code", self.robot.register()) == "0"
        return self.show(self.address, name, 1440, 900)


@pytest.fixture(scope="module")
def started(
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[tuple[str, str, PrintedClient, PrintedRobot]]:
    """A DVA alone, to which client and robot have spoken before its page was there."""
    for programs in all_gone_after(tmp_path_factory.mktemp("alone")):
        dva = f"127.0.0.1:{free_port()}"
        words = ("--dva", dva, "--for", "1000", "--page", "0", "--set", "dva.sensors=[smoke]")
        program = programs.start("live", "hands-on", "--only", "dva", *words)
        program.wait_to_say("DVA: ")
        client = PrintedClient(dva)
        robot = PrintedRobot(client)
        assert field("Code", client.register()) == "0"
        program.wait_to_say("Look only:")
        address = re.findall(r"^Console: +(\S+)$", program.output, re.MULTILINE)[0]
        yield dva, address, client, robot
        robot.close()
        client.close()


@pytest.fixture
def foreign(
    started: tuple[str, str, PrintedClient, PrintedRobot], shared: Callable[..., Page]
) -> Foreign:
    return Foreign(*started, show=shared)


def lines_of(page: Page, text: str) -> Locator:
    """Lines of the log that have a text."""
    return page.get_by_role("table", name="Requests").get_by_role("row").filter(has_text=text)


def chosen(page: Page, text: str) -> Locator:
    """The details of the newest line that has a text."""
    lines_of(page, text).last.get_by_role("button").click(timeout=SLOW)
    return page.get_by_role("region", name="Message")


def device(page: Page, label: str) -> Locator:
    """The line of a device."""
    table = page.get_by_role("table", name="Devices")
    return table.get_by_role("row", name=re.compile(f"^{label}"))


def listens_on_a_port(foreign: Foreign) -> None:
    page = foreign.page("main")
    state = page.get_by_role("status", name="Server state")
    expect(state).to_have_text(f"Listening on {foreign.dva}", timeout=SLOW)
    page.get_by_role("button", name="Stop server").click()
    expect(state).to_contain_text("Stopped", timeout=SLOW)
    assert foreign.client.say(printed("registration").encode(), within_s=0.5) == ""
    page.get_by_role("button", name="Start server").click()
    expect(state).to_have_text(f"Listening on {foreign.dva}", timeout=SLOW)
    assert field("Code", foreign.client.register()) == "0"


def logs_all_requests(foreign: Foreign) -> None:
    page = foreign.page("main")
    page.get_by_role("checkbox", name="Renewals").check()
    first = page.get_by_role("button", name="Request 1", exact=True)
    expect(first).to_be_attached(timeout=SLOW)  # it came before the page was there
    names = ("get-device-list", "get-event-list", "set-teleop")
    for name in names:
        foreign.client.ask(name)
    foreign.client.say(b"hello")
    expect(lines_of(page, "not XML")).not_to_have_count(0, timeout=SLOW)
    kinds = page.locator(".log tbody td:nth-child(3)").all_inner_texts()
    assert kinds[-4:] == ["GetDeviceList", "GetEventList", "SetTeleOp", "?"]


def shows_the_header(foreign: Foreign) -> None:
    page = foreign.page("main")
    foreign.client.ask("permission-request", MessageID=777, DeviceID="0A:0B:0C:0D:0E:0F")
    message = chosen(page, "no robot 0A:0B:0C:0D:0E:0F")
    for name, value in (
        ("Kind", "PermissionRequest"),
        ("DestinationID", DVA),
        ("MessageID", "777"),
        ("SourceID", TABLET),
        ("Timestamp", "12:30:56"),
        ("SessionID", "0"),
    ):
        element = message.locator(".header > div").filter(has_text=re.compile(f"^{name}"))
        expect(element.locator("dd")).to_contain_text(value)
    expect(message.get_by_role("group", name="XML of the request")).to_contain_text("<Level>")
    expect(message.get_by_role("group", name="XML of the reply")).to_contain_text("<Code>9</Code>")
    foreign.client.say(printed("registration").replace('standalone="yes"?>', "?").encode())
    expect(chosen(page, "the XML declaration is broken")).to_contain_text("Line 1, column")


def answers_requests(foreign: Foreign) -> None:
    page = foreign.page("main")
    listed = foreign.client.ask("get-device-list")
    assert {TABLET, ROBOT} <= set(re.findall("<IdTag>(.*?)</IdTag>", listed))
    permission = foreign.client.ask("permission-request", Level="both")
    assert (field("Code", permission), field("DeviceID", permission)) == ("0", ROBOT)
    reply = chosen(page, "level both").get_by_role("group", name="XML of the reply")
    expect(reply).to_contain_text("<Permission>")
    session = field("Session", permission)
    expect(reply).not_to_contain_text(session)  # with it, a reader could drive
    foreign.client.give_back(session)


def lists_devices(foreign: Foreign) -> None:
    page = foreign.page("devices")
    row = device(page, "Tablet BQ Curie 2")
    for text in (TABLET, "TeleOp", "192.168.1.48"):
        expect(row).to_contain_text(text, timeout=SLOW)
    expect(device(page, "theirs")).to_contain_text("good", timeout=SLOW)


def takes_fake_devices(foreign: Foreign) -> None:
    page = foreign.page("devices")
    page.get_by_role("button", name="Add fake device").click()
    page.get_by_label("Label", exact=True).fill("ghost")
    page.get_by_label("Id", exact=True).fill("AA:00:00:00:00:01")
    page.get_by_label("Address", exact=True).fill("127.0.0.1:9")
    page.get_by_role("button", name="Add", exact=True).click()
    ghost = device(page, "ghost")
    expect(ghost).to_be_visible(timeout=SLOW)
    listed = foreign.client.ask("get-device-list")
    assert "<DeviceLabel>ghost</DeviceLabel>" in listed
    assert "fake" not in listed
    address = field("IpAddr", foreign.client.permission("AA:00:00:00:00:01"))
    assert foreign.client.say(printed("start-teleop").encode(), address, 0.5) == ""
    ghost.get_by_role("button", name="Remove").click()
    expect(ghost).to_have_count(0, timeout=2 * SLOW)


def shows_positions(foreign: Foreign) -> None:
    page = foreign.page("map")
    assert field("Code", foreign.client.ask("event-report-detected")) == "0"
    events = page.get_by_role("region", name="Events")
    expect(events).to_contain_text("Gas leak", timeout=SLOW)
    robots = page.get_by_role("region", name="Robots")
    expect(robots.get_by_role("button", name="theirs")).to_be_visible(timeout=SLOW)
    expect(robots).to_contain_text("Teleoperation", timeout=SLOW)


def assigns_and_keeps_who_did(foreign: Foreign) -> None:
    page = foreign.page("events")
    foreign.client.ask("event-report-detected", Kind="fire")
    page.get_by_role("button", name=re.compile("Fire")).first.click(timeout=SLOW)
    page.get_by_role("button", name="Acknowledge", exact=True).click(timeout=SLOW)
    page.get_by_role("link", name="Audit").click()
    audit = page.get_by_role("table", name="Audit log").get_by_role("row")
    expect(audit.filter(has_text="acknowledge")).not_to_have_count(0, timeout=SLOW)


def orders_missions(foreign: Foreign) -> None:
    page = foreign.page("drive")
    page.get_by_label("Permission level").select_option("both")
    page.get_by_role("button", name="Take control").click(timeout=SLOW)
    page.get_by_label("Mission", exact=True).select_option("return_to_base", timeout=SLOW)
    page.get_by_role("button", name="Send theirs").click()
    assert becomes(lambda: foreign.robot.has_heard("ReturnToBase"))
    page.get_by_role("button", name="Release control").click()


def reads_sensors(foreign: Foreign) -> None:
    page = foreign.page("events")
    robot = PrintedRobot(foreign.client, "70:1A:04:F9:81:E8", "sensing", senses=True)
    assert field("Code", robot.register()) == "0"
    assert becomes(lambda: robot.has_heard("DevSub"))
    assert becomes(lambda: "smoke" in foreign.client.ask("get-sensor-info", DestinationID=DVA))
    events = page.get_by_role("region", name="Events")
    expect(events).to_contain_text("Fire", timeout=SLOW)  # three values above the threshold
    robot.close()


def limits_access(foreign: Foreign) -> None:
    page = foreign.page("main")
    unknown = foreign.client.ask("permission-request", SourceID="56:2B:04:E4:56:99")
    assert field("Code", unknown) == "2"
    guard = {"DeviceLabel": "guard", "DeviceType": "Guard", "SourceID": "56:2B:04:E4:56:98"}
    foreign.client.ask("registration", **guard)
    refused = foreign.client.ask("permission-request", SourceID="56:2B:04:E4:56:98")
    assert field("Code", refused) == "3"
    expect(lines_of(page, "3 not permitted")).not_to_have_count(0, timeout=SLOW)


def notices_silence(foreign: Foreign) -> None:
    page = foreign.page("devices")
    robot = PrintedRobot(foreign.client, "70:1A:04:F9:81:E7", "brief")
    assert field("Code", robot.register()) == "0"
    row = device(page, "brief")
    expect(row).to_contain_text("good", timeout=SLOW)
    robot.close()
    expect(row).to_contain_text("lost", timeout=2 * SLOW)


CHECKS: dict[str, Callable[[Foreign], None]] = {
    "Start and stop listening on a port (5.2.1)": listens_on_a_port,
    "Log of all incoming requests (5.2.1)": logs_all_requests,
    "Elements of the header beside it (5.2.1)": shows_the_header,
    "Registration, device list and permission are answered (5.2.1)": answers_requests,
    "Table of connected devices (5.2.1)": lists_devices,
    "Fake devices, which never answer (5.2.1)": takes_fake_devices,
    "Positions of events and robots (1.3, 3.1, 6.3)": shows_positions,
    "Following events (3.1)": assigns_and_keeps_who_did,
    "Missions and remote control of robots (4.1)": orders_missions,
    "Subscribing to sensors and answering for them (4.1)": reads_sensors,
    "Permission levels (4.1)": limits_access,
    "Missing heartbeats (4.2)": notices_silence,
}


def test_every_line_of_the_table_has_its_check():
    assert [statement for statement, _ in LINES] == list(CHECKS)


@pytest.mark.parametrize("statement", CHECKS)
def test_a_line_holds_beside_a_foreign_client(foreign, statement):
    CHECKS[statement](foreign)
