"""`dva-sim link`: real commands in real namespaces, and each key of a link in each direction.

Packets may be late on a busy machine, but never early, and the same ones are lost every time.
"""

import csv
import json
import os
import shlex
import signal
import sys
from contextlib import suppress
from pathlib import Path
from urllib.request import urlopen

import pytest
from helpers.network import datagram_exchange
from helpers.network.emulated_link import need_link
from helpers.network.free_ports import free_port
from helpers.processes.patience import PATIENCE_S, becomes
from helpers.processes.programs import Programs

from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.emulator.process import LinkProcess
from dva_sim.network.link import LinkConfig

pytestmark = pytest.mark.system

ABOUT = """
echo $DVA_LINK_NEAR $DVA_LINK_FAR $(id -u)
echo complaint >&2
cat
python3 -c 'import socket
print(*sorted(name for _, name in socket.if_nameindex() if name in ("lo", "link")))
with socket.create_server(("127.0.0.1", 0)) as near:
    socket.create_connection(near.getsockname()).close()'
exit 7
"""

Arrived = list[tuple[int, float, float]]


def exchange(
    programs: Programs, folder: Path, *changes: str, count: int, size: int = 100, wait: float = 0.3
) -> tuple[Arrived, Arrived, list[dict[str, str]]]:
    """Datagrams that arrived at the far end and at the near one, and the table of counts."""
    for left in ("near.listens", "far.listens", "done", "counts.csv"):
        (folder / left).unlink(missing_ok=True)
    words = [f"--set={change}" for change in changes]
    numbers = f"{count} {size} 0.0005 {wait}"
    call = f"{shlex.quote(sys.executable)} {shlex.quote(datagram_exchange.__file__)}"
    for end in ("near", "far"):
        words += [f"--{end}", f"{call} {end} {numbers}{'; touch done' * (end == 'far')}"]
    words[-3] += "; while [ ! -e done ]; do sleep 0.01; done"
    program = programs.start("link", *words, "-o", "counts.csv")
    assert program.ends() == 0, program.complained
    up, down = (json.loads((folder / f"{end}.json").read_text()) for end in ("far", "near"))
    with (folder / "counts.csv").open(newline="") as file:
        return up, down, list(csv.DictReader(file))


def numbers(arrived: Arrived) -> list[int]:
    return [number for number, _, _ in arrived]


def test_commands_have_their_own_network_their_streams_and_the_exit_code(programs):
    program = programs.start("link", "--near", ABOUT, "--far", "sleep 600")
    assert program.ends() == 7
    assert program.output == f"10.77.0.1 10.77.0.2 {os.getuid()}\nlink lo\n"
    assert program.complained[0] == "complaint"
    assert [line.split(":")[0] for line in program.complained[1:]] == [
        *("near to far", "far to near", "emulator late by")
    ]


def test_delay_jitter_order_loss_and_bursts_hold_for_each_direction(programs, tmp_path):
    """The packets that are lost one by one are those of the model with the same seed."""
    there = ("up.delay_s=0.15", "up.loss=0.5", "up.bursts={mean_s: 0.005}")
    back = ("down.delay_s=0.2", "down.jitter_s=0.2", "down.loss=0.5", "down.reorder=true")
    up, down, (_, counts) = exchange(programs, tmp_path, *there, *back, count=200, wait=0.6)
    assert 0 < len(up) < 200
    assert numbers(up) == sorted(numbers(up))
    assert min(came - sent for _, sent, came in up) >= 0.15
    assert min(came - sent for _, sent, came in down) < 0.2
    link = links_of(LinkConfig.model_validate({"loss": 0.5}), 1)[1]
    kept = [number for number in range(200) if link.carry(0.001 * number, 100) is not None]
    assert sorted(numbers(down)) == kept != numbers(down)
    assert int(counts["lost_by_chance"]) == 200 - len(kept)
    assert int(counts["passed_packets"]) == len(kept)


def test_rate_queue_and_a_recorded_link_hold_for_each_direction(programs, tmp_path):
    """A thousand bytes at 32 kbit/s take 0.25 s, and two wait. The recorded link lets 1500 by."""
    slow = ["up.rate_bps=32e3", "up.queue_packets=2", "trace_down=slow.trace"]
    (tmp_path / "slow.trace").write_text("100\n")
    up, down, (there, back) = exchange(programs, tmp_path, *slow, count=8, size=1000, wait=0.8)
    assert numbers(up)[:1] == [0]
    assert int(there["lost_in_queue"]) >= 1
    assert all(came - sent >= 0.25 for _, sent, came in up)
    assert (len(down), back["lost_in_queue"]) == (8, "0")
    assert down[-1][2] - down[0][1] >= 0.1 * (8 * 1000 / 1500 - 1)


def test_outages_and_partitions_hold_for_each_direction(programs, tmp_path):
    outage = "outages=[{from_s: 0, for_s: 3600, direction: up}]"
    parted = "partitions=[{from_s: 0, for_s: 3600, source: far, destination: near}]"
    up, down, (there, _) = exchange(programs, tmp_path, outage, count=20)
    assert (up, numbers(down), there["lost_in_outage"]) == ([], list(range(20)), "20")
    up, down, (there, back) = exchange(programs, tmp_path, parted, count=20)
    assert (numbers(up), down, back["lost_in_outage"]) == (list(range(20)), [], "20")


def test_a_link_needs_no_root_where_user_namespaces_are_allowed():
    need_link(rootless=True)
    with LinkProcess(LinkConfig(), 1, rootless=True) as link:
        found = link.start("near", ["sh", "-c", "cat /proc/self/uid_map; id -u"], stdout=-1)
        output = found.communicate()[0].decode().split()
    assert output[-1] == str(os.getuid())


def test_a_published_port_leads_to_the_near_end_past_the_link(programs, tmp_path):
    """An hour of outage, and what the page is asked is answered all the same."""
    port = free_port()
    serve = f"exec python3 -m http.server {port} --bind 127.0.0.1"
    outage = "outages=[{from_s: 0, for_s: 3600}]"
    (tmp_path / "page").write_text("here")
    program = programs.start(
        "link", "--publish", str(port), "--set", outage, "--near", serve, "--far", "sleep 600"
    )
    page = f"http://127.0.0.1:{port}/page"
    assert becomes(lambda: answer(page) == b"here")
    program.send(signal.SIGTERM)
    assert program.ends() == 143
    assert programs.processes() == {}


def answer(page: str) -> bytes:
    """Content of a page; empty while nobody answers."""
    with suppress(OSError), urlopen(page, timeout=PATIENCE_S) as reply:
        return bytes(reply.read())
    return b""
