"""Checks of the options of a console at a DVA elsewhere, and its scenario and ids."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from contextlib import suppress

from dva_sim.console.asking.refusal import Refused
from dva_sim.console.asking.seats import MAX_SEATS
from dva_sim.console.audit.audit_keeper import check_target
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.live.options import addresses_of, changes_of, check_count
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import KeyRing
from dva_sim.options.runs import ConsoleOptions
from dva_sim.simulation.full.stage import id_of, kind_of
from dva_sim.simulation.scenario import Scenario, build, load

ROOM = "control-room"
SEAT = "console"
FIRST_FREE = 1001  # numbers of control rooms that no scenario gives, for who has no key


def check(options: ConsoleOptions) -> None:
    """Check the options before anything starts.

    Raises:
        ConfigError: something is asked for that is of a console's own run, an address is none, it
            is not one for each region, or no audit log can be kept where it is wanted.
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
    for address in addresses_of(options):
        check_address(address, "--dva ")
    check_count(options, scenario_shown(options) or Scenario())
    if options.audit is not None:
        check_target(options.audit)


def scenario_shown(options: ConsoleOptions) -> Scenario | None:
    """Return the scenario that is named, whose site is shown.

    Raises:
        ConfigError: the scenario cannot be read.
    """
    if options.scenario is None:
        return None
    return build(load(options.scenario), parse_changes(changes_of(options)))


def own_ids(ring: KeyRing | None, count: int = 1) -> list[str]:
    """Return the ids of the console's own devices, one for each DVA: those of keys, or random ones.

    Raises:
        ConfigError: there are too few secret keys of control rooms.
    """
    if ring is None:
        first = FIRST_FREE + secrets.randbelow(0xFFFF - FIRST_FREE - count)
        return [id_of(ROOM, first + number) for number in range(count)]
    own = _with_secret(ring, ROOM)
    if len(own) >= count:
        return own[:count]
    more = f"dva-sim keys {ring.folder} {ROOM}-{len(own) + 1}"
    raise ConfigError(
        f"no secret key of a control room for each DVA; make one: {more}", ring.folder
    )


def seat_ids(ring: KeyRing | None) -> Callable[[int], str]:
    """Return what gives the n-th seat its id, from 1: that of a key, or one from random on."""
    first = FIRST_FREE + secrets.randbelow(0xFFFF - FIRST_FREE - MAX_SEATS)

    def seat_id(number: int) -> str:
        if ring is None:
            return id_of(SEAT, first + number)
        own = _with_secret(ring, SEAT)
        if number > len(own):
            more = f"dva-sim keys {ring.folder} {SEAT}-{number}"
            raise Refused(f"with --keys, who drives needs a key as well; make one: {more}")
        return own[number - 1]

    return seat_id


def _with_secret(ring: KeyRing, kind: str) -> list[str]:
    """Return the devices of a kind whose secret key is here."""
    devices = []
    for device in ring.devices:
        if kind_of(device)[0] == kind and (ring.folder / "secret").exists():
            with suppress(ConfigError):
                ring.pair(device)
                devices.append(device)
    return devices
