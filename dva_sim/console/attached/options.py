"""Address of the DVA that a console attaches to, and its keys."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dva_sim.console.audit.audit_keeper import check_target
from dva_sim.console.pages.page_options import PageOptions
from dva_sim.kernel.config_overrides import parse_changes
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.addresses import check_address
from dva_sim.network.carriers import RunCarrier, carrier_of
from dva_sim.network.keys import KeyRing
from dva_sim.network.sockets import split_address
from dva_sim.simulation.full.stage import id_of, kind_of
from dva_sim.simulation.scenario import build, load, site_of
from dva_sim.worlds.site import Site

ROOM = "control-room"
FIRST_FREE = 1001  # numbers of control rooms that no scenario gives, for who has no key


@dataclass(frozen=True, kw_only=True)
class AttachOptions(PageOptions):
    """DVA to attach to, and where to show it.

    Attributes:
        dva: Address of the DVA, `HOST:PORT`.
        keys: Folder with the keys of the devices; None: without.
        scenario: Scenario whose site is drawn; None: no plan is known.
        changes: Changes of the scenario, `KEY=VALUE`.
        audit: File of the audit log; None: one that is gone with the console.
        transport: Transport of the DVA's messages, as on the command line.
    """

    dva: str
    keys: Path | None = None
    scenario: str | None = None
    changes: tuple[str, ...] = ()
    audit: Path | None = None
    transport: tuple[str, ...] = ()

    @property
    def carrier(self) -> RunCarrier:
        """Transport to the DVA.

        Raises:
            ConfigError: it is not given as it should be.
        """
        return carrier_of(self.transport)

    @property
    def listen(self) -> str:
        """Address of this machine at which the DVA finds the console's own device."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as way:
            try:
                way.connect(split_address(self.dva))  # nothing is sent by that
            except OSError:
                return "127.0.0.1"
            return str(way.getsockname()[0])

    def check(self) -> None:
        """Check that it is possible.

        Raises:
            ConfigError: the address is none, or no audit log can be kept where it is wanted.
        """
        check_address(self.dva, "--dva ")
        self.carrier.check([split_address(self.dva)[0]], self.keys is not None)
        if self.audit is not None:
            check_target(self.audit)

    def site(self) -> Site | None:
        """Return the site, as far as it is known.

        Raises:
            ConfigError: the scenario, or its site, cannot be read.
        """
        if self.scenario is None:
            return None
        scenario = build(load(self.scenario), parse_changes(self.changes))
        return site_of(scenario, 1)

    def ring(self) -> KeyRing | None:
        """The keys, if there are to be any.

        Raises:
            ConfigError: they cannot be read.
        """
        return None if self.keys is None else KeyRing(self.keys)

    def own_id(self, ring: KeyRing | None) -> str:
        """The id of the console's own device: that of a key, or one that hardly anybody has.

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


def refuse_with_dva(given: Sequence[str]) -> None:
    """Nothing runs in a console that is attached: what is about that cannot be wanted.

    Raises:
        ConfigError: something of it was given.
    """
    if given:
        raise ConfigError(f"{given[0]} is not for --dva: what is shown runs elsewhere")
