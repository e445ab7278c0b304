"""Mistakes in links, logs, traces, keys, patterns, tables, transports and their options."""

import dataclasses
import gzip
import math
from functools import partial
from pathlib import Path

from helpers.mistakes import check_mistake, each_mistake, mistakes, of_file
from helpers.network.links import GAMMA, NORMAL, SHIFTED, link

from dva_sim.kernel.config import validate
from dva_sim.kernel.yaml_files import load_yaml
from dva_sim.network.keys import KeyRing, create_keys
from dva_sim.network.link import LinkConfig, check_partitions, read_trace
from dva_sim.network.link.files import read_link
from dva_sim.network.middleware import load_transport
from dva_sim.network.pattern_runs import Condition
from dva_sim.network.patterns import load_pattern
from dva_sim.network.tcp import TcpOptions
from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full import rehearse

PING = "PING h (1) 56(84) bytes\n"
REPLY = "[1700000001.04] 64 bytes from h: icmp_seq=1 ttl=57 time=40 ms\n"
EXAMPLE = "acknowledged_pub_sub.py:AcknowledgedPubSub"
HEAD = "middleware,link,made_s,arrived_s\n"
TABLE = f"{HEAD}direct,far,0.5,0.6\ndirect,far,0.8,\n".encode()


def link_of(config):
    validate(LinkConfig, config)


def outages(*given):
    link_of({"outages": [{"from_s": 1, **dict(given)}]})


def law_of_file(name):
    link(delay_law={"law": "empirical", "file": name}, delay_s=0.1)


def log_of_file(name):
    link(delay_log=name)


def link_of_file(name):
    read_link(name, {}, ("near", "far"))


def run_of_file(name):
    of_file(str, "bad.log")("1 2\nx 3\n")
    rehearse(scenarios.build(load_yaml(name)), seed=1)


def scenario_of_file(name):
    scenarios.build(scenarios.load(name))


def partition(source, known):
    config = LinkConfig(partitions=[{"source": source, "from_s": 3, "for_s": 4}])  # type: ignore[list-item]
    check_partitions(config.partitions, known)


def made_keys(*ids):
    create_keys(Path("keys"), [ROBOT, GUARD])
    create_keys(Path("keys"), ids)


def unmade_keys(device):
    try:
        create_keys(Path(), ["fine", device])
    finally:
        assert not list(Path().iterdir())


def keys_in(name):
    create_keys(Path(name), [ROBOT])


def key_of(device, folder="keys"):
    made_keys()
    KeyRing(Path(folder)).pair(device)


def ring(file, content):
    made_keys()
    Path("keys/public", file).write_bytes(content)
    KeyRing(Path("keys"))


def congestion(name):
    TcpOptions(congestion=name)


def condition(changed):
    dataclasses.replace(Condition("pub", 10), **changed)


def pattern(name, options):
    load_pattern(name, options)()


def transport(name, options):
    load_transport(name, options)()


def measured(text, options, name="commands.csv"):
    of_file(str, name)(text)
    load_pattern("measured.py:Measured", {"file": name} | options)()


ROBOT, GUARD = "02:00:00:01:00:01", "02:00:00:02:00:01"
KEY = "02-00-00-01-00-01.key"
KEYS = [
    *mistakes(of_file(keys_in, "file"), ("", "file cannot written")),
    *mistakes(made_keys, (ROBOT.replace(":", "-"), "same file")),
    *mistakes(
        unmade_keys,
        *((each, "id") for each in ("", "../robot", "a b", "-", 'x"', "é", "x" * 65, "a\n")),
    ),
    *mistakes(key_of, (ROBOT, "nowhere", "dva-sim keys"), ("robot-9", "public key robot-9")),
    *mistakes(key_of, (ROBOT, ".", "no keys")),
    *mistakes(
        ring,
        (KEY, b"", f'{KEY} id = "..."'),
        (KEY, b'id = "x"\n', f'{KEY} public-key = "..."'),
        (KEY, b'id = "x"\npublic-key = "short"\n', f"{KEY} 40"),
        (KEY, b'id = "x"\npublic-key = "' + b"#" * 40 + b'"\n', f"{KEY} 40"),
        (KEY, b'id = "x"\npublic-key = "' + b"~" * 40 + b'"\n', f"{KEY} 40"),
        (KEY, b"\xff\xfe\x00", f"{KEY} plain text"),
    ),
]

