"""The commands as users start them: a robot of ROS, a live run and a console for its clients."""

import json
import re
import signal
import urllib.request

import pytest
from helpers.foxglove.viewer import Viewer
from helpers.paths import ROOT
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.ros.served_world import ScriptedRosClient
from helpers.wording import unnamed

from dva_sim.console.robots.robot_station import two_free_ports

pytestmark = pytest.mark.system


def address(program, name):
    program.wait_to_say(f"{name}: ")
    line = next(line for line in program.output.splitlines() if line.startswith(f"{name}: "))
    return line.split()[1]


def test_a_robot_of_ros_is_driven_by_a_script_at_a_dva_and_stands_in_the_end(programs, machine):
    where = f"127.0.0.1:{two_free_ports('127.0.0.1')}"
    words = ("--dva", where, "--for", "200", "--no-page")
    dva = programs.start("live", "drive-to-event", "--only", "dva", *words)
    dva.wait_to_say("DVA: ")
    robot = programs.start("robot", "--ros", machine.url, "--dva", where)
    robot.wait_to_say("is connected to its bridge", "can be driven again")
    driver = programs.start(
        *("live", "drive-to-event", "--only", "operator", "--operators", "scripted"),
        *("--dva", where, "--for", "60"),
    )
    assert becomes(lambda: "emergency: obeyed" in driver.output)
    assert max(speed for speed, _ in machine.commands) > 0.0
    robot.send(signal.SIGINT)
    assert robot.ends() == 0
    assert becomes(lambda: machine.ops("unadvertise"))
    assert machine.commands[-1] == (0.0, 0.0)
    assert robot.complained == []
    dva.send(signal.SIGINT)


def test_a_robot_of_ros_without_a_dva_ends_in_one_line(programs):
    robot = programs.start("robot", "--ros", "ws://127.0.0.1:1")
    assert robot.ends() == 2
    assert unnamed(robot.complained, "--dva") == []
    assert len(robot.complained) == 1


@pytest.mark.parametrize("command", ["live", "console"])
def test_clients_of_ros_and_foxglove_see_what_runs(programs, command):
    more = ("--for", "300") if command == "live" else ("--no-open", "--port", "0")
    run = programs.start(*(command, "fire-drill", "--rosbridge", "0", "--foxglove", "0"), *more)
    client = ScriptedRosClient(address(run, "rosbridge"))
    viewer = Viewer(address(run, "Foxglove"))
    assert becomes(lambda: client.is_open)
    topics = "/robot_1/odom", "/robot_1/image/compressed", "/clock"
    for topic in topics:
        client.subscribe(topic)
    assert becomes(lambda: all(client.of(topic) for topic in topics))
    assert client.of(topics[1])[0]["format"] == "jpeg"
    assert becomes(lambda: viewer.of("/tf") and viewer.of("/robot-1/image"))
    assert viewer.channels["/scene"]["schemaName"] == "foxglove.SceneUpdate"
    client.say({"op": "call_service", "service": "/robot_1/emergency_stop", "id": "stop"})
    assert becomes(lambda: any(each.get("id") == "stop" for each in client.came))
    answer = next(each for each in client.came if each.get("id") == "stop")
    assert answer["values"]["success"], json.dumps(answer)
    run.send(signal.SIGINT)
    assert run.ends() == 0
    assert becomes(lambda: client.closed)


def test_the_commands_of_the_guide_connect_a_robot_of_ros_to_a_console(programs, machine, tmp_path):
    """Only addresses are replaced, and ports by free ones."""
    guide = (ROOT / "docs/how-to/own-robot-ros.md").read_text(encoding="utf-8")
    profile = re.search(r"`mine\.yaml`:\n\n```yaml\n(.*?)```", guide, re.DOTALL)
    start = re.search(r"dva-sim console --links real.*", guide)
    connect = re.search(r"dva-sim robot mine\.yaml.*", guide)
    assert profile
    assert start
    assert connect
    (tmp_path / "mine.yaml").write_text(profile[1], encoding="utf-8")
    port = str(two_free_ports("127.0.0.1"))

    def words(command: str) -> list[str]:
        here = command.replace("5600", port).replace("ws://192.168.1.20:9090", machine.url)
        return here.split()[1:]

    console = programs.start(*words(start[0]), "--no-open", "--port", "0")
    console.wait_to_say(f"DVA: 127.0.0.1:{port}")
    robot = programs.start(*words(connect[0]))
    robot.wait_to_say("is connected to its bridge")
    page = address(console, "Console")
    base, _, token = page.partition("?token=")
    asked = urllib.request.Request(f"{base}api/state", headers={"Authorization": f"Bearer {token}"})

    def listed() -> list[str]:
        with urllib.request.urlopen(asked, timeout=PATIENCE_S) as answer:
            return [one["label"] for one in json.load(answer)["robots"]]

    assert becomes(lambda: "robot-3" in listed())
    assert "is not registered" not in robot.output


def test_a_robot_whose_id_is_in_use_is_told_of_the_option_that_gives_it_another(programs, machine):
    where = f"127.0.0.1:{two_free_ports('127.0.0.1')}"
    words = ("--dva", where, "--for", "200", "--no-page")
    programs.start("live", "drive-to-event", "--only", "dva", *words).wait_to_say("DVA: ")
    first = programs.start("robot", "--ros", machine.url, "--dva", where)
    first.wait_to_say("can be driven again")
    second = programs.start("robot", "--ros", machine.url, "--dva", where)
    second.wait_to_say("is not registered", "--number")
    lone = programs.start("robot", "--dva", where, "--no-open", "--port", "0")
    lone.wait_to_say("busy", "--number")
