"""Entry point of a run's process: first the namespaces, then everything else.

A user namespace is refused to a process with several threads, and numerical libraries start
some when they are imported; so this module imports none before the namespaces are made.
"""

from __future__ import annotations

import json
import os
import sys

from dva_sim.network.emulator.linux_calls import become_owner, die_with_parent


def main() -> None:
    """Read a job from standard input, print its outcome.

    The one argument is the id of the process that waits for it: it may be gone by now.
    """
    line = sys.stdin.readline()
    job = json.loads(line)
    os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"
    link_kind = job["link"]
    problem = ""
    if link_kind != "proxy":
        try:
            link_kind = become_owner(job["rootless"])
        except OSError as error:
            problem = error.strerror or str(error)
    die_with_parent(int(sys.argv[1]))

    from dva_sim.validation.network.real_side.cell import (  # late: start-up
        EmulatedCell,
        EmulatedJob,
        EmulatedOutcome,
    )

    outcome = (
        EmulatedOutcome(problem=problem)
        if problem
        else EmulatedCell(EmulatedJob.from_json(line), link_kind).play()
    )
    print(outcome.to_json(), flush=True)


if __name__ == "__main__":
    main()