LINKS = [
    *mistakes(
        link_of,
        ({"delay_s": 0.05, "delay_law": NORMAL}, "sd_s 0.02 normal"),
        ({"delay_s": 0.03, "delay_law": GAMMA}, "least_s 0.04 delay_s 0.03"),
        ({"delay_s": 0.04, "delay_law": SHIFTED}, "least_s 0.04 delay_s 0.04"),
        ({"delay_s": 0.1, "up": {"delay_s": 0.05}, "delay_law": NORMAL}, "sd_s delay_s 0.05"),
        ({"delay_s": 0.1, "jitter_s": 0.1, "delay_law": NORMAL}, "jitter_s delay_law exclude"),
        ({"delay_law": NORMAL, "delay_log": "x", "delay_s": 1}, "delay_law delay_log exclude"),
        ({"delay_law": {"law": "empirical"}}, "delays_s file"),
        ({"delay_law": "normal"}, "delay_law: mapping 'normal'"),
        ({"delay_law": {"law": "normal"}}, "missing 'delay_law.sd_s'"),
        ({"delay_law": {"law": "cauchy"}}, "'cauchy' normal, gamma"),
        ({"delay_law": {"law": "gamma", "sd_s": 1, "sdd": 2}}, "unknown 'delay_law.sdd'"),
        ({"up": {"delay": 1}}, "unknown 'up.delay'; 'delay_s'"),
        ({"bursts": {}}, "bursts mean_s mean_packets"),
        ({"bursts": {"mean_s": 1, "mean_packets": 2}}, "bursts either"),
        ({"loss": 0.5, "bursts": {"mean_s": 1, "loss": 0.5}}, "below bursts.loss 0.5"),
        ({"loss": 0.8, "bursts": {"mean_packets": 2}}, "short 0.8: 4"),
        ({"loss": 0.1, "down": {"loss": 0.6}, "bursts": {"mean_s": 1, "loss": 0.5}}, "loss 0.6"),
        ({"partitions": [{"from_s": 1, "for_s": 2, "to": "x"}]}, "unknown 'partitions.0.to'"),
        ({"queue_packets": 0}, "queue_packets: 0"),
        ({"delay_s": 0.1, "jitter_s": 0.2}, "jitter_s 0.2 delay_s 0.1"),
    ),
    *mistakes(
        outages,
        ("missing 'outages.0.for_s'",),
        (("for_s", 2), ("every_s", 2), "for_s 2 below every_s"),
        (("for_s", 2), ("direction", "left"), "up, down both"),
    ),
    *mistakes(partition, ("operator-*", ["dva", "robot-1"], "'operator-*' known: dva, robot-1")),
    *mistakes(congestion, ("vegas", "'vegas' cubic, reno")),
]

FILES = [
    *mistakes(
        of_file(law_of_file, "d.txt"),
        ("10\nfast\n", "d.txt:2:1: [ms], 'fast'"),
        ("10\n-3\n", "d.txt:2:1: 60000 -3"),
        ("# none\n", "d.txt: no delay"),
    ),
    *mistakes(
        of_file(read_trace, "bad.up"),
        ("1\nx\n", "bad.up:2:1: whole millisecond"),
        ("5\n3\n", "bad.up:2:1: 3 5"),
        ("", "bad.up packet"),
        ("0\n", "bad.up packet"),
    ),
    *mistakes(read_trace, ("nowhere.up", "nowhere.up:")),
    *mistakes(
        of_file(log_of_file, "delays.log"),
        ("1 2\n3\n", "delays.log:2:1: time delay '3'"),
        ("1 2\nx 3\n", "delays.log:2:1: time, 'x'"),
        ("1 2\n2 soon\n", "delays.log:2:1: delay [ms], 'soon'"),
        ("1 2\n2 inf\n", "delays.log:2:1: delay [ms], 'inf'"),
        ("1 2\n2 70000\n", "delays.log:2:1: 60000 70000"),
        ("2 2\n1 2\n", "delays.log:2:1: 1 after 2"),
        ("1 2\n", "delays.log two moments"),
        ("1 2\n1 3\n", "delays.log two moments"),
        ("1 -\n2 -\n", "delays.log only lost"),
        ("", "delays.log two moments"),
        (f"{PING}64 bytes from h: icmp_seq=1 ttl=9 time=1 ms\n", "delays.log:2:1: ping"),
        (f"{PING}[1.5] no answer yet for icmp_seq=1\n", "delays.log no reply"),
        (PING + REPLY, "delays.log two moments"),
        (PING + REPLY + PING + REPLY.replace("1700000001", "1700003601"), "two moments"),
        ("time,throughput_mbps\n0,5\n1,6\n", "delays.log:1:1: throughput_mbps link.rate_bps"),
        ("a,b\n0,5\n1,6\n", "delays.log:1:1: a, b time_s,delay_ms"),
        (
            '{"intervals": [{"sum": {"bits_per_second": 5e6}}]}',
            "delays.log:1:1: iperf3 5,000,000 bit/s",
        ),
    ),
    *mistakes(log_of_file, ("no.log", "no.log:")),
    *mistakes(
        of_file(link_of_file, "run.yaml"),
        (
            "model: full\nlink:\n  partitions: [{from_s: 0, for_s: 1, source: robot-1}]\n",
            "run.yaml:3:3 robot-1 near far",
        ),
    ),
    *mistakes(
        of_file(run_of_file, "s.yaml"),
        ("link:\n  delay_law: fast\n", "s.yaml:2:3: link.delay_law: mapping"),
        ("link:\n  outages: [{from_s: 1}]\n", "s.yaml:2:13: missing 'link.outages.0.for_s'"),
        ("link:\n  up: {dely_s: 1}\n", "s.yaml:2:8: unknown 'link.up.dely_s'; 'delay_s'?"),
        ("link:\n  bursts: {mean_s: 1}\n  loss: 2\n", "s.yaml:3:3: link.loss: 0.9"),
        ("link:\n  delay_log: bad.log\n", "bad.log:2:1: time, 'x'"),
        ("link:\n  partitions: [{source: a, from_s: 1, for_s: 1}]\n", "'a' partition"),
    ),
    *mistakes(
        measured,
        (HEAD + "a,x,1,0.9\n", {}, "commands.csv arrived earlier"),
        (HEAD + "a,x,nan,1\n", {}, "commands.csv finite"),
        (HEAD + "a,x,1,inf\n", {}, "commands.csv finite"),
        (HEAD + "a,x,1,2\na,y,1,2\n", {"where": {"middleware": "a"}}, "commands.csv link x y"),
        (HEAD + "a,x,one,2\n", {}, "commands.csv numbers"),
        (HEAD + "a,b,soon,later\n", {}, "commands.csv soon"),
        (HEAD, {}, "commands.csv no command"),
        (TABLE, {"where": {"middleware": "pigeon"}}, "commands.csv pigeon no command"),
        (TABLE, {"where": {"transport": "x"}}, "commands.csv transport"),
        (TABLE, {"window_s": [5, 13]}, "measured"),
        (TABLE, {"window_s": [0.6, 0.5]}, "measured"),
        (TABLE, {"window_s": [0.5]}, "measured"),
        ("made_s\n1\n", {}, "commands.csv arrived_s"),
        ("", {}, "commands.csv made_s arrived_s"),
        (b"\xff" * 9 + TABLE[9:], {}, "commands.csv"),
        (TABLE[:-6], {}, "commands.csv.gz", "commands.csv.gz"),
        (gzip.compress(TABLE)[:-6], {}, "commands.csv.gz", "commands.csv.gz"),
    ),
]

