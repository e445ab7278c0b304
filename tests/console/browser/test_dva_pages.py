"""Main and Devices in a browser: the log, its filters, the server, fake devices, rude peers.

What runs is asked for before the browser, so that it is there until the last page is closed.
"""

import re
import signal
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq
from helpers.console.accessibility import faults
from helpers.console.console_program import started
from helpers.console.keyboard_driver import FIRE
from helpers.network.free_ports import free_port
from helpers.processes.patience import PATIENCE_S
from helpers.processes.programs import Program, Programs, all_gone_after
from playwright.sync_api import Page, expect

from dva_sim.network.keys import create_keys
from dva_sim.protocol import messages as m
from dva_sim.protocol.codec import decode, encode
from dva_sim.protocol.mistakes import check_message
from dva_sim.recordings.audit_log import verify
from dva_sim.simulation.full.stage import id_of, team_of
from dva_sim.simulation.scenario import build, load

DVA, STRANGER = "02:00:00:00:00:01", "02:00:00:0A:00:01"
HOSTILE = "<img src=x onerror=alert(1)>"
SLOW = 250 * PATIENCE_S


QUICK = "--set", "request.timeout_s=0.5"


class Peer:
    """A program of somebody else that talks to the DVA by a socket."""

    def __init__(self, console: Program) -> None:
        console.wait_to_say("DVA:")
        (address,) = re.findall(r"^DVA: +(\S+)", console.output, re.MULTILINE)
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        self._socket.linger = 0
        self._socket.connect(f"tcp://{address}")
        self._count = 0

    def ask(self, body: m.Body) -> m.Reply:
        self._count += 1
        data = encode(m.Message(DVA, self._count, STRANGER, "12:00:00", 0, body))
        reply = decode(self.ask_bytes(data)).body
        assert isinstance(reply, m.Reply)
        return reply

    def ask_bytes(self, data: bytes) -> bytes:
        self._socket.send_multipart([b"", data])
        assert self._socket.poll(1000 * int(PATIENCE_S))
        return self._socket.recv_multipart()[1]

    def flood(self, number: int) -> None:
        data = encode(m.Message(DVA, 1, STRANGER, "12:00:00", 0, m.GetDeviceList()))
        for _ in range(number):
            self._socket.send_multipart([b"", data])
        for _ in range(number):
            assert self._socket.poll(1000 * int(PATIENCE_S))
            self._socket.recv_multipart()

    def close(self) -> None:
        self._context.destroy(linger=0)


@pytest.fixture(scope="module")
def joined(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Peer, str]]:
    """Somebody's program beside a console on real links, and the address of that."""
    for programs in all_gone_after(tmp_path_factory.mktemp("joined")):
        console, address = started(programs, "--links", "real")
        peer = Peer(console)
        yield peer, address
        peer.close()


def row(page: Page, text: str) -> object:
    return page.get_by_role("table", name="Requests").get_by_role("row").filter(has_text=text)


def test_leaving_the_log_while_it_scrolls_is_no_fault(console, visits):
    visit = visits(360, 500)
    page = visit.open(console().drive, "main")
    expect(page.get_by_role("table", name="Requests").get_by_role("button")).not_to_have_count(0)

    page.evaluate(
        """async () => { for (let n = 0; n < 10; n += 1)
        for (const name of ['devices', 'main']) {
          location.hash = `#/${name}`;
          await new Promise((done) => requestAnimationFrame(() => setTimeout(done))); } }"""
    )
    assert visit.errors == []


def test_lines_are_chosen_by_keys_alone(console, shared):
    page = shared(console().drive, "main")
    numbers = page.get_by_role("table", name="Requests").get_by_role("button")
    expect(numbers.nth(2)).to_be_attached()
    page.get_by_role("button", name="Pause log").click()
    *_, wanted, _ = numbers.all_inner_texts()

    numbers.last.focus()
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    heading = page.get_by_role("heading", name=f"Request {wanted}", exact=True)
    expect(heading).to_be_visible()


def test_who_may_only_look_sees_lines_and_nothing_to_act_with(console, visit):
    page = visit.open(console().look, "main")

    expect(page.get_by_role("table", name="Requests").get_by_role("button")).not_to_have_count(0)
    expect(page.get_by_role("button", name="Stop server")).to_be_disabled()
    expect(page.get_by_role("link", name="Export")).to_have_count(0)
    page.get_by_role("table", name="Requests").get_by_role("button").first.click()
    expect(page.get_by_role("region", name="Message")).to_contain_text("Open the address")
    page.get_by_role("link", name="Devices").click()
    expect(page.get_by_role("button", name="Add fake device")).to_have_count(0)


