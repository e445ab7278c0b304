"""`dva-sim live --link`: robots behind an emulated link, real sockets on both sides of it."""

import json
import os
import signal

import pytest
from helpers.network.emulated_link import need_link
from helpers.processes.programs import wait_until
from helpers.wording import unnamed

from dva_sim.live.options import check, scenario_of
from dva_sim.network.link import LinkConfig
from dva_sim.options.runs import LiveOptions
from dva_sim.simulation.scenario import contradictions

SCRIPTED = ("live", "drive-to-event", "--operators", "scripted")


@pytest.mark.system
def test_what_robots_say_crosses_the_link_and_the_run_ends_with_it(programs):
    """The detector's report is answered over the link, until that is killed."""
    need_link()
    run = programs.start(*SCRIPTED, "--link", "up.delay_s=0.05", "--link", "down.delay_s=0.1")
    run.wait_to_say("DVA: 10.77.0.1:", "http://10.77.0.2:", "reports fire")
    starts = next(p for p, command in programs.processes().items() if "emulator.start" in command)
    os.kill(starts, signal.SIGKILL)
    assert run.ends() == 3
    assert unnamed(run.complained[-1], "emulated link has ended by itself") == []
    wait_until(lambda: programs.processes() == {}, "all parts end")


@pytest.mark.system
def test_the_end_of_a_run_tells_what_became_of_the_packets(programs):
    need_link()
    run = programs.start(*SCRIPTED, "--link", "delay_s=0.05", "--for", "0.5")
    assert run.ends() == 0, run.complained
    assert unnamed(run.output, "to the robots: ", "from the robots: ", "emulator late by: ") == []
    assert programs.processes() == {}


def test_the_link_becomes_that_of_the_scenario(tmp_path):
    """Time-outs and recordings follow from it, as in virtual time."""
    file = tmp_path / "bad.yaml"
    file.write_text("delay_s: 0.2\ndelay_law: {law: gamma, sd_s: 0.05}\nup: {loss: 0.1}\n")
    own = ("link.rate_bps=1e6",)
    for given, delay, rate, loss in (
        (["scenario"], 0.0, 1e6, 0.0),
        (["delay_s=0.5", "up.loss=0.3"], 0.5, 1e6, 0.3),
        ([str(file)], 0.2, LinkConfig().rate_bps, 0.1),
        (["delay_s=0.4", str(file)], 0.4, LinkConfig().rate_bps, 0.1),
    ):
        options = LiveOptions("drive-to-event", set=own, link=tuple(given))
        link = check(options).link
        assert (link.delay_s, link.rate_bps, link.toward("up").loss) == (delay, rate, loss)
    law = '{"law": "gamma", "sd_s": 0.05}'
    assert json.loads(law) == link.model_dump(exclude_defaults=True)["delay_law"]
    assert not any("modelled" in entry for entry in contradictions(scenario_of(options)))
