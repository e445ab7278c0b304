"""Listener that prints how long the DVA has been silent.

Run it with the address of the DVA: `python heartbeats.py 127.0.0.1:5600`.
"""

import sys
import time

import zmq
from client import DVA, field


def listen(address, topic):
    """Return a socket that gets what the DVA at that address publishes on a topic."""
    socket = zmq.Context.instance().socket(zmq.SUB)
    # Without probes a DVA whose machine lost its power and restarted would stay silent.
    socket.setsockopt(zmq.TCP_KEEPALIVE, 1)
    socket.setsockopt(zmq.TCP_KEEPALIVE_IDLE, 2)
    socket.setsockopt(zmq.TCP_KEEPALIVE_INTVL, 2)
    host, port = address.split(":")
    socket.connect(f"tcp://{host}:{int(port) + 1}")
    socket.subscribe(topic)
    return socket


if __name__ == "__main__":
    beats, heard = listen(sys.argv[1], "heartbeat|"), time.monotonic()
    while True:
        if beats.poll(1000):
            _, message = beats.recv_multipart()
            if field("SourceID", message.decode()) == DVA:
                heard = time.monotonic()
        print(f"silent for {time.monotonic() - heard:.1f} s", flush=True)