def test_a_fake_device_is_added_by_keys_alone(console, shared):
    page = shared(console().drive, "devices")

    page.get_by_role("button", name="Add fake device").press("Enter")
    page.get_by_label("Label", exact=True).focus()
    page.keyboard.press("Enter")
    expect(page.get_by_text("A label is needed.")).to_be_visible()
    assert faults(page) == []
    page.keyboard.type("ghost")
    page.keyboard.press("Enter")
    expect(page.get_by_role("row", name="ghost fake")).to_be_visible()


def test_on_modelled_links_a_stopped_server_is_silent_starts_again_and_permits_are_revoked(
    programs, visit
):
    page = visit.open(started(programs, *QUICK)[1], "main")
    state = page.get_by_role("status", name="Server state")

    expect(state).to_contain_text("Listening on")
    expect(page.get_by_text("no port of this computer is open")).to_be_visible()
    page.get_by_role("button", name="Stop server").click()
    expect(state).to_contain_text("Stopped")
    page.get_by_role("link", name="Drive").click()
    page.get_by_role("button", name="Take control").click()
    expect(page.locator(".warnings")).to_contain_text("answer", timeout=SLOW)
    page.get_by_role("link", name="Main").click()
    page.get_by_label("Port").fill("5600")
    page.get_by_role("button", name="Start server").click()
    expect(state).to_contain_text(":5600")
    expect(row(page, "RegMsg").first).to_be_visible()

    page.get_by_role("link", name="Drive").click()
    page.get_by_role("button", name="Take control").click()
    expect(page.get_by_role("button", name="Release control")).to_be_enabled()

    page.get_by_role("link", name="Devices").click()
    held = page.get_by_role("row", name="robot-1")
    expect(held).to_contain_text("console-1")
    held.get_by_role("button", name="Revoke").click()
    expect(held).not_to_contain_text("console-1")


def test_a_peer_on_real_links_shows_up_and_its_faults_are_shown(joined, visit, tmp_path):
    peer, address = joined
    page = visit.open(address, "main")

    assert peer.ask(m.Registration(HOSTILE, "TeleOp", "127.0.0.1:9")).code == m.OK
    peer.ask_bytes(b"<!DOCTYPE m [<!ENTITY e SYSTEM 'file:///etc/passwd'>]><msg>&e;</msg>")
    peer.ask_bytes(b"<script>alert(1)</script>")
    spoilt = encode(m.Message(DVA, 10, STRANGER, "12:00:00", 0, m.GetDeviceList()))
    peer.ask_bytes(spoilt.replace(b"<MessageID>", b"<MessageID>x"))
    peer.ask(m.PermissionRequest("02:00:00:01:00:09", "teleoperation"))
    expect(row(page, HOSTILE)).not_to_have_count(0)
    expect(page.locator("tr.refused")).to_have_count(4)
    message = page.get_by_role("region", name="Message")
    page.locator("tr.refused button").first.click()
    expect(message).to_contain_text("a DOCTYPE is not allowed")
    page.locator("tr.refused button").nth(2).click()
    expect(message).to_contain_text(re.compile(r"Line \d+, column \d+: MessageID 'x10'"))
    expect(message.locator("mark")).to_have_text("<MessageID>x10</MessageID>")
    page.locator("tr.refused button").nth(3).click()
    for word in ("PermissionRequest", "DestinationID", "MessageID", "SourceID", "Timestamp"):
        expect(message).to_contain_text(word)
    expect(message.get_by_role("group", name="XML of the request")).to_contain_text("<Level>")
    assert page.locator("table img").count() == 0
    page.get_by_role("link", name="Devices").click()
    devices = page.get_by_role("table", name="Devices")
    expect(devices.get_by_role("row", name=HOSTILE)).to_contain_text(STRANGER)
    assert page.locator("table img").count() == 0
    page.get_by_role("link", name="Main").click()
    with page.expect_download() as download:
        page.get_by_role("link", name="Export").click()
    download.value.save_as(tmp_path / "log.zip")
    with zipfile.ZipFile(tmp_path / "log.zip") as files:
        kept = [name for name in files.namelist() if name.startswith("messages/")]
        assert len(kept) > 10
        assert [check_message(files.read(name)) for name in kept] == [[]] * len(kept)
        assert len([name for name in files.namelist() if name.startswith("refused/")]) == 3


