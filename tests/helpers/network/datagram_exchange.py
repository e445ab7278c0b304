"""Exchange numbered datagrams with the other end of an emulated link, and keep what arrived.

Both ends run this file: `datagram_exchange.py END COUNT SIZE INTERVAL WAIT`. The near end begins
when both listen, which files in the working folder show, and each waits for the last ones to come.
"""

import json
import os
import socket
import sys
import time
from pathlib import Path

PORT = 5000
HEADERS_BYTES = 28


def main(end: str, count: int, size: int, interval: float, wait: float) -> None:
    """Send and receive, then write `END.json`: number, time sent and time received of each."""
    other = {"near": "far", "far": "near"}[end]
    addresses = {name: os.environ[f"DVA_LINK_{name.upper()}"] for name in (end, other)}
    arrived = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plug:
        plug.bind((addresses[end], PORT))
        Path(f"{end}.listens").touch()
        while not Path(f"{other}.listens").exists():
            time.sleep(0.005)
        start = time.monotonic()
        for number in range(count):
            plug.settimeout(0.0)
            time.sleep(max(0.0, start + number * interval - time.monotonic()))
            payload = f"{number} {time.monotonic()!r} ".encode().ljust(size - HEADERS_BYTES, b".")
            plug.sendto(payload, (addresses[other], PORT))
        last = time.monotonic() + wait
        while (left := last - time.monotonic()) > 0:
            plug.settimeout(left)
            try:
                number, sent, _ = plug.recv(2000).split(b" ")
            except TimeoutError:
                break
            arrived.append((int(number), float(sent), time.monotonic()))
    Path(f"{end}.json").write_text(json.dumps(arrived))


if __name__ == "__main__":
    end, *numbers = sys.argv[1:]
    count, size, interval, wait = map(float, numbers)
    main(end, int(count), int(size), interval, wait)
