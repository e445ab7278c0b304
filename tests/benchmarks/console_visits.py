"""A console, the processes it consists of, and a browser with probes in its pages."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from helpers.processes.patience import PATIENCE_S, becomes
from playwright.sync_api import Browser, Page

PROGRAM = ("-m", "dva_sim.cli", "console", "--no-open", "--port", "0")
ADDRESS = r"^Console: +(\S+)\n()"
ADDRESSES = r"^Console: +(\S+)\n.*^Phone: \S+token=(\S+)$"
TICK_S = 1 / os.sysconf("SC_CLK_TCK")

# What a page does is noted: keys, what it sends and is told, and which input a robot obeys when.
PROBES = """
window.probe = {frames: 0, bytes: 0, key: 0, sent: new Map(), delays: []};
addEventListener('keydown', e => { probe.key = performance.timeOrigin + e.timeStamp; }, true);
const count = () => { probe.frames += 1; requestAnimationFrame(count); };
requestAnimationFrame(count);
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) {
  const line = JSON.parse(text);
  if (line.do === 'input' && probe.key) { probe.sent.set(line.n, probe.key); probe.key = 0; }
  return send.call(this, text);
};
const Usual = WebSocket;
window.WebSocket = class extends Usual {
  constructor(...words) {
    super(...words);
    this.addEventListener('message', ({data}) => {
      probe.bytes += data.length;
      const obeyed = data.includes('"input"') && JSON.parse(data).drives?.[0]?.input;
      if (!obeyed || !probe.sent.has(obeyed.n)) return;
      probe.delays.push(obeyed.at_ms - probe.sent.get(obeyed.n));
      probe.sent.delete(obeyed.n);
    });
  }
};
"""


class Console(NamedTuple):
    """A console that runs.

    Attributes:
        address: With the token for driving.
        process: The world's.
        phones: The token of phones, if it has an address for them.
    """

    address: str
    process: subprocess.Popen[bytes]
    phones: str

    @property
    def place(self) -> str:
        """Host and port."""
        return self.address.removeprefix("http://").partition("/")[0]

    def cpu_s(self) -> dict[str, float]:
        """CPU seconds of the world and of the processes beside it, so far."""
        found = {"world": _cpu_s(self.process.pid)}
        for pid in _children(self.process.pid):
            words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
            found[words[2].rpartition(".")[2]] = _cpu_s(pid)
        return found


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * TICK_S


def _children(pid: int) -> list[int]:
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(number) for number in text.split()]


@contextmanager
def console(folder: Path, *words: str) -> Iterator[Console]:
    """A console from its first word until it is not needed any more."""
    out = folder / "console.out"
    environment = {**os.environ, "DVA_SIM_NO_BROWSER": "1", "XDG_DATA_HOME": str(folder)}
    with out.open("wb") as file:
        command = [sys.executable, *PROGRAM, *words]
        process = subprocess.Popen(command, stdout=file, stderr=file, env=environment)
    try:
        wanted = re.compile(ADDRESSES if "--phones" in words else ADDRESS, re.M | re.S)
        assert becomes(lambda: wanted.search(out.read_text()) or process.poll() is not None)
        found = wanted.search(out.read_text())
        assert found is not None, out.read_text()
        yield Console(found[1], process, found[2])
    finally:
        process.terminate()
        process.wait(PATIENCE_S)


def visit(browser: Browser, address: str, **options: Any) -> Page:
    """A page with probes."""
    size: Any = {"width": 1280, "height": 800}
    page = browser.new_context(viewport=size, **options).new_page()
    page.set_default_timeout(1000 * PATIENCE_S)
    page.add_init_script(PROBES)
    page.goto(address)
    return page


def load() -> str:
    """Load of the machine, in words."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
