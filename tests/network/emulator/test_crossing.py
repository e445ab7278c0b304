"""Ways of this machine's programs across an emulated link."""

import socket
import time
from contextlib import closing
from functools import partial

import pytest
from helpers.network.emulated_link import need_link
from helpers.processes.patience import PATIENCE_S

from dva_sim.network.emulator import crossing
from dva_sim.network.emulator.crossing import CrossedLink
from dva_sim.network.emulator.forwarder import FAR, NEAR
from dva_sim.network.emulator.process import LinkProcess
from dva_sim.network.link import LinkConfig

pytestmark = pytest.mark.system
EACH_WAY = 0.1  # [s]


def listener(link: CrossedLink, number: int) -> socket.socket:
    made = socket.socket(socket.AF_UNIX)
    made.settimeout(PATIENCE_S)
    made.bind(str(link.place(number)))
    made.listen()
    return made


def connected(link: CrossedLink, end: str, number: int) -> socket.socket:
    made = socket.socket(socket.AF_UNIX)
    made.settimeout(PATIENCE_S)
    made.connect(str(link.way(end, number)))
    return made


@pytest.fixture(params=[False, True], ids=["root or not", "user namespace"])
def link(request, monkeypatch):
    need_link(rootless=request.param)
    monkeypatch.setattr(crossing, "LinkProcess", partial(LinkProcess, rootless=request.param))
    with closing(CrossedLink(LinkConfig(delay_s=EACH_WAY), 1)) as made:
        yield made


def test_bytes_take_their_time_either_way_and_all_of_them_come(link):
    data = bytes(range(256)) * 1000
    for number, end in enumerate((NEAR, FAR), 1):
        with listener(link, number) as there, connected(link, end, number) as here:
            start = time.monotonic()
            here.sendall(b"?")
            peer, _ = there.accept()
            with peer:
                assert peer.recv(1) == b"?"
                assert time.monotonic() - start >= 2 * EACH_WAY  # a connection, and the byte
                start = time.monotonic()
                peer.sendall(data)
                peer.shutdown(socket.SHUT_WR)
                got = b"".join(iter(lambda here=here: here.recv(1 << 16), b""))
                assert got == data
                assert time.monotonic() - start >= EACH_WAY
    report = link.report()
    assert report is not None
    assert report.up.passed_packets > 100


def test_where_nobody_listens_a_connection_is_closed(link):
    with connected(link, NEAR, 9) as here:
        assert here.recv(1) == b""


def test_nothing_is_left_of_it(link):
    folder = link.place(1).parent
    assert folder.exists()
    link.close()
    assert not folder.exists()
    assert link.has_ended
