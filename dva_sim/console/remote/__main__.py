"""The page of a DVA as a process beside it, started by `PageBeside` with one argument of JSON."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from pathlib import Path

from dva_sim.console.remote.piped_bench import PLAIN, PipedBench
from dva_sim.console.remote.supervisor import attach
from dva_sim.kernel.errors import DvaSimError, error_line
from dva_sim.options.runs import ConsoleOptions
from dva_sim.serving.pipes import LinePipe


def main(words: list[str]) -> int:
    """Serve the page until the DVA's process ends; its exit code."""
    parser = argparse.ArgumentParser(prog="dva_sim.console.remote", description=__doc__)
    parser.add_argument("--fd", type=int, required=True, help="socket to the DVA's process")
    parser.add_argument("argument", help="options of the page, as JSON")
    parsed = parser.parse_args(words)
    job = json.loads(parsed.argument)
    files = {name: Path(file) for name, file in job["files"].items()}
    options = ConsoleOptions(**job["options"] | files)
    pipe = LinePipe(parsed.fd, PLAIN)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the DVA's process says when it is over
    bench = PipedBench(pipe, str(options.dva))
    try:
        attach(options, bench.say, bench, job["own"])
    except DvaSimError as error:
        print(error_line(error), file=sys.stderr)
        return error.exit_code
    finally:
        pipe.close()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