def test_the_log_is_filtered_searched_paused_and_cleared(joined, visit):
    peer, address = joined
    page = visit.open(address, "main")
    table = page.get_by_role("table", name="Requests")
    assert peer.ask(m.Registration(HOSTILE, "TeleOp", "127.0.0.1:9")).code == m.OK
    peer.ask_bytes(b"<script>alert(1)</script>")
    expect(row(page, HOSTILE)).not_to_have_count(0)

    page.get_by_label("Kind").select_option("RegMsg")
    expect(table.get_by_text("GetDeviceList")).to_have_count(0)
    expect(table.get_by_text("RegMsg").first).to_be_visible()
    page.get_by_label("Kind").select_option("")
    page.get_by_label("Code").select_option("refused")
    expect(table.locator("tbody tr:not(.refused)")).to_have_count(0)
    expect(table.locator("tbody tr.refused")).not_to_have_count(0)
    page.get_by_label("Code").select_option("")
    page.get_by_label("Search").fill("nothing says this")
    expect(page.get_by_text("No request yet.")).to_be_visible()
    page.get_by_label("Search").fill("")
    page.get_by_label("Device").fill("onerror")
    expect(table.get_by_role("button")).not_to_have_count(0)
    page.get_by_role("button", name="Pause log").click()
    shown = table.get_by_role("button").count()
    peer.ask(m.GetDeviceList())
    expect(page.get_by_role("status", name="Shown")).to_contain_text(re.compile("[1-9] more have"))
    assert table.get_by_role("button").count() == shown
    page.get_by_role("button", name="Resume log").click()
    page.get_by_role("button", name="Clear log").click()
    expect(page.get_by_role("button", name="Request 1", exact=True)).to_have_count(0)


def test_a_flood_is_counted_and_not_shown_line_by_line(joined, visit):
    peer, address = joined
    page = visit.open(address, "main")
    expect(row(page, "RegMsg").first).to_be_visible()

    peer.ask(m.Registration("flood", "TeleOp", "127.0.0.1:9"))
    peer.flood(3000)
    gap = page.locator("tr.gap").last
    expect(gap).to_have_text(re.compile(r"[\d,]+ not shown"))
    assert page.locator(".log tbody tr").count() <= 401
    expect(page.locator(".age")).not_to_have_class(re.compile("old"))


def test_on_real_links_the_port_is_closed_and_opened(joined, visit):
    peer, address = joined
    page = visit.open(address, "main")

    page.get_by_role("button", name="Stop server").click()
    expect(page.get_by_role("status", name="Server state")).to_contain_text("Stopped")
    page.get_by_role("button", name="Start server").click()
    expect(page.get_by_role("status", name="Server state")).to_contain_text("Listening on")
    assert peer.ask(m.Registration("back", "TeleOp", "127.0.0.1:9")).code == m.OK


def test_a_phone_that_chooses_a_fake_robot_gets_a_time_out_and_no_hang(programs, visit):
    _, address = started(programs, *QUICK)
    page = visit.open(address, "devices")
    page.get_by_role("button", name="Add fake device").click()
    page.get_by_label("Label", exact=True).fill("ghost")
    page.get_by_role("button", name="Add", exact=True).click()
    expect(page.get_by_role("row", name="ghost fake")).to_be_visible()

    phone = visit.tab()
    phone.goto(f"{address.partition('?')[0]}phone#/authentication")
    phone.get_by_label("Device label").fill("phone")
    phone.get_by_role("button", name="Register").click()
    phone.get_by_role("button", name="Get device list").click()
    device = phone.get_by_label("Device", exact=True)
    ghost = device.locator("option", has_text="ghost")
    expect(ghost).to_have_count(1)
    device.select_option(ghost.inner_text())
    phone.get_by_role("button", name="Get Permission Level").click()
    expect(phone.get_by_text("You have permission")).to_be_visible()
    phone.evaluate("location.hash = '#/teleoperation'")
    phone.get_by_role("button", name="Start", exact=True).click()
    expect(phone.get_by_text("no answer at")).to_be_visible(timeout=SLOW)
    expect(phone.get_by_role("link", name="Authentication")).to_be_visible(timeout=SLOW)


@pytest.fixture
def elsewhere(programs: Programs) -> tuple[str, Program]:
    """The address of a DVA that runs elsewhere, and its program; robots and guards know it."""
    dva = f"127.0.0.1:{free_port()}"
    words = ("--dva", dva, "--for", "1000", "--set", FIRE)
    first = programs.start("live", "hands-on", "--only", "dva", "--no-page", *words)
    programs.start("live", "hands-on", "--only", "world", *words)
    return dva, first


