"""In order, exactly once, whatever the link does; and the same again from the same seed."""

import numpy as np
import pytest
from helpers.network.scripted_tcp import EXACT, options

from dva_sim.kernel.clock import Clock
from dva_sim.network.tcp import TcpConnection, TcpOptions


class RoughLink:
    """Loses, delays and lets overtake."""

    def __init__(self, rng, loss, delay, spread):
        self.rng, self.loss, self.delay, self.spread = rng, loss, delay, spread

    def carry(self, now, size):
        lost, late = self.rng.random(2)
        return None if lost < self.loss else now + self.delay + late * self.spread


def talk(seed, loss, spread, opener=EXACT, seconds=20.0):
    """Both ends write as they like; returns what was written and read, and when."""
    rng = np.random.default_rng(seed)
    clock = Clock()
    links = [RoughLink(np.random.default_rng([seed, n]), loss, 0.03, spread) for n in (1, 2)]
    connection = TcpConnection(clock, *links, opener, EXACT)
    ends = {"opener": connection.opener, "peer": connection.peer}
    written, log = {"opener": 0, "peer": 0}, []

    def read(name):
        count = ends[name].read(int(rng.integers(1, 100_000)))
        log.append((clock.now, name, count))

    def write(name):
        if clock.now > seconds:
            return False
        written[name] += ends[name].write(int(rng.integers(1, 6000)))
        return True

    for name, end in ends.items():
        end.on_readable = lambda name=name: read(name)
        clock.every(0.05, lambda name=name: write(name))
    connection.open(lambda: None)
    clock.run(seconds + 3000.0)  # with three in ten lost, time-outs double far
    for name in ends:
        read(name)
    return written, log, connection


def read_by(log, name):
    return sum(count for _, reader, count in log if reader == name)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize(("loss", "spread"), [(0.0, 0.0), (0.1, 0.0), (0.05, 0.08), (0.3, 0.02)])
def test_everything_written_is_read_once_in_both_directions(seed, loss, spread):
    written, log, connection = talk(seed, loss, spread, seconds=8.0)
    assert not connection.opener.gone
    assert written["opener"] > 100_000 * (loss < 0.2)
    assert read_by(log, "peer") == written["opener"]
    assert read_by(log, "opener") == written["peer"]
    for end in (connection.opener, connection.peer):
        board = end.sender.board
        assert (board.queue, board.sacked, board.lost, board.resent) == ([], 0, 0, 0)
        assert end.sender.buffer.used == 0


LEFT_OUT = [
    {"rack": False},
    {"tail_probe": False},
    {"rtt_variance": False},
    {"congestion_window": False},
    {"delayed_ack": 0.0},
    {"collapse": False},
    {"undo": False},
    {"hystart": False},
    {"idle_restart": False},
    {"handshake": False},
    {"congestion": "reno"},
    {"send_buffer": 4096},
    {"receive_buffer": 4096},
    {"tick": 0.004},
]


@pytest.mark.parametrize("change", LEFT_OUT, ids=[next(iter(change)) for change in LEFT_OUT])
def test_whatever_is_left_out_everything_still_arrives(change):
    written, log, _ = talk(3, 0.1, 0.02, options(**change))
    assert read_by(log, "peer") == written["opener"] > 0


def test_the_same_seed_gives_the_same_run_and_another_does_not():
    assert talk(1, 0.1, 0.02)[:2] == talk(1, 0.1, 0.02)[:2]
    assert talk(1, 0.1, 0.02)[:2] != talk(2, 0.1, 0.02)[:2]


def test_on_a_line_it_takes_the_whole_rate():
    class Line:
        def __init__(self):
            self.free_at = 0.0

        def carry(self, now, size):
            if self.free_at - now > 0.4:
                return None  # 50 kB of queue at 1 Mbit/s
            self.free_at = max(now, self.free_at) + size * 8 / 1e6
            return self.free_at + 0.03

    clock = Clock()
    connection = TcpConnection(clock, Line(), Line(), TcpOptions(), TcpOptions())
    got = []
    connection.peer.on_readable = lambda: got.append(connection.peer.read(1 << 30))

    def fill():
        while connection.opener.write(65_536) == 65_536:
            pass

    connection.opener.on_writable = fill
    connection.open(fill)
    clock.run(60.0)
    assert sum(got) * 8 / 60 == pytest.approx(1e6 * 1448 / 1500, rel=0.05)