CHOICES = [
    *mistakes(
        pattern,
        ("reqrep", {}, "pattern 'reqrep' unknown; 'req-rep'?"),
        ("mine", {}, "pattern 'mine' mine.py:Mine"),
        ("req-rep", {"window": 3}, "pattern 'req-rep' 'window'; none"),
        (EXAMPLE, {"evry": 3}, "'evry'; 'every'?"),
        (EXAMPLE, {"every": 0}, "'every' 0; whole 1"),
        (EXAMPLE, {"timeout_s": -1}, "'timeout_s' -1; above 0"),
        ("gone.py:Mine", {}, "'gone.py' not found"),
    ),
    *mistakes(
        of_file(scenario_of_file, "one.yaml"),
        ("horizon_s: 60\npattern: reqrep\n", "one.yaml:2: 'reqrep'"),
        (
            f"pattern: {EXAMPLE}\npattern_options:\n  timeout_s: 1\n  every: 0\n",
            "one.yaml:4: 'every' 0;",
        ),
    ),
    *mistakes(
        transport,
        ("zeromq", {"pattern": "push"}, "'push'"),
        ("mqtt", {"qos": 3}, "qos 3"),
        ("mqtt", {"broker": "middle"}, "'middle'"),
        ("zenoh", {"carrier": "quic"}, "'quic'"),
        ("dds", {"depth": 0}, "depth 0"),
        ("upd", {}, "udp"),
        ("udp", {"qos": 1}, "qos"),
    ),
    *mistakes(
        partial(scenarios.build, {}),
        ({"zeromq.high_water_mark": 0}, "zeromq.high_water_mark"),
        ({"zeromq.conflate": "robot"}, "none, publisher, subscriber both"),
        ({"zeromq.sndbuf": 1}, "unknown 'zeromq.sndbuf'"),
        ({"transport": "udp"}, "transport: zeromq datagrams"),
        ({"network_depth": "packet"}, "network_depth: auto, message segment"),
    ),
    *mistakes(
        condition,
        ({"pattern": "push"}, "'push' known: req-rep, pub-sub, pipelined"),
        ({"timeout_ms": 100}, "timeout_ms attempts req-rep,"),
        ({"loss": 0.95}, "loss 0.95 0 0.9"),
        ({"hz": 0}, "hz 0 above"),
        ({"proc_ms": math.inf}, "proc_ms inf finite 0"),
    ),
    *mistakes(Condition.from_row, (Condition("pub", 50).to_row() | {"hwm": "many"}, "hwm 'many'")),
]


@each_mistake([*KEYS, *LINKS, *FILES, *CHOICES])
def test_a_mistake_ends_in_one_line_with_its_names(tmp_path, act, error, names):
    check_mistake(tmp_path, act, error, names)
