"""The DVA under a person's hand: its server, fake devices, permissions."""

import re
import socket

import pytest
from helpers.console.simulated_console import Page
from helpers.processes.patience import PATIENCE_S
from helpers.wording import unnamed

from dva_sim.console.dva.device_rows import link_of
from dva_sim.console.dva.fake_devices import RENEW
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import FORGET_AFTER
from dva_sim.protocol.mistakes import check_message
from dva_sim.simulation.full.stage import DVA

GHOST = "02:00:00:0F:00:01"


@pytest.fixture
def page(monkeypatch):
    page = Page(monkeypatch, guard__count=1, bystander__count=0)
    page.let(1.0)
    return page


@pytest.fixture
def real(monkeypatch):
    page = Page(monkeypatch, sockets=ConsoleSockets, guard__count=0, bystander__count=0)
    page.world.clock.go()
    page.let(0.3)
    yield page
    page.world.sockets.close()


def devices(page):
    """The table as a page that looks at it gets it."""
    page.actions.take({"do": "look", "logs": {}, "tables": ["devices"]})
    page.let(2.5)
    return {row["id"]: row for row in page.lines_of("devices")[-1]["devices"]}


def asked_of(page, device, peer, body):
    """Result of a request: the reply, or None for a time-out."""
    ends = []
    device.ask(peer, body, ends.append, lambda: ends.append(None))
    page.until(lambda: ends, PATIENCE_S, 0.05)
    return ends[0]


def someone(page):
    return page.world.seating.persons[0].device


def listed(page):
    return {
        d.id_tag: d for d in asked_of(page, someone(page), DVA, m.GetDeviceList()).content.devices
    }


# --- the server --------------------------------------------------------------------------------


def test_a_stopped_server_answers_nobody_and_a_started_one_does(page):
    assert page.do("server_stop") == (True, "the server is stopped")
    assert page.lines_of("rows")[-1]["server"]["listens"] is False
    assert asked_of(page, someone(page), DVA, m.GetDeviceList()) is None
    done, text = page.do("server_start", port=6000)
    assert (done, unnamed(text, "192.168.0.2:6000")) == (True, [])
    assert asked_of(page, someone(page), DVA, m.GetDeviceList()).code == m.OK
    server = page.lines_of("rows")[-1]["server"]
    assert (server["listens"], server["port"], server["modelled"]) == (True, 6000, True)
    assert server["address"] == "192.168.0.2:6000"
    assert page.lines_of("scene")[-1]["dva_address"] == "192.168.0.2:6000"


def test_devices_outlast_a_server_that_was_stopped_for_long(page):
    page.do("server_stop")
    page.let(60.0)
    page.do("server_start", port=5555)
    page.let(2.0)
    assert not any(e.silent for e in page.world.run.dva.core.registry.entries.values())


def test_a_person_is_told_for_how_long_the_server_has_been_silent(page):
    assert page.do("take", robots=[0])[0]
    page.let(5.0)
    page.do("server_stop")
    page.let(15.0)
    alerts = [line["alert"] for line in page.lines_of("seat") if line["seat"] == page.client]
    reported = dict.fromkeys(alert for alert in alerts if alert)
    assert len(reported) > 2
    assert all(re.search(r"DVA.* 1[1-6] s", alert) for alert in reported)
    page.do("server_start", port=5555)
    page.let(5.0)
    assert page.seat()["alert"] == ""
    story = [line["what"] for line in page.lines_of("story")]
    assert any(unnamed(what, "DVA", "silent") == [] for what in story)


def test_a_stopped_server_decides_and_says_nothing(page):
    page.do("server_stop")
    sent, reported = [], page.world.recorder.message_sent

    def note(time, source, *about):
        sent.extend([source] if source == DVA else [])
        reported(time, source, *about)

    page.world.recorder.message_sent = note
    page.let(90.0)  # in which fire and gas would have been reported, and guards sent
    assert sent == []
    assert not page.world.run.dva.core.events.total


