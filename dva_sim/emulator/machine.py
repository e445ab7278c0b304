"""The machine that a measurement was made on: what a reader needs to judge it, and nothing else."""

from __future__ import annotations

import gzip
import os
import platform
import re
from contextlib import suppress
from pathlib import Path

import zmq

Machine = dict[str, str | int | bool | None]


def describe_machine(link: str, way: str, realtime: bool) -> Machine:
    """Versions, clock and processor; no names of machines, people or folders.

    Args:
        link: `packets` or `proxy`.
        way: How the namespaces were made.
        realtime: Whether real-time priority was granted.
    """
    return {
        "kernel": f"{platform.system()} {platform.release()}",
        "timer_hz": _timer_hz(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "pyzmq": zmq.pyzmq_version(),
        "libzmq": zmq.zmq_version(),
        "link": link,
        "namespaces": way,
        "realtime": realtime,
    }


def _timer_hz() -> int | None:
    """The kernel's timer frequency [Hz], where its configuration can be read."""
    text = ""
    with suppress(OSError):
        text = gzip.decompress(Path("/proc/config.gz").read_bytes()).decode()
    with suppress(OSError):
        text = text or Path(f"/boot/config-{platform.release()}").read_text(encoding="utf-8")
    found = re.search(r"^CONFIG_HZ=(\d+)$", text, re.MULTILINE)
    return int(found[1]) if found else None


def _processor() -> str | None:
    with suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        found = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
        return found[1] if found else None
    return None
