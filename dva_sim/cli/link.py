"""The command that runs any two programs over an emulated link."""

from __future__ import annotations

import socket
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from dva_sim.cli.options import Quiet
from dva_sim.kernel.errors import ConfigError
from dva_sim.options.forms import (
    MAX_PORT,
    SCENARIOS,
    Changes,
    OptionForm,
    Overwrite,
    RunSeed,
    argument,
    out_form,
)

_FILE = "Keys of a link, or a scenario with a link; default: a fast link."


def link(
    keys: Annotated[str | None, argument(_FILE, "LINK.yaml", *SCENARIOS)] = None,
    near: Annotated[
        str, OptionForm("Command at one end; when it ends, the other is stopped.", metavar="CMD")
    ] = "",
    far: Annotated[str, OptionForm("Command at the other end.", metavar="CMD")] = "",
    publish: Annotated[
        tuple[int, ...],
        OptionForm(
            "Make a port of the near end available on 127.0.0.1 of this computer.",
            metavar="PORT",
            least=1,
            most=MAX_PORT,
            is_repeated=True,
        ),
    ] = (),
    seed: RunSeed = 1,
    set: Changes = (),
    out: Annotated[
        Path | None, out_form("Save the counts: X.csv, or a folder for link.csv.", "PATH")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Run any two programs over a link you choose.

    Each command runs in the shell, in its own network namespace. An emulated link is the only
    network of the two: no internet, no name server and no port of this computer, except for
    published ports at the near end. Only the network is apart: the commands run as you, and
    can read and write your files. Both commands find the addresses of the two ends in
    DVA_LINK_NEAR and DVA_LINK_FAR. Their output is passed through.

    The link has the keys of a scenario's link: delay_s, jitter_s, loss, bursts, rate_bps,
    queue_packets, outages, trace_up and others. `up` holds what is different from near to far,
    `down` from far to near. The same seed drops and delays the same packets, counted from the
    first. Bursts, outages and recordings follow the time since the start.

    The exit code is that of the near command. When it ends, or on Ctrl-C, everything that either
    command started is ended. Standard error then shows how many packets passed, were lost and were
    queued, and how late the emulator itself was. Runs disturbed by the emulator are marked.

    It needs Linux, /dev/net/tun, and root or user namespaces.

    Examples:
        dva-sim link --set delay_s=0.1 --near 'ping $DVA_LINK_FAR' --far 'sleep 9'  # a slow link
        dva-sim link bad.yaml --near ./client.py --far ./server.py -o run.csv  # save the counts
        dva-sim link --set up.loss=0.1 --near ./client.py --far ./server.py  # losses one way
    """
    from dva_sim.cli import link_counts  # late: start-up
    from dva_sim.kernel.config_overrides import parse_changes, set_by  # late: start-up
    from dva_sim.network.emulator.forwarder import FAR, NEAR, links_of  # late: start-up
    from dva_sim.network.emulator.pair import run_pair  # late: start-up
    from dva_sim.network.emulator.process import LinkProcess  # late: start-up
    from dva_sim.network.link.files import read_link  # late: start-up

    for name, command in (("--near", near), ("--far", far)):
        if not command.strip():
            raise ConfigError(f"{name} needs a command, such as {name} 'ping $DVA_LINK_NEAR'")
    try:
        config = read_link(keys, parse_changes(set), (NEAR, FAR))
    except ConfigError as error:
        raise set_by(set, error) from None
    links_of(config, seed)  # files that the link names are read before anything starts
    files = link_counts.files_of(out, overwrite)
    with ExitStack() as at_end:
        ports = [at_end.enter_context(_listening(port)) for port in publish]
        joined = at_end.enter_context(LinkProcess(config, seed))
        outcome = run_pair(joined, near, far, link_counts.tell, ports)
    if not quiet:
        for line in link_counts.in_words(outcome.report):
            link_counts.tell(line)
    for path, write in files.items():
        link_counts.keep(path, write(outcome.report, seed))
    raise typer.Exit(outcome.code)


def _listening(port: int) -> socket.socket:
    try:
        return socket.create_server(("127.0.0.1", port))
    except OSError as error:
        raise ConfigError(f"--publish {port}: {error.strerror}") from None
