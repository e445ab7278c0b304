"""`dva-sim live --transport mqtt`: the same run, by a broker in place of sockets of ZeroMQ."""

import os
import signal

import pytest
from helpers.network.emulated_link import need_link
from helpers.network.transports import NO_MQTT
from helpers.processes.programs import wait_until
from helpers.wording import unnamed

pytestmark = pytest.mark.system
if NO_MQTT:
    pytest.skip(NO_MQTT, allow_module_level=True)

LIVE = ("live", "drive-to-event", "--operators", "scripted", "--transport", "mqtt")
RULES = ("S1 held", "S2 held", "S3 held", "S4 held", "S5 held", "S6 held", "S7 held")


@pytest.mark.invariant("S1", "S2", "S3", "S4", "S5")
def test_a_whole_run_keeps_the_rules(programs):
    """A drive, an emergency, a command that comes too late, a second drive."""
    run = programs.start(*LIVE)
    assert run.ends() == 0, run.complained
    assert unnamed(run.output, "200 of 200 commands obeyed", "emergency: obeyed", *RULES) == []
    assert "one more command: refused (wrong mode)" in run.output
    assert programs.processes() == {}


@pytest.mark.invariant("S1")
def test_a_broker_that_is_killed_is_told_once_and_the_driven_robot_stands(programs):
    run = programs.start(*LIVE, "--for", "20")
    run.wait_to_say("sends 200 commands")
    broker = next(p for p, command in programs.processes().items() if "mosquitto" in command)
    os.kill(broker, signal.SIGKILL)
    assert run.ends() == 0, run.complained
    assert run.output.count("MQTT broker") == 1
    assert unnamed(run.output, *RULES) == []
    assert "200 of 200" not in run.output
    assert programs.processes() == {}


@pytest.mark.parametrize("end", ["near", "far"])
def test_robots_and_a_broker_may_be_at_either_end_of_a_link(programs, end):
    need_link()
    words = (*LIVE, "--transport", f"broker={end}", "--link", "delay_s=0.05")
    run = programs.start(*words)
    run.wait_to_say(f"DVA: 10.77.0.{1 if end == 'near' else 2}:", "sends 200 commands")
    run.send(signal.SIGINT)
    assert run.ends() == 0, run.complained
    assert unnamed(run.output, "to the robots: ", *RULES) == []
    wait_until(lambda: programs.processes() == {}, "all parts end")