def test_an_attached_console_shows_what_messages_tell_the_rest_as_unknown_and_offers_no_decision(
    programs, elsewhere, visit
):
    dva, first = elsewhere
    page = visit.open(started(programs, "--dva", dva)[1], "devices")

    def is_fit_for_everybody() -> bool:
        for scheme, width in (("light", 1280), ("dark", 360)):
            page.emulate_media(color_scheme=scheme)
            page.set_viewport_size({"width": width, "height": 800})
            assert faults(page) == []
        return True

    robot = page.get_by_role("row", name=re.compile("robot-1"))
    expect(robot).to_contain_text("Idle", timeout=SLOW)
    expect(robot).to_contain_text("unknown")
    assert is_fit_for_everybody()
    expect(page.get_by_role("status", name="Link")).to_contain_text(f"attached to {dva}")
    for name in ("Network", "Robots"):
        expect(page.get_by_role("link", name=name)).to_have_count(0)
    page.get_by_role("link", name="Main").click()
    expect(page.get_by_role("status", name="Server state")).to_contain_text("answers")
    expect(page.get_by_text("to control rooms with the role drive")).to_be_visible(timeout=SLOW)
    assert is_fit_for_everybody()

    page.get_by_role("link", name="Events").click()
    expect(page.get_by_text("The DVA lets this console look.")).to_be_visible(timeout=SLOW)
    expect(page.get_by_role("region", name="Events")).to_contain_text("Fire", timeout=SLOW)
    expect(page.get_by_role("button", name="Acknowledge", exact=True)).to_have_count(0)
    expect(page.get_by_role("button", name="Take over")).to_have_count(0)
    page.get_by_role("link", name="Map").click()
    page.get_by_role("region", name="Robots").get_by_role("button", name="robot-1").click()
    card = page.get_by_role("complementary", name="What is chosen")
    expect(card).to_contain_text(re.compile(r"temperature \d"), timeout=SLOW)

    first.process.kill()
    expect(page.get_by_role("alert")).to_contain_text("is silent", timeout=SLOW)
    words = ("--dva", dva, "--for", "1000", "--no-page")
    programs.start("live", "hands-on", "--only", "dva", *words)
    expect(page.get_by_text("is silent")).to_have_count(0, timeout=SLOW)
    page.get_by_role("link", name="Devices").click()
    expect(robot).to_contain_text("Idle", timeout=SLOW)


@pytest.fixture
def supervised(programs: Programs, tmp_path: Path) -> tuple[str, Path]:
    """The address of a DVA elsewhere that lets a control room supervise, and the keys for it."""
    dva, keys = f"127.0.0.1:{free_port()}", tmp_path / "keys"
    own = id_of("control-room", 1), id_of("console", 1)
    create_keys(keys, [*team_of(build(load("hands-on"))), *own])
    words = ("--dva", dva, "--keys", str(keys), "--for", "1000", "--set", FIRE)
    roles = ("--set", "dva.control_rooms={control-room-1: supervise}")
    asks = ("--set", "dispatch.mode=ask_first")
    programs.start("live", "hands-on", "--only", "dva", "--no-page", *words, *roles, *asks)
    programs.start("live", "hands-on", "--only", "world", *words)
    return dva, keys


def test_people_at_an_attached_console_decide_see_alarms_and_read_what_they_did(
    programs, supervised, visit, tmp_path
):
    dva, keys = supervised
    audit = tmp_path / "audit.sqlite"
    words = ("--dva", dva, "--keys", str(keys), "--audit", str(audit))
    console, address = started(programs, "hands-on", *words)
    page = visit.open(address, "events")

    page.locator(".desk-head summary").click(timeout=SLOW)
    page.get_by_label("Your name").fill("ana")
    expect(page.get_by_role("button", name="Use this name")).to_be_visible(timeout=SLOW)
    page.get_by_role("button", name="Use this name").click()
    expect(page.get_by_text("The log shows you as ana")).to_be_visible(timeout=SLOW)
    fire = page.get_by_role("button", name=re.compile("^Event 1 Fire"))
    fire.click(timeout=SLOW)
    assert faults(page) == []
    page.get_by_role("button", name="Acknowledge", exact=True).click()
    expect(fire).to_contain_text("control room", timeout=SLOW)
    page.get_by_role("radio", name="guard-1").check(timeout=SLOW)
    page.get_by_role("button", name="Send guard-1").click()
    expect(fire).to_contain_text("guard-1", timeout=SLOW)
    page.get_by_role("radio", name="robot-1").check(timeout=SLOW)
    page.get_by_label("by itself").check()
    page.get_by_role("button", name="Send robot-1").click()
    done = page.get_by_role("status", name="Done")
    expect(done).to_contain_text("by itself", timeout=SLOW)
    page.get_by_role("radio", name="robot-2").check(timeout=SLOW)
    page.get_by_label("I drive").check()
    page.get_by_role("button", name="Drive robot-2 there").click()
    expect(page).to_have_url(re.compile("#/drive"), timeout=SLOW)
    expect(page.get_by_role("button", name="Start", exact=True)).to_be_enabled(timeout=SLOW)
    assert faults(page) == []

    page.get_by_role("link", name="Audit").click()
    table = page.get_by_role("table", name="Audit log")
    rows = table.get_by_role("row")
    expect(rows.filter(has_text="anasuperviseacknowledge")).to_have_count(1)
    expect(rows.filter(has_text="by itself").filter(has_text="ana")).to_have_count(1)
    expect(page.get_by_role("status", name="Verification")).to_contain_text("Verified")
    assert faults(page) == []
    page.close()
    console.send(signal.SIGINT)
    assert console.ends() == 0
    assert verify(audit).is_ended


