"""Options of a console, read and checked before anything starts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from dva_sim.console.audit.audit_keeper import check_target as check_audit_target
from dva_sim.console.pages.addresses import own_address
from dva_sim.console.pages.page_options import PageOptions
from dva_sim.console.run.real_links import ConsoleSockets, MakeSockets
from dva_sim.console.world.kept_results import KeptResults
from dva_sim.kernel.config_overrides import parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import either
from dva_sim.live.options import check_emulated
from dva_sim.network.carriers import carrier_of
from dva_sim.recordings.writing import check_both
from dva_sim.simulation.scenario import Scenario, build, load

LINKS = "modelled", "real"
DEFAULT = "hands-on"


@dataclass(frozen=True, kw_only=True)
class ConsoleOptions(PageOptions):
    """Options of a console: scenario, and address of its page.

    Attributes:
        scenario: Name or path.
        seed: Random seed.
        changes: Changes of the scenario, `KEY=VALUE`.
        links: `modelled` as in a study, or `real`: sockets, which others may join.
        dva_port: First of the two ports of the DVA on real links; 0: any two that are free.
        transport: Transport of the messages on real links, as on the command line.
        emulated: The scenario's link is emulated between the robots and everybody else.
        record: Recording to be made, if any.
        audit: File of the audit log; None: one that is gone with the console.
        results: Folder for the tables of what people did, if any.
        keep_motion: Folder for the samples of phones whose person agrees, if any.
        overwrite: True to replace existing files.
        rosbridge: Port for clients of ROS; None: there is none.
        foxglove: Port for Foxglove; None: there is none.
    """

    scenario: str = DEFAULT
    seed: int = 1
    changes: tuple[str, ...] = ()
    links: str = "modelled"
    dva_port: int = 0
    transport: tuple[str, ...] = ()
    emulated: bool = False
    record: Path | None = None
    audit: Path | None = None
    results: Path | None = None
    keep_motion: Path | None = None
    overwrite: bool = False
    rosbridge: int | None = None
    foxglove: int | None = None

    def kept_results(self) -> KeptResults | None:
        """Return what makes tables of people's drives, if they are wanted.

        Raises:
            ConfigError: the folder holds something already.
        """
        if self.results is None:
            return None
        asked = self.scenario, self.changes, self.seed, self.overwrite
        return KeptResults(self.results, *asked)

    def motion_folder(self) -> Path | None:
        """Return the folder for phones' motion, created if need be.

        Raises:
            ConfigError: it cannot be.
        """
        if self.keep_motion is not None:
            try:
                self.keep_motion.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise ConfigError(f"--keep-motion {self.keep_motion}: {error.strerror}") from None
        return self.keep_motion

    def sockets(self) -> MakeSockets | None:
        """Return what makes the sockets of real links."""
        if self.links == "modelled":
            return None
        host = own_address(self.host) if self.host in ("0.0.0.0", "::") else self.host
        carrier = carrier_of(self.transport)
        seed = self.seed if self.emulated else None
        return partial(
            ConsoleSockets, host=host, port=self.dva_port, carrier=carrier, emulated=seed
        )

    def read(self) -> Scenario:
        """The scenario.

        Raises:
            ConfigError: it cannot be run before people's eyes, or not recorded as wanted.
        """
        if self.links not in LINKS:
            raise ConfigError(f"--links {self.links!r} should be {either(LINKS)}")
        if self.links == "real":
            carrier_of(self.transport).check([self.host], has_keys=False)
        elif self.transport:
            raise ConfigError("--transport is for --links real, or --dva")
        document, changes = load(self.scenario), parse_changes(self.changes)
        model = document.data.get("model", "full")
        if model != "full":
            raise ConfigError(
                f"{self.scenario!r} has the model {model!r}; a console shows the model 'full' alone"
            )
        try:
            scenario = build(document, changes)
        except ConfigError as error:
            raise set_by(self.changes, error) from None
        if self.links == "real" and scenario.zeromq.conflate != "none":
            raise ConfigError("zeromq.conflate: only on modelled links, since messages have parts")
        if self.emulated:
            self._check_emulated(scenario)
        if self.record is not None:
            check_both(self.record, self.overwrite)
        if self.audit is not None:
            check_audit_target(self.audit)
        return scenario

    def _check_emulated(self, scenario: Scenario) -> None:
        if self.links != "real":
            raise ConfigError("--link is for --links real; --set link.KEY changes a modelled link")
        if scenario.zeromq.send_buffer_bytes or scenario.zeromq.receive_buffer_bytes:
            raise ConfigError("zeromq: sizes of TCP's buffers cannot be chosen with --link")
        check_emulated(scenario.link, self.seed)
