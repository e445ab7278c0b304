"""The process that draws camera pictures: `python -m dva_sim.console.pages.pictures`.

One socket leads to the simulation, the other one to the web process (`dva_sim.cameras.painting`).
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Sequence

from dva_sim.cameras.painting import NICENESS, run
from dva_sim.serving.pipes import PipeEnd


def main(words: Sequence[str] | None = None) -> int:
    """Draw until the simulation has ended."""
    parser = argparse.ArgumentParser(prog="dva_sim.console.pages.pictures", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="socket to the simulation")
    parser.add_argument("--web-fd", type=int, required=True, help="socket to the web process")
    options = parser.parse_args(words)
    # Ctrl-C may reach all processes; the simulation says when it is over.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICENESS)
    run(PipeEnd(options.fd), PipeEnd(options.web_fd))
    return 0


if __name__ == "__main__":
    sys.exit(main())
