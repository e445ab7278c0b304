"""Checks of the options of a console at a DVA elsewhere, and its site and id."""

from __future__ import annotations

import secrets
import socket

from dva_sim.console.audit.audit_keeper import check_target
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.live.options import changes_of
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import KeyRing
from dva_sim.network.sockets import split_address
from dva_sim.options.runs import ConsoleOptions
from dva_sim.simulation.full.stage import id_of, kind_of
from dva_sim.simulation.scenario import build, load, site_of
from dva_sim.worlds.site import Site

ROOM = "control-room"
FIRST_FREE = 1001  # numbers of control rooms that no scenario gives, for who has no key


def listening_address(dva: str) -> str:
    """Return the address at which the DVA finds the console's own device."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
        try:
            way.connect(split_address(dva))  # nothing is sent by that
        except OSError:
            return "127.0.0.1"
        return str(way.getsockname()[0])


def check(options: ConsoleOptions) -> None:
    """Check the options before anything starts.

    Raises:
        ConfigError: something is asked for that is of a console's own run, the address is none, or
            no audit log can be kept where it is wanted.
    """
    own = {
        "--links": options.links != "modelled",
        "--link": options.link,
        "--phones": options.phones,
        "--record": options.record,
        "-o": options.out,
        "--rosbridge": options.rosbridge is not None,
        "--foxglove": options.foxglove is not None,
    }
    for name, is_given in own.items():
        if is_given:
            raise ConfigError(f"{name} is not for --dva: what is shown runs elsewhere")
    check_address(str(options.dva), "--dva ")
    if options.audit is not None:
        check_target(options.audit)


def site_shown(options: ConsoleOptions) -> Site | None:
    """Return the site, as far as it is known.

    Raises:
        ConfigError: the scenario, or its site, cannot be read.
    """
    if options.scenario is None:
        return None
    scenario = build(load(options.scenario), parse_changes(changes_of(options)))
    return site_of(scenario, 1)


def own_id(ring: KeyRing | None) -> str:
    """Return the id of the console's own device: that of a key, or a random one.

    Raises:
        ConfigError: there is no secret key of a control room.
    """
    if ring is None:
        return id_of(ROOM, FIRST_FREE + secrets.randbelow(0xFFFF - FIRST_FREE))
    for device in ring.devices:
        if kind_of(device)[0] == ROOM and (ring.folder / "secret").exists():
            try:
                ring.pair(device)
            except ConfigError:
                continue
            return device
    raise ConfigError(
        f"no secret key of a control room; make one: dva-sim keys {ring.folder} {ROOM}-1",
        ring.folder,
    )
