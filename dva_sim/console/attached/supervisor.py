"""A console at a DVA that runs elsewhere, from its start to its end."""

from __future__ import annotations

from contextlib import suppress

from dva_sim.console.attached.actions import AttachedActions
from dva_sim.console.attached.options import AttachOptions
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.children import ChildFailed
from dva_sim.console.processes import ConsoleProcesses, Say
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.process import ending_when_asked


def attach(options: AttachOptions, say: Say) -> None:
    """Show what runs at a DVA until Ctrl-C, SIGTERM, or the end of the web process.

    Args:
        options: Where the DVA is, and where the page is to be seen.
        say: Prints a line.

    Raises:
        ConfigError: address, keys or site are not as they should be.
        NetworkError: no port can be had.
        ChildFailed: the web process could not begin, or has ended by itself.
    """
    options.check()
    system, processes = AttachedSystem(options), ConsoleProcesses(options, say)
    try:
        with ending_when_asked(system.clock, supervised=False) as ending:
            processes.start(system, AttachedActions(system).take)
            say(f"Attached to: {options.dva}")
            if not ending.is_asked:
                system.clock.go()
                system.clock.run()
            system.tell({"k": "bye", "t": system.now_ms, "why": "the console was ended"})
    finally:
        processes.end()
        with suppress(DvaSimError):
            system.close()
    if processes.failed:
        raise ChildFailed(processes.failed)
