"""Mistakes in the words of a live run and of its link, in names of keys, and in traces."""

from pathlib import Path

import pytest
from helpers.mistakes import Refused, check_mistake, command, each_mistake, mistakes, of_file

import dva_sim
from dva_sim.agents.robot.decision_log import replay
from dva_sim.cli.device_keys import make_keys
from dva_sim.live import recorded_lines, supervisor

EARLIER = ("there.mcap", "cut.mcap.part", "traces/dva.trace.jsonl", "traces/robot-1.trace.jsonl")
NO_LINES = ("", "5\n", "{}\n", '{"format": 99}\n')


def live(words):
    command(f"live drive-to-event --for 60 {words}")


def keys_of(name):
    make_keys(Path("keys"), ["robot-1", name])


def trace(name):
    list(replay(Path(name)))


WORDS = mistakes(
    live,
    ("--set operator.strategy=oracle", "virtual time"),
    ("--set nonsense", "key=value"),
    ("--set link.delay_ms=1", "'delay_s'?"),
    ("--only nothing", "--only 'nothing' dva, world operator"),
    ("--only operator --number 2 -q", "--number 2: 1 operator"),
    ("--only operator --number 0", "whole 1"),
    ("--operators idle", "simulated scripted"),
    ("--port 70000", "whole 0 64999"),
    *((f"--dva {dva}", "HOST:PORT") for dva in ("a:b:c", "foo", "foo:", "''")),
    *((f"--dva {dva}", "HOST:PORT") for dva in ("127.0.0.1", "127.0.0.1:x", ":5600")),
    ("--dva 127.0.0.1:65535", "1 65534"),
    ("--for -1", "--for '-1' above 0"),
    ("--for nan", "--for 'nan' above 0"),
    ("--set robot.count=900", "--set robot.count=900: 'caparica' 2"),
    ("--only world --set robot.count=900", "--set robot.count=900: 'caparica'"),
    ("--record /dev/null", ".mcap, 'null';"),
    ("--record run.mcp", ".mcap, 'run.mcp';"),
    ("--record no/run.mcap", "folder 'no'"),
    ("--record there.mcap", "there.mcap --overwrite"),
    ("--record cut.mcap", "cut.mcap.part dva-sim replay cut.mcap.part"),
    ("--record traces", "traces/dva.trace.jsonl 1 more"),
    ("--record traces --only world", "traces/robot-1.trace.jsonl"),
    ("--record /proc/run.mcap", "folder '/proc'"),
    ("--record full.mcap --overwrite", "full.mcap.part: written"),
    ("--record /proc/traces", "/proc/traces: folder"),
    ("--record /proc", "folder '/proc'"),
    ("--link delay=1", "--link delay_s"),
    ("--link none.yaml", "none.yaml"),
    ("--link a.yaml --link b.yaml", "a.yaml b.yaml"),
    ("--link loss=0.1 --only dva", "--only --link"),
    ("--link loss=0.1 --dva 127.0.0.1:5600", "--dva --link"),
    ("--link loss=0.1 --host 127.0.0.2", "--host --link"),
    ("--link loss=0.1 --camera-port 0", "--camera-port --link"),
    ("--link trace_up=none.trace", "none.trace"),
    (
        "--link scenario --set 'link.partitions=[{from_s: 0, for_s: 1}]'",
        "link.partitions link.outages",
    ),
    error=Refused,
)
OTHERS = [
    *mistakes(
        keys_of,
        *((name, f"{name!r} device") for name in ("", "robot", "robot-0", "robot-01", "dva-1")),
        *((name, f"{name!r} device") for name in ("robot-10000", "cat-1", "70:1a:04:f9:81:d6")),
    ),
    *mistakes(
        of_file(trace, "foreign"),
        *((data, "foreign:1:") for data in (b"", b"\n\n", b"What?\n", b"\xff\xfe\x00\x01")),
        *((data, "foreign:1:") for data in (b"5\n", b"[]\n", b"[" * 100_000, b"robot: 1\n")),
        (b'{"robot": "robot-1"}\n', "foreign:1:"),
    ),
    *mistakes(trace, ("none", "none: read")),
    *(
        case
        for read in (lambda name: recorded_lines.record(Path(name), Path("made")), dva_sim.replay)
        for case in mistakes(
            of_file(read, "run.mcap.part"),
            *(
                (data, "run.mcap.part: no lines")
                for data in ("", "5\n", "{}\n", '{"format": 99}\n')
            ),
        )
    ),
]


@pytest.mark.system
@each_mistake(WORDS)
def test_a_mistake_in_words_ends_in_one_line_before_anything_is_started(
    tmp_path, monkeypatch, act, error, names
):
    monkeypatch.setattr(supervisor, "Child", lambda *_, **__: pytest.fail("started"))
    (tmp_path / "traces").mkdir()
    (tmp_path / "a.yaml").write_text("delay_s: 0.1\n")
    (tmp_path / "full.mcap.part").symlink_to("/dev/full")
    for name in EARLIER:
        (tmp_path / name).write_text("of an earlier run")
    check_mistake(tmp_path, act, error, names)
    assert {(tmp_path / name).read_text() for name in EARLIER} == {"of an earlier run"}


@each_mistake(OTHERS)
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
    assert not (tmp_path / "keys").exists()
