"""A console's robots behind an emulated link: driven, delayed, and stopped when it is lost."""

import os
import signal
from functools import partial

import pytest
from helpers.console.simulated_console import Page
from helpers.network.emulated_link import need_link
from helpers.processes.patience import PATIENCE_S
from helpers.processes.programs import all_gone_after
from helpers.wording import unnamed

from dva_sim.agents.robot.controller import Mode
from dva_sim.cli.program import call
from dva_sim.console.run.real_links import ConsoleSockets
from dva_sim.network.emulator.needs import EmulatorError
from dva_sim.network.emulator.process import LinkProcess

QUIET = {"guard__count": 0, "bystander__count": 0}
EACH_WAY = 0.3  # [s]
PARTITIONS = "link.partitions=[{from_s: 0, for_s: 1}]"


def page_over(monkeypatch, **link):
    need_link()
    sockets = partial(ConsoleSockets, emulated=1)
    changes = {f"link__{key}": value for key, value in link.items()}
    page = Page(monkeypatch, sockets=sockets, **QUIET, **changes)
    page.world.clock.go()
    return page


def drive(page):
    """Take a robot and drive it, again and again where this machine does much else."""
    # It is registered as soon as its first words have crossed the link.
    page.until(lambda: page.do("take", robots=[0], within=PATIENCE_S)[0], PATIENCE_S)
    page.want(0.5)

    def moves():
        if page.robot().controller.mode is not Mode.TELEOPERATION:
            page.do("start", within=PATIENCE_S)
        return page.robot().body.speed > 0.2

    page.until(moves, PATIENCE_S, 0.02)


@pytest.fixture
def programs(tmp_path):
    yield from all_gone_after(tmp_path)


@pytest.mark.system
def test_a_person_drives_over_the_link_and_sees_how_late_everything_is(monkeypatch):
    page = page_over(monkeypatch, delay_s=EACH_WAY)
    try:
        page.actions.take({"client": "c1", "do": "watch", "robots": [0]})
        assert page.do("pattern", robot=0, name="req-rep", within=PATIENCE_S)[0]
        drive(page)
        shown = partial(page.drive)
        page.until(lambda: shown()["loop_ms"] is not None, PATIENCE_S, 0.02)
        # TCP is slow in its first seconds, and where one connection carries everything.
        is_quick = lambda: 0 < (shown()["round_trip_ms"] or 0) < 4000 * EACH_WAY  # noqa: E731
        page.until(is_quick, PATIENCE_S, 0.02)
        drive_shown = shown()
        picture = drive_shown["picture_arrived_ms"] - drive_shown["picture_ms"]
        assert drive_shown["round_trip_ms"] >= 2000 * EACH_WAY
        assert drive_shown["command_age_ms"] >= 1000 * EACH_WAY
        assert picture >= 1000 * EACH_WAY
        assert drive_shown["loop_ms"] >= 1000 * EACH_WAY
        assert not page.world.recorder.violations
        shown = page.lines_of("rows")[-1]["link"]
        assert (shown["kind"], shown["delay_s"], shown["loss"]) == ("real", EACH_WAY, 0.0)
        done, text = page.do("link", delay_s=0.1)
        assert (done, unnamed(text, "--link")) == (False, [])
    finally:
        page.world.sockets.close()
    packets = page.world.sockets.packets
    assert min(packets.up.passed_packets, packets.down.passed_packets) > 10


@pytest.mark.system
@pytest.mark.invariant("S1")
def test_a_driven_robot_stands_when_the_link_ends_by_itself(monkeypatch):
    page = page_over(monkeypatch, delay_s=0.02)
    try:
        drive(page)
        link = page.world.sockets.crossing.link._link
        os.kill(link._process.pid, signal.SIGKILL)
        page.until(lambda: page.world.sockets.has_lost_link, PATIENCE_S, 0.02)
        page.until(lambda: page.robot().body.speed < 0.01, PATIENCE_S, 0.02)
        assert not page.world.recorder.violations
    finally:
        page.world.sockets.close()


CONSOLE = ("console", "--links", "real", "--no-open", "--no-token", "--port", "0")


@pytest.mark.system
def test_ctrl_c_ends_the_link_and_everything_at_its_ends(programs):
    need_link()
    run = programs.start(*CONSOLE, "--link", "delay_s=0.05", "--link", "loss=0.01")
    run.wait_to_say("DVA: 127.0.0.1:")
    run.send(signal.SIGINT)
    assert run.ends() == 0, run.complained
    assert unnamed(run.output, "S1 held", "to the robots: ", "from the robots: ") == []
    assert programs.processes() == {}


@pytest.mark.system
def test_a_link_that_is_killed_ends_the_console_in_one_line(programs):
    need_link()
    run = programs.start(*CONSOLE, "--link", "scenario")
    run.wait_to_say("DVA: 127.0.0.1:")
    starts = next(p for p, command in programs.processes().items() if "emulator.start" in command)
    os.kill(starts, signal.SIGKILL)
    assert run.ends() == 3
    assert unnamed(run.complained[-1], "emulated link has ended by itself") == [], run.complained
    assert programs.processes() == {}


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["--link", "delay_s=1"], ("--link", "--links real")),
        (["--links", "real", "--link", "delay=1"], ("--link", "delay_s")),
        (["--links", "real", "--link", "none.yaml"], ("none.yaml",)),
        (["--dva", "127.0.0.1:5600", "--link", "delay_s=1"], ("--link", "--dva")),
        (["--links", "real", "--link", "trace_up=none.trace"], ("none.trace",)),
        (
            ["--links", "real", "--link", "scenario", "--set", "zeromq.send_buffer_bytes=4096"],
            ("zeromq", "--link"),
        ),
        (
            ["--links", "real", "--link", "scenario", "--set", PARTITIONS],
            ("link.partitions", "link.outages"),
        ),
    ],
)
def test_what_cannot_be_emulated_is_refused_in_one_line(words, names, capsys):
    assert call(["console", *words]) == 2
    assert unnamed(capsys.readouterr().err, *names) == []


def test_a_machine_without_namespaces_says_so_in_one_line(monkeypatch, capsys):
    def refuse(*_):
        raise EmulatorError("the emulated link needs Linux")

    monkeypatch.setattr(LinkProcess, "__init__", refuse)
    assert call([*CONSOLE, "--link", "scenario"]) != 0
    assert unnamed(capsys.readouterr().err, "emulated link needs") == []
