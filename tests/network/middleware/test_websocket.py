"""A WebSocket's ends take nothing where nobody is and where nobody reads."""

import threading
import time
from contextlib import contextmanager

from helpers.processes.patience import PATIENCE_S, becomes

from dva_sim.network.middleware import Rendezvous, load_transport
from dva_sim.serving.listening import listen


def free_port():
    with listen("127.0.0.1", 0) as sock:
        return sock.getsockname()[1]


@contextmanager
def serving(end):
    """Let an end do its part beside this thread."""
    over = threading.Event()

    def serve():
        while not over.is_set():
            end.serve(time.monotonic() + 0.01)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def test_an_end_takes_nothing_where_nobody_is_or_reads(tmp_path):
    deadline = time.monotonic() + PATIENCE_S
    place = Rendezvous("127.0.0.1", "127.0.0.1", free_port(), tmp_path, deadline)
    make = load_transport("websocket", {})
    far = make().far(place, lambda data: None)
    assert far.send(b"picture") is False
    with serving(far):
        near = make().near(place, lambda data: None)

    def is_refused():
        near.serve(time.monotonic())
        return not near.send(b"x" * 200_000)

    assert becomes(is_refused)
    with serving(far):
        near.close()
    far.close()