@pytest.fixture
def bare(programs: Programs) -> tuple[str, str]:
    """The address of a DVA that runs alone, and that of its page."""
    dva = f"127.0.0.1:{free_port()}"
    words = ("--dva", dva, "--for", "1000", "--page", "0")
    program = programs.start("live", "hands-on", "--only", "dva", *words)
    program.wait_to_say("Look only:")
    return dva, re.findall(r"^Console: +(\S+)$", program.output, re.MULTILINE)[0]


def registered(dva: str) -> None:
    """A client registers, and sends a broken message."""
    body = m.Registration("tablet", "TeleOp", "127.0.0.1:9")
    said = encode(m.Message(DVA, 1, "56:2B:04:E4:56:D8", "12:00:00", 0, body))
    with zmq.Context() as context, context.socket(zmq.REQ) as socket:
        socket.linger = 0
        socket.connect(f"tcp://{dva}")
        for data in (said, b"<msg>hello"):
            socket.send(data)
            assert socket.poll(1000 * PATIENCE_S)
            socket.recv()


def test_a_dva_alone_has_a_page_as_the_simulator_of_the_dissertation_had(bare, visit):
    dva, address = bare
    page = visit.open(address, "")
    state = page.get_by_role("status", name="Server state")
    expect(state).to_have_text(f"Listening on {dva}", timeout=SLOW)  # Main is shown first
    registered(dva)
    table = page.get_by_role("table", name="Requests")
    line = table.get_by_role("row").filter(has_text="tablet")
    expect(line).to_have_count(1, timeout=SLOW)
    expect(line).to_contain_text("0 ok")
    refused = table.get_by_role("row").filter(has_text="1 bad message")
    refused.get_by_role("button").click()
    message = page.get_by_role("region", name="Message")
    expect(message).to_contain_text("<msg>hello")
    expect(message).to_contain_text(re.compile(r"Line \d+, column \d+"))
    line.get_by_role("button").click()
    expect(message).to_contain_text("56:2B:04:E4:56:D8")

    assert table.get_by_role("row").filter(has_text="GetDeviceList").count() == 0
    page.get_by_role("checkbox", name="This console's").check()
    expect(table.get_by_role("row").filter(has_text="GetDeviceList").first).to_be_visible()
    page.get_by_label("Kind").select_option("RegMsg")
    expect(table.get_by_role("row").filter(has_text="GetDeviceList")).to_have_count(0)
    for scheme, width in (("light", 1024), ("dark", 360)):
        page.emulate_media(color_scheme=scheme)
        page.set_viewport_size({"width": width, "height": 768})
        assert faults(page) == []

    page.set_viewport_size({"width": 1440, "height": 900})
    page.get_by_role("button", name="Stop server").click()
    expect(state).to_contain_text("Stopped", timeout=SLOW)
    page.get_by_role("link", name="Devices").click()
    expect(page.get_by_role("alert")).to_contain_text("DVA's server is stopped")
    page.get_by_role("link", name="Main").click()
    other = free_port()
    page.get_by_label("Port").fill(str(other))
    page.get_by_role("button", name="Start server").click()
    expect(state).to_have_text(f"Listening on 127.0.0.1:{other}", timeout=SLOW)
    expect(page.get_by_text("The DVA's server is stopped")).to_have_count(0, timeout=SLOW)

    page.get_by_role("link", name="Devices").click()
    page.get_by_role("button", name="Add fake device").click()
    page.get_by_label("Label", exact=True).fill("ghost")
    page.get_by_role("button", name="Add", exact=True).click()
    expect(page.get_by_role("row", name=re.compile("ghost"))).to_be_visible(timeout=SLOW)
