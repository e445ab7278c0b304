"""A part of a live run as a process, started by the supervisor with one argument of JSON."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from dva_sim.kernel.errors import DvaSimError, error_line
from dva_sim.live.options import PATHS
from dva_sim.live.process import run_part
from dva_sim.options.runs import LiveOptions
from dva_sim.serving.open_port import OpenPort
from dva_sim.serving.pipes import PipeEnd


def main(argument: str) -> int:
    """Run the part that the supervisor requests; return the exit code."""
    arguments = json.loads(argument)
    options = arguments["options"]
    for key in PATHS:
        options[key] = None if options[key] is None else Path(options[key])
    reports = PipeEnd(
        sys.stdout.fileno()
    )  # never blocks: a stalled supervisor must not stop robots
    try:
        run_part(
            arguments["part"],
            LiveOptions(**options),
            lambda report: reports.offer(json.dumps(vars(report)).encode() + b"\n"),
            arguments["number"],
            arguments["epoch"],
            supervised=True,
            outlet=arguments["outlet"],
            door=OpenPort.received(*arguments["door"]) if arguments["door"] else None,
        )
    except DvaSimError as error:
        print(error_line(error), file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
