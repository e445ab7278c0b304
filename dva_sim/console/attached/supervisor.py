"""A console at a DVA that runs elsewhere, from its start to its end."""

from __future__ import annotations

from contextlib import suppress

from dva_sim.console.attached.actions import AttachedActions
from dva_sim.console.attached.links import over_sockets
from dva_sim.console.attached.options import check
from dva_sim.console.attached.pages import AttachedPages
from dva_sim.console.attached.piped_bench import PipedBench
from dva_sim.console.attached.system import AttachedSystem
from dva_sim.console.audit.audit_keeper import auditing
from dva_sim.console.driving.seating import leave_seats
from dva_sim.console.pages.processes import ConsoleProcesses, Say
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.process import ending_when_asked
from dva_sim.options.runs import ConsoleOptions
from dva_sim.serving.processes import ChildFailed


def attach(
    options: ConsoleOptions, say: Say, bench: PipedBench | None = None, own: str | None = None
) -> None:
    """Show what runs at a DVA until Ctrl-C, SIGTERM, SIGHUP, or the end of the web process.

    Args:
        options: Addresses of the DVA and of the page.
        say: Prints a line.
        bench: Bench on which the DVA runs; None: it runs elsewhere.
        own: Id of the console's own device; default: that of a key, or a random one.

    Raises:
        ConfigError: address, keys, site or audit log are not as they should be.
        NetworkError: no port can be had.
        ChildFailed: the web process could not begin, or has ended by itself.
    """
    check(options)
    system = AttachedSystem(options, over_sockets(options, own), bench)
    processes = ConsoleProcesses(options, say)
    about = {"dva": options.dva, "scenario": options.scenario}
    try:
        with auditing(options.audit, system.clock, about, say) as audit:
            _show(AttachedPages(system, audit), processes, say, bench)
    finally:
        processes.end()
        with suppress(DvaSimError):
            system.close()
    if processes.failed:
        raise ChildFailed(processes.failed)


def _show(
    pages: AttachedPages, processes: ConsoleProcesses, say: Say, bench: PipedBench | None
) -> None:
    system = pages.system
    with ending_when_asked(system.clock, supervised=False) as ending:
        if bench is not None:
            bench.follow(system.clock, system.move)
        path = pages.audited.keeper.path
        processes.start(pages, AttachedActions(pages).take, audit=path)
        if bench is None:
            say(f"Attached to: {system.dva}")
        if not ending.is_asked:
            system.clock.go()
            system.clock.run()
        leave_seats(pages.driven.seating, system.clock)
        pages.tell({"k": "bye", "t": system.now_ms, "why": "the console was ended"})