@pytest.mark.parametrize("what", ["server_stop", "server_start"])
def test_what_is_so_already_is_refused(page, what):
    if what == "server_stop":
        page.do("server_stop")
    assert page.do(what, port=5555)[0] is False


def test_a_phone_has_to_know_the_new_port(page):
    page.do("server_stop")
    page.do("server_start", port=6000)
    about = {"server": "192.168.0.2", "label": "phone", "type": "Teleoperation"}
    assert page.do("phone_register", port=5555, **about)[0] is False
    assert page.do("phone_register", port=6000, **about)[0] is True


def test_over_sockets_the_port_is_closed_and_another_one_opened(real):
    before = real.world.sockets.dva.rpartition(":")[2]
    assert real.do("server_stop")[0]
    real.let(0.3)
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", int(before))) != 0
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    ok, text = real.do("server_start", port=min(port, 60_000))
    assert (ok, unnamed(text, f"127.0.0.1:{min(port, 60_000)}")) == (True, [])
    assert asked_of(real, someone(real), DVA, m.GetDeviceList()).code == m.OK


def test_over_sockets_a_port_that_is_taken_is_told_and_the_server_stays_stopped(real):
    real.do("server_stop")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        ok, text = real.do("server_start", port=taken.getsockname()[1])
    assert not ok
    assert "cannot listen" in text
    assert real.world.bench.port.listens is False


# --- fake devices ------------------------------------------------------------------------------


def test_a_fake_device_is_on_every_list_and_stays_there(page):
    assert page.do("fake_add", label="ghost", type="Robot")[0]
    page.let(FORGET_AFTER + 30.0)
    row = devices(page)[GHOST]
    wanted = {"label": "ghost", "type": "Robot", "fake": True, "silent": False}
    assert {name: row[name] for name in wanted} == wanted
    assert row["heard_s"] <= RENEW + 0.1
    assert listed(page)[GHOST] == m.Device(GHOST, "ghost", "Robot", "192.168.15.2")


@pytest.mark.parametrize("kind", ["page", "real"])
def test_who_contacts_a_fake_device_has_a_time_out(kind, request):
    page = request.getfixturevalue(kind)
    page.do("fake_add", label="ghost", type="Robot")
    someone(page).be_patient(0.2)
    assert asked_of(page, someone(page), GHOST, m.GetSensorInfo()) is None
    assert asked_of(page, someone(page), DVA, m.GetDeviceList()).code == m.OK


def test_a_phone_that_chooses_a_fake_robot_is_told_that_nobody_answers(page):
    page.do("fake_add", label="ghost", type="Robot")
    page.do("phone_register", server="192.168.0.2", port=5555, label="p", type="Teleoperation")
    assert page.do("phone_permission", device=GHOST, level="both")[0]
    ok, text = page.do("start", within=PATIENCE_S)
    assert not ok
    assert text.startswith("ghost")


def test_a_fake_device_speaks_as_others_do(page):
    seen = []
    page.world.logs.listen("dva", seen.append)
    page.do("fake_add", label="ghost", type="Guard", address="10.0.0.7:5600")
    page.let(10.0)
    own = [one.data for one in seen if f"<SourceID>{GHOST}".encode() in one.data]
    assert len(own) > 2
    assert [check_message(data) for data in own] == [[]] * len(own)
    assert not any(b"fake" in data for data in own)


def test_a_removed_fake_device_is_gone_at_once_and_stays_away(page):
    page.do("fake_add", label="ghost", type="Robot")
    assert page.do("fake_remove", device=GHOST) == (True, "ghost is removed")
    assert GHOST not in listed(page)
    page.let(30.0)
    assert GHOST not in devices(page)
    assert GHOST not in page.world.run.stage.labels


