"""Several DVAs as processes over sockets: one is killed, and the others go on."""

import os
import signal

import pytest

from dva_sim.agents.control_room.control_room import ControlRoomAgent
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.recorder import Recorder
from dva_sim.live.options import scenario_of
from dva_sim.live.supervisor import free_pairs
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import LiveOptions
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import Stage, id_of

HALL = """
site: {name: hall}
robot: {count: 1}
operator: {count: 1}
guard: {count: 2}
control: supervisory
events: [{kind: fire, position: [50, 20], at_s: 2, reported: true}]
dva:
  regions:
    west: {polygon: [[0, 0], [30, 0], [30, 40], [0, 40]]}
    east: {rest: true}
horizon_s: 300
"""


@pytest.fixture
def hall(tmp_path):
    path = tmp_path / "hall-of-two.yaml"
    path.write_text(HALL)
    return path


@pytest.mark.system
@pytest.mark.invariant("S13")
def test_a_deputy_takes_over_when_the_process_of_a_dva_is_killed(programs, hall):
    run = programs.start("live", hall)
    run.wait_to_say("is sent to event")
    killed = next(
        process
        for process, command in programs.processes().items()
        if '"part": "dva", "number": 2' in command
    )
    os.kill(killed, signal.SIGKILL)
    run.wait_to_say("has ended; the others go on", "dva-west", "takes over east")
    run.wait_to_say("is confirmed")
    assert run.ends() == 0
    for rule in ("S6", "S12", "S13", "S14", "S15"):
        assert f"{rule} held" in run.output


@pytest.mark.system
def test_a_run_whose_dvas_have_all_been_killed_ends(programs, hall):
    run = programs.start("live", hall)
    run.wait_to_say("is sent to event")
    for process, command in programs.processes().items():
        if '"part": "dva"' in command:
            os.kill(process, signal.SIGKILL)
    assert run.ends() == 3
    assert "has ended by itself: killed by signal 9" in run.complained[0]


@pytest.fixture
def network():
    sockets = SocketNetwork(LiveClock())
    yield sockets
    sockets.close()


SUPERVISED = "dva.control_rooms={control-room-1: supervise}"


@pytest.mark.system
def test_a_region_is_given_back_to_the_process_of_its_dva(programs, hall, network):
    addresses = [f"127.0.0.1:{port}" for port in free_pairs(2)]

    def start(number):
        words = "--only", "dva", "--number", str(number), "--dva", ",".join(addresses)
        run = programs.start("live", hall, *words, "--no-page", "--set", SUPERVISED)
        run.wait_to_say(f"DVA: {addresses[number - 1]}")
        return run

    runs = {id_of("dva", number): start(number) for number in (1, 2)}
    clock = network.clock
    stage = Stage(scenario_of(LiveOptions(str(hall))), 1, network, Recorder())
    stage.address = lambda kind, number: network.join(id_of(kind, number))
    agent = ControlRoomAgent(stage.device("control-room", 1))
    room = agent.device
    for dva, address in zip(runs, addresses, strict=True):
        room.introduce(dva, address)
    agent.start()
    clock.run(clock.now + 3.0)
    run_until(clock, lambda: room.dva_watch.heard is not None)
    killed = room.dva  # on a late machine it may have turned to the second
    deputy = next(dva for dva in runs if dva != killed)
    number = list(runs).index(killed) + 1
    runs[killed].send(signal.SIGKILL)
    run_until(clock, lambda: room.dva == deputy)
    start(number)
    answers = []

    def ask():
        room.ask(deputy, m.GiveBack(("west", "east")[number - 1]), answers.append)
        return not any(reply.code == m.OK for reply in answers)

    clock.every(1.0, ask)
    run_until(clock, lambda: room.dva == killed)
    assert answers[-1].code == m.OK


def run_until(clock, holds, within_s=60.0):
    latest = clock.now + within_s
    while not holds():
        assert clock.now < latest
        clock.run(clock.now + 0.1)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"dva": "127.0.0.1:5600"}, "--dva names 1 addresses, and the scenario has 2 regions"),
        ({"dva": "127.0.0.1:5600,127.0.0.1"}, "'127.0.0.1' has no port"),
        ({"only": "dva", "number": 3}, "--number 3: the scenario has 2 DVAs"),
        ({"link": ("loss=0.1",)}, "--link: not with dva.regions"),
        ({"set": ("dva.deaths=[{region: east, at_s: 5}]",)}, "dva.deaths: only in virtual time"),
        ({"set": ("dva.backbone.delay_s=0.1",)}, "dva.backbone: only in virtual time"),
    ],
)
def test_what_several_dvas_cannot_do_over_sockets_is_refused_in_a_line(hall, options, problem):
    with pytest.raises(ConfigError) as refused:
        scenario_of(LiveOptions(str(hall), **options))
    assert problem in str(refused.value)
    assert "\n" not in str(refused.value)


def test_several_addresses_are_too_many_for_one_dva():
    with pytest.raises(ConfigError, match="names 2 addresses, and the scenario has one DVA"):
        scenario_of(LiveOptions("drive-to-event", dva="127.0.0.1:5600,127.0.0.1:5602"))


def test_pairs_of_ports_do_not_overlap():
    ports = [port for first in free_pairs(5) for port in (first, first + 1)]
    assert len(set(ports)) == 10
