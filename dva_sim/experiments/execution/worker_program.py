"""A process of this machine that does what another one asks: its own end.

It is a program of its own, so it neither knows nor runs the script that started a study. Until it
has been sent where modules lie, it loads Python's own alone.
"""

import os
import pickle
import select
import socket
import sys
import threading
from contextlib import suppress


def serve(number: int) -> None:
    """Run tasks from a socket until the other end closes it."""
    gone = suppress(EOFError, ConnectionError, MemoryError)  # what was not sent is lost with it
    with gone, socket.socket(fileno=number) as channel, channel.makefile("rwb") as file:
        threading.Thread(target=_end_with_parent, args=(number,), daemon=True).start()
        sys.path[:] = pickle.load(file)
        while True:
            answer = pickle.load(file)()
            file.write(pickle.dumps(answer))
            file.flush()


def _end_with_parent(number: int) -> None:
    """End whatever is being done with the parent: nobody waits for it any more."""
    hang_up = select.poll()
    hang_up.register(number, 0)
    hang_up.poll()
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    os._exit(0)


if __name__ == "__main__":
    serve(int(sys.argv[1]))
