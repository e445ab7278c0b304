"""A console at a DVA that runs elsewhere, from its start to its end."""

from __future__ import annotations

from contextlib import suppress

from dva_sim.console.audit.audit_keeper import auditing
from dva_sim.console.bench import NOT_HERE
from dva_sim.console.desk.console_actions import ConsoleActions
from dva_sim.console.driving.seating import leave_seats
from dva_sim.console.pages.processes import ConsoleProcesses, Say
from dva_sim.console.remote.links import over_sockets
from dva_sim.console.remote.options import check
from dva_sim.console.remote.piped_bench import PipedBench
from dva_sim.console.remote.remote_pages import RemotePages
from dva_sim.console.wire.actions import ActionPlace
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
    links = over_sockets(options, own)
    processes = ConsoleProcesses(options, say)
    about = {"dva": options.dva, "scenario": options.scenario}
    pages = None
    try:
        with auditing(options.audit, links.clock, about, say) as audit:
            pages = RemotePages(options, links, audit, bench)
            _show(pages, processes, say, bench)
    finally:
        processes.end()
        with suppress(DvaSimError):
            links.close() if pages is None else pages.close()
    if processes.failed:
        raise ChildFailed(processes.failed)


def _show(
    pages: RemotePages, processes: ConsoleProcesses, say: Say, bench: PipedBench | None
) -> None:
    system = pages.system
    with ending_when_asked(system.clock, supervised=False) as ending:
        if bench is not None:
            bench.follow(system.clock, system.move)
        actions = ConsoleActions(pages, ActionPlace.REMOTE, NOT_HERE)
        processes.start(pages, actions.take, audit=pages.audited.keeper.path)
        if bench is None:
            say(f"Attached to: {system.dva}")
        if not ending.is_asked:
            system.clock.go()
            system.clock.run()
        leave_seats(pages.seating, system.clock)
        pages.tell({"k": "bye", "t": system.now_ms, "why": "the console was ended"})