def test_an_id_of_ones_own_is_taken_once(page):
    own = "0A:00:00:00:00:07"
    assert page.do("fake_add", label="one", type="TeleOp", id_tag=own.lower())[0]
    for taken in (own, DVA, "7"):
        assert page.do("fake_add", label="two", type="TeleOp", id_tag=taken)[0] is False
    assert own in page.lines_of("done")[-3]["text"]
    done, text = page.do("fake_add", label="two", type="TeleOp")
    assert (done, unnamed(text, "two", GHOST)) == (True, [])


@pytest.mark.parametrize(
    "about",
    [
        {"label": "", "type": "Robot"},
        {"label": "x" * 65, "type": "Robot"},
        {"label": "a\nb", "type": "Robot"},
        {"label": "x", "type": "DVA"},
        {"label": "x", "type": "Robot", "address": "no address"},
    ],
)
def test_what_no_message_can_hold_is_refused_and_leaves_nothing(page, about):
    before = len(page.world.run.stage.devices), len(page.world.run.stage.labels)
    assert page.do("fake_add", **about)[0] is False
    assert (len(page.world.run.stage.devices), len(page.world.run.stage.labels)) == before


def test_a_stopped_server_takes_no_fake_device(page):
    page.do("server_stop")
    done, text = page.do("fake_add", label="ghost", type="Robot")
    assert (done, "DVA" in text) == (False, True)
    assert GHOST not in page.world.run.stage.labels


# --- permissions -------------------------------------------------------------------------------


def test_a_permission_is_shown_with_its_holder_and_revoked(page):
    page.do("take", robots=["robot-1"])
    robot = page.robot().device.id_tag
    row = devices(page)[robot]
    wanted = {"holder_label": "console-1", "level": "teleoperation", "ends_s": None}
    assert {name: row[name] for name in wanted} == wanted
    done, text = page.do("revoke", device=robot, role="supervise")
    assert (done, unnamed(text, "console-1", "robot-1")) == (True, [])
    page.let(2.0)
    assert devices(page)[robot]["holder"] is None
    assert page.robot().holder[0] is None
    assert "nobody" in page.do("revoke", device=robot, role="supervise")[1]


def test_the_end_of_a_permission_is_that_of_the_rule_that_allows_it(monkeypatch):
    rule = {"holders": ["console-1"], "levels": ["teleoperation"], "until_s": 100.0}
    page = Page(monkeypatch, access=[rule])
    page.do("take", robots=["robot-1"])
    row = devices(page)[page.robot().device.id_tag]
    assert row["ends_s"] == pytest.approx(100.0 - page.lines_of("devices")[-1]["t"] / 1000, abs=0.1)


def test_nobody_who_does_not_look_is_told_of_devices(page):
    page.let(5.0)
    assert page.lines_of("devices") == []


@pytest.mark.parametrize(
    ("heard_s", "silent", "link"),
    [(1.9, False, "good"), (5.5, False, "fair"), (8.5, False, "poor"), (11.0, True, "lost")],
)
def test_the_link_of_a_device_is_judged_by_when_it_was_heard(heard_s, silent, link):
    assert link_of(heard_s, silent) == link


# --- who is none of the scenario's -----------------------------------------------------------


def test_who_joins_is_shown_with_what_the_dva_knows(page):
    page.do("fake_add", label="robot-1", type="Robot", id_tag=GHOST)
    page.let(3.0)
    scene, rows = page.lines_of("scene")[-1], page.lines_of("rows")[-1]
    (ghost,) = [thing for thing in scene["things"] if thing["id"] == GHOST]
    assert (ghost["kind"], ghost["label"]) == ("robot", f"robot-1 ({GHOST})")
    (row,) = [row for row in rows["robots"] if row["i"] == ghost["i"]]
    assert (row["mode"], row["battery"], row["commands_hz"]) == ("unknown", None, None)
    assert page.do("take", robots=["robot-1"])[0]  # leads to the one of that label alone
    assert page.seat()["drives"][0]["i"] == 0
    page.do("fake_remove", device=GHOST)
    page.let(3.0)
    assert ghost["i"] not in [row["i"] for row in page.lines_of("rows")[-1]["robots"]]
