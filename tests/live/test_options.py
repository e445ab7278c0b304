"""Mistakes in the words of `dva-sim live` that no process has to be started for, and ports."""

from itertools import islice

import pytest
from helpers.processes.command_line import call
from helpers.wording import unnamed

from dva_sim.live import supervisor
from dva_sim.simulation import scenario as scenarios


@pytest.mark.system
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--set", "operator.strategy=oracle"], "only in virtual time"),
        (["--set", "nonsense"], "should be key=value"),
        (["--set", "link.delay_ms=1"], "did you mean 'delay_s'?"),
        (["--only", "nothing"], "--only 'nothing' should be dva, world or operator"),
        (["--only", "operator", "--number", "2"], "--number 2: the scenario has 1 operator"),
        (["--only", "operator", "--number", "0"], "should be a whole number of at least 1"),
        (["--operators", "idle"], "should be simulated or scripted"),
        (["--port", "70000"], "should be a whole number from 0 to 64999"),
        *((["--dva", dva], "HOST:PORT") for dva in ("a:b:c", "foo", "foo:", "")),
        (["--dva", "127.0.0.1:65535"], "1 to 65534"),
        *((["--dva", dva], "HOST:PORT") for dva in ("127.0.0.1", "127.0.0.1:x", ":5600")),
        (["--for", "-1"], "--for '-1' should be a number above 0"),
        (["--for", "nan"], "--for 'nan' should be a number above 0"),
        (["--set", "robot.count=900"], "--set robot.count=900: site 'caparica' has room for 2"),
        (["--only", "world", "--set", "robot.count=900"], "--set robot.count=900: site 'caparica'"),
        (["--record", "/dev/null"], "recording should end in .mcap, not 'null'; a folder for"),
        (["--record", "run.mcp"], "recording should end in .mcap, not 'run.mcp'; a folder for"),
        (["--record", "no/run.mcap"], "folder 'no' for the recording does not exist"),
        (["--record", "there.mcap"], "there.mcap would be replaced; give another name, or --over"),
        (["--record", "cut.mcap"], "cut.mcap.part would be replaced; dva-sim replay cut.mcap.part"),
        (["--record", "traces"], "traces/dva.trace.jsonl and 1 more would be replaced; give"),
        (["--record", "traces", "--only", "world"], "traces/robot-1.trace.jsonl would be replaced"),
        (["--record", "/proc/run.mcap"], "nothing can be written in folder '/proc'"),
        (["--record", "full.mcap", "--overwrite"], "full.mcap.part: cannot be written"),
        (["--record", "/proc/traces"], "/proc/traces: cannot be a folder for traces"),
        (["--record", "/proc"], "nothing can be written in folder '/proc'"),
    ],
)
def test_a_mistake_ends_in_one_line_before_anything_is_started(
    tmp_path, monkeypatch, words, expected
):
    for name in ("there.mcap", "cut.mcap.part", "dva.trace.jsonl", "robot-1.trace.jsonl"):
        folder = tmp_path / ("traces" if name.endswith("jsonl") else "")
        folder.mkdir(exist_ok=True)
        (folder / name).write_text("of an earlier run")
    (tmp_path / "full.mcap.part").symlink_to("/dev/full")
    monkeypatch.setattr(supervisor, "Child", lambda *_, **__: pytest.fail("started"))
    ended = call("live", "drive-to-event", "--for", "60", *words, cwd=tmp_path)
    assert ended.returncode == 2
    (line,) = ended.stderr.splitlines()
    assert unnamed(line, "error: ", expected) == []
    assert (tmp_path / "there.mcap").read_text() == "of an earlier run"


@pytest.mark.parametrize(("first", "ports"), [(7000, [7002, 7014, 7016]), (0, [0, 0, 0])])
def test_each_device_has_two_ports_in_a_row_from_the_first_or_free_ones(first, ports):
    """The DVA has the first two; the drill's world has 2 robots, 2 guards and 2 detectors."""
    drill = scenarios.build(scenarios.load("fire-drill"))
    assert (drill.robot.count, drill.guard.count, len(drill.events)) == (2, 2, 2)
    assert list(islice(supervisor._ports(first, drill), 3)) == ports
