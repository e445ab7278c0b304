"""A console's world over sockets: driven as over the modelled link, and open to other devices."""

from dataclasses import replace

import pytest
from helpers.console.simulated_console import Page
from helpers.processes.patience import PATIENCE_S
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.console.run.real_links import TITLE, ConsoleSockets
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.real_network import NetworkError
from dva_sim.network.sockets import SocketNetwork
from dva_sim.simulation.full.stage import DVA, Stage, id_of

pytestmark = pytest.mark.system


@pytest.fixture
def page(monkeypatch):
    page = Page(monkeypatch, sockets=ConsoleSockets, guard__count=0, bystander__count=0)
    page.world.clock.go()
    yield page
    page.world.sockets.close()


def becomes(page, true):
    page.until(true, PATIENCE_S, 0.02)


def drive(page):
    """Begin to drive a robot that is held, again and again where this machine does much else."""

    def moves():
        if page.robot().controller.mode is not Mode.TELEOPERATION:
            page.do("start", within=PATIENCE_S)
        return page.robot().body.speed > 0.2

    page.want(0.5)
    becomes(page, moves)


def take_and_drive(page):
    assert page.do("take", robots=[0], within=PATIENCE_S)[0]
    drive(page)


def test_a_robot_is_driven_and_shown_and_no_rule_is_broken(page):
    page.actions.take({"client": "c1", "do": "watch", "robots": [0]})
    take_and_drive(page)
    becomes(page, lambda: any(line["k"] == "frame" for line in page.frames))
    becomes(page, lambda: page.drive()["command_age_ms"] is not None)
    assert page.do("emergency", robots="all", within=PATIENCE_S)[0]
    becomes(page, lambda: page.robot().controller.mode is Mode.IDLE)
    recorder = page.world.recorder
    assert recorder.messages > 50
    assert not recorder.violations


def test_a_robot_with_a_slack_watchdog_is_found_out_over_sockets_too(page):
    controller = page.robot().controller
    controller.limits = replace(controller.limits, watchdog=60.0)
    take_and_drive(page)
    becomes(page, lambda: page.world.recorder.violations)
    assert set(page.world.recorder.violations) == {"S1"}


@pytest.mark.parametrize(
    ("what", "about", "why"),
    [
        ("link", {"delay_s": 0.1}, TITLE),
        ("link", {"loss": 0.1, "processing_s": 0.1}, TITLE),
        ("pace", {"factor": 2}, "links are real"),
        ("pace", {"paused": True}, "links are real"),
    ],
)
def test_nothing_of_a_real_link_can_be_chosen(page, what, about, why):
    done, text = page.do(what, **about)
    assert (done, unnamed(text, why)) == (False, [])


def test_how_long_a_robots_computer_takes_can_be_chosen_all_the_same(page):
    assert page.do("link", processing_s=0.2)[0]
    becomes(page, lambda: page.lines_of("rows")[-1]["link"]["processing_s"] == 0.2)
    assert page.lines_of("rows")[-1]["link"] == {"kind": "real", "processing_s": 0.2}


def test_a_phone_registers_and_drives_over_sockets(page):
    host, _, port = page.world.sockets.dva.partition(":")
    asked = {"label": "mine", "type": "Teleoperation", "server": host, "port": int(port)}
    wait = {"within": PATIENCE_S}
    assert page.lines_of("scene")[0]["dva_address"] == f"{host}:{port}"
    assert page.do("phone_register", **asked, **wait)[0]
    assert page.do("phone_devices", **wait)[0]
    robot = page.robot().device.id_tag
    assert page.do("phone_permission", device=robot, level="teleoperation", **wait)[0]
    drive(page)
    assert not page.world.recorder.violations


def test_another_device_joins_over_the_network(page):
    world = page.world
    network = SocketNetwork(world.clock)
    stage = Stage(
        *(world.scenario, 1, network, Recorder()),
        lambda kind, number: network.join(id_of(kind, number)),
    )
    network.introduce(DVA, world.sockets.dva)
    newcomer = stage.device("operator", 9)
    newcomer.register()
    becomes(page, lambda: newcomer.id_tag in world.run.dva.core.registry.entries)
    network.close()


def test_a_port_that_is_taken_is_told_in_a_line(page, monkeypatch):
    port = int(page.world.sockets.dva.rpartition(":")[2])

    def taken(scenario, clock, recorder):
        return ConsoleSockets(scenario, clock, recorder, port=port)

    with pytest.raises(NetworkError, match=f"127.0.0.1.* {port} "):
        Page(monkeypatch, sockets=taken)
