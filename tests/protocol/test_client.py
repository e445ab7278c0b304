"""The clients beside the specification, run as they are against real sockets."""

import re
import shutil
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest
from helpers.paths import ROOT
from helpers.processes.command_line import call
from helpers.processes.patience import PATIENCE_S

from dva_sim.kernel.recorder import Recorder
from dva_sim.network.keys import KeyRing
from dva_sim.network.realtime import LiveClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.protocol.codec import decode
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.control_room import add_dva
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.stage import Stage, id_of, team_of

pytestmark = pytest.mark.system

CLIENTS = ROOT / "protocol" / "clients"
ROBOT = id_of("robot", 1)


QUIET = {"events": [{"kind": "fire", "at_s": 500}]}


@pytest.fixture
def network():
    network = SocketNetwork(LiveClock())
    yield network
    network.close()


def scenario_of(name="drive-to-event", changes=QUIET):
    return scenarios.build(scenarios.load(name), changes)


def a_dva(network, scenario, attended=False):
    """A DVA, and the world of its devices."""
    join = lambda kind, number: network.join(id_of(kind, number))  # noqa: E731
    stage = Stage(scenario, 1, network, Recorder(), join, attended=attended)
    dva, field = add_dva(stage), Field(stage)
    field.populate()
    return dva, field


def live_until(clock, condition):
    clock.every(0.05, lambda: not condition() or bool(clock.stop()))
    clock.run(clock.now + PATIENCE_S)


def client():
    """The text of the operator."""
    return (CLIENTS / "client.py").read_text()


def run(code, dva, folder, *words):
    """Output of a program that gets the address of a DVA."""
    program = folder / "program.py"
    program.write_text(code)
    for module in ("client.py", "heartbeats.py"):
        shutil.copy(CLIENTS / module, folder)
    process = subprocess.Popen(
        [sys.executable, str(program), dva.device.address, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        live_until(dva.device.clock, lambda: process.poll() is not None)
    finally:
        process.kill()
        out, err = process.communicate()
    return out, err


def test_the_client_of_the_specification_drives_a_robot(network, tmp_path):
    dva, field = a_dva(network, scenario_of())
    robot = field.robots[ROBOT]
    live_until(network.clock, lambda: dva.beats[ROBOT] > 0)

    out, err = run(client(), dva, tmp_path)
    assert (out.endswith("code 0\n"), err) == (True, "")
    assert robot.applied == 20
    assert robot.controller.without_tick == 20
    field.world.advance_to(network.clock.now)
    assert robot.body.distance > 0.3
    assert robot.controller.mode == "Idle"


@pytest.mark.parametrize("is_known", [True, False])
def test_a_client_of_another_make_drives_with_keys_and_not_without(tmp_path, is_known):
    me = re.search(r'ME, DVA, sent = "(.*?)"', client())[1]
    scenario, folder = scenario_of(), tmp_path / "keys"
    ended = call("keys", folder, "dva", "robot-1", *team_of(scenario), *([me] if is_known else []))
    assert ended.returncode == 0, ended.stderr
    network = SocketNetwork(LiveClock(), KeyRing(folder))
    own = folder
    if not is_known:
        own = tmp_path / "own"  # the device has keys that nobody has been given
        shutil.copytree(folder, own)
        call("keys", own, me)
    try:
        dva, field = a_dva(network, scenario)
        live_until(network.clock, lambda: dva.beats[ROBOT] > 0)
        program = client()
        if not is_known:
            program = program.replace("dva.connect(", "dva.rcvtimeo = 1000; dva.connect(")
        out, err = run(program, dva, tmp_path, str(own))
    finally:
        network.close()
    if is_known:
        assert (out.endswith("code 0\n"), err) == (True, "")
        assert field.robots[ROBOT].applied == 20
    else:
        assert "zmq.error.Again" in err
        assert me not in dva.core.registry.entries


def test_the_control_room_of_the_specification_acknowledges_and_sends_as_proposed(
    network, tmp_path
):
    control_room = (CLIENTS / "control_room.py").read_text()
    me = re.search(r'ME = "(.*?)"', control_room)[1]
    changes = {
        "events": [{"kind": "fire", "at_s": 0, "reported": True}],
        "dispatch.mode": "ask_first",
        "dva.control_rooms": {me: "dispatch"},
    }
    dva, field = a_dva(network, scenario_of("fire-drill", changes))
    field.schedule_incidents()
    guards = [id_of("guard", 1), id_of("guard", 2)]
    live_until(network.clock, lambda: all(dva.core.registry.entries.get(g) for g in guards))
    live_until(network.clock, lambda: dva.core.registry.located("Guard"))
    out, err = run(control_room, dva, tmp_path)
    assert (out.startswith("code 0"), err) == (True, "")
    event = dva.core.events.get(1)
    assert event.handling.acknowledged.author == me
    assert [f.overrides for f in dva.facts if f.action == "assign"] == [False]


def test_the_phone_of_the_specification_reports_an_event_and_follows_it(network, tmp_path):
    changes = QUIET | {"dispatch.escalate_after_s": 2}
    dva, _ = a_dva(network, scenario_of(changes=changes), attended=True)
    dva.start()
    out, err = run((CLIENTS / "phone.py").read_text(), dva, tmp_path)
    told = list(dict.fromkeys(out.splitlines()))
    assert (told, err) == (["event 1 is pending", "event 1 was escalated"], "")


def test_a_client_of_another_make_hears_the_heartbeats_of_the_dva(network, tmp_path):
    dva, _ = a_dva(network, scenario_of())
    dva.start()
    code = (CLIENTS / "heartbeats.py").read_text()
    once = code.replace("    while True:\n", "    for _ in range(4):\n")
    assert once != code
    out, err = run(once, dva, tmp_path)
    silences = [float(line.split()[2]) for line in out.splitlines()]
    assert (len(silences), err) == (4, "")
    assert min(silences[1:]) < 0.5


def test_two_lives_of_the_client_within_a_second_differ_in_their_bytes(monkeypatch):
    lives = []
    for now in (1000.25, 1000.5):
        monkeypatch.setattr(time, "time", lambda now=now: now)
        reported = []
        life = {}
        exec(client().partition("if __name__")[0], life)
        socket = SimpleNamespace(send_string=reported.append, recv_string=lambda: "")
        life["ask"](socket, "02:00:00:00:00:01", "<Access><GetDeviceList/></Access>")
        lives += reported
    assert lives[0] != lives[1]
    assert [decode(reported.encode()).message_id for reported in lives] == [1, 1]
