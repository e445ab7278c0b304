"""Options of a live run, or of a part of one."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dva_sim.kernel.config_overrides import blame, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.resources import refuse_to_replace
from dva_sim.live.open_files import check_room_for
from dva_sim.network.addresses import check_address
from dva_sim.network.carriers import RunCarrier, carrier_of
from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.link import LinkConfig
from dva_sim.network.link.files import read_link
from dva_sim.network.sockets import split_address
from dva_sim.recordings.writing import SUFFIX, check_both, try_to_write
from dva_sim.simulation.full import rehearse
from dva_sim.simulation.scenario import Scenario, build, load

PARTS = ("dva", "world", "operator")
ROSBRIDGE = "rosbridge"  # part for clients of ROS, which is never run alone
PATHS = ("keys", "record", "state")  # options that name files
CAMERA_PORT = 8764  # of the robots' pictures; if it is taken, any that is free
TRACED = {None: "*", "dva": "dva", "world": "robot-*", "operator": ""}  # by who is run alone
OPERATORS = ("simulated", "scripted")
LOCALHOST = "127.0.0.1"
AS_IN_SCENARIO = "scenario"  # in place of keys of the emulated link


@dataclass(frozen=True)
class LiveOptions:
    """Options of a live part: scenario, addresses to bind, addresses to connect to.

    Attributes:
        scenario: Name or path.
        changes: Keys of the scenario with new values, `KEY=VALUE`.
        seed: Random seed of everything but the real network.
        operators: `simulated` people, or `scripted`.
        host: Address to listen on.
        dva: Address of the DVA, `HOST:PORT`.
        port: First port of the devices of this run, or part; each takes two. 0 for free ones.
        keys: Folder with the keys of the devices; None to run without.
        record: A recording to make, `.mcap`; or a folder for traces of all decisions.
        state: File in which the DVA keeps what must survive it; None: it keeps nothing.
        duration: Length of the run [s]; None: to the scenario's horizon.
        overwrite: True to replace an earlier recording.
        camera_port: Port of the robots' pictures; None: the usual one, and with keys none.
        emulated: The scenario's link is emulated between the robots and everybody else.
        transport: Transport of the messages, as on the command line; see `carrier_of`.
        rosbridge: Port for clients of ROS; None: there is none.
        foxglove: Port for Foxglove; None: there is none.
        shows_run: True if parts write all lines even without a recording, for viewers.
        token: True if such clients have to show a token.
    """

    scenario: str
    changes: tuple[str, ...] = ()
    seed: int = 1
    operators: str = "simulated"
    host: str = LOCALHOST
    dva: str | None = None
    port: int = 0
    keys: Path | None = None
    record: Path | None = None
    state: Path | None = None
    duration: float | None = None
    overwrite: bool = False
    camera_port: int | None = None
    emulated: bool = False
    transport: tuple[str, ...] = ()
    rosbridge: int | None = None
    foxglove: int | None = None
    shows_run: bool = False
    token: bool = True

    @property
    def carrier(self) -> RunCarrier:
        """Transport of the run.

        Raises:
            ConfigError: it is not given as it should be.
        """
        return carrier_of(self.transport)

    @property
    def shows_pictures(self) -> bool:
        """True if robots' pictures are served: with keys only on request, since HTTP has none."""
        return self.keys is None or self.camera_port is not None

    @property
    def records_run(self) -> bool:
        """True if a recording is wanted, and not only traces."""
        return self.record is not None and self.record.suffix.lower() == SUFFIX

    def read(self) -> Scenario:
        """The scenario, with its changes.

        Raises:
            ConfigError: it is not valid, or cannot be run live.
        """
        if self.operators not in OPERATORS:
            raise ConfigError(f"--operators {self.operators!r} should be {' or '.join(OPERATORS)}")
        if not 0 <= self.port < 65_000:
            raise ConfigError(f"--port {self.port} should be from 1 to 64999")
        if self.duration is not None and not 0 < self.duration < math.inf:
            raise ConfigError(f"--for {self.duration:g} should be a number of seconds above 0")
        if self.dva is not None:
            check_address(self.dva, "--dva ")
        places = self.host if self.dva is None else split_address(self.dva)[0], self.host
        self.carrier.check([] if self.emulated else places, self.keys is not None)
        scenario = self._built()
        if scenario.operator.strategy == "oracle":
            raise ConfigError("operator.strategy 'oracle' knows the truth: only in virtual time")
        if scenario.transport != "zeromq":
            raise ConfigError(f"transport {scenario.transport!r}: only in virtual time")
        if scenario.zeromq.conflate != "none":
            raise ConfigError(
                f"zeromq.conflate {scenario.zeromq.conflate!r}: only in virtual time, since real "
                "sockets would keep one part of a message and not the message"
            )
        return scenario

    def check(self, part: str | None = None) -> Scenario:
        """The scenario as `read` gives it, with everything placed once.

        Args:
            part: The only one that is run here; None: all.

        Raises:
            ConfigError: see `read`; or the site has no place for the team, or what is recorded
                cannot be put where it is wanted.
            DvaSimError: this process may open too few files for the team.
        """
        scenario, document = self.read(), load(self.scenario)
        if part is not None and self.rosbridge is not None:
            raise ConfigError("--rosbridge is for whole runs: leave out --only")
        if self.keys is not None and self.rosbridge is not None:
            raise ConfigError("--rosbridge has no keys for its clients: leave out --keys")
        if part is not None and self.foxglove is not None:
            raise ConfigError("--foxglove is for whole runs: leave out --only")
        if self.emulated:
            self._check_emulated(scenario, part)
        check_room_for(scenario.robot.count + scenario.guard.count + scenario.operator.count)

        def make(changes: Mapping[str, Any]) -> None:
            rehearse(build(document, changes), self.seed)

        try:
            rehearse(scenario, self.seed)
        except ConfigError as error:
            found = blame(error, parse_changes(self.changes), make, document)
            raise set_by(self.changes, found) from None
        if self.record is not None:
            self._check_record(self.record, part)
        return scenario

    def _check_emulated(self, scenario: Scenario, part: str | None) -> None:
        others = {
            "--only": part is not None,
            "--dva": self.dva is not None,
            "--host": self.host != LOCALHOST,
            "--camera-port": self.camera_port is not None,
        }
        if given := [name for name, is_given in others.items() if is_given]:
            raise ConfigError(
                f"{given[0]} cannot be given with --link, where all parts run in networks of "
                "their own"
            )
        check_emulated(scenario.link, self.seed)

    def _check_record(self, record: Path, part: str | None) -> None:
        if self.records_run:
            check_both(record, self.overwrite)
            return
        if not record.is_dir() and (record.suffix or record.exists()):
            raise ConfigError(
                f"--record: recording should end in {SUFFIX}, not {record.name!r}; a folder for "
                "traces has no dot in its name, or is there"
            )
        try:
            record.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(f"cannot be a folder for traces: {error.strerror}", record) from error
        refuse_to_replace(sorted(record.glob(trace_of(TRACED.get(part, "")))), self.overwrite)
        try_to_write(record)

    def _built(self) -> Scenario:
        document, changes = load(self.scenario), parse_changes(self.changes)
        try:
            return build(document, changes)
        except ConfigError as error:
            raise set_by(self.changes, error) from None


def check_emulated(link: LinkConfig, seed: int) -> None:
    """Refuse a link that cannot be emulated.

    Raises:
        ConfigError: it has partitions, or names a file that cannot be read.
    """
    if link.partitions:
        raise ConfigError(
            "link.partitions: only on modelled links, since all robots share the emulated one; "
            "link.outages are understood"
        )
    links_of(link, seed)


def changes_by_link(given: Sequence[str]) -> tuple[str, ...]:
    """The changes of a scenario, `KEY=VALUE`, that give it the link that is to be emulated.

    Args:
        given: Keys of the link with new values, and at most one file of a link, which takes the
            place of the scenario's; `scenario` is the scenario's own.

    Raises:
        ConfigError: it is not a valid link.
    """
    pairs = [text for text in given if "=" in text]
    files = [text for text in given if "=" not in text and text != AS_IN_SCENARIO]
    if len(files) > 1:
        raise ConfigError(f"--link {files[1]}: a link is in one file, and {files[0]} is one")
    try:
        read_link(None, parse_changes(pairs), ())
    except ConfigError as error:
        raise ConfigError(f"--link {error.problem.removeprefix('--set ')}") from None
    changes = [f"link.{pair}" for pair in pairs]
    if files:
        link = read_link(files[0], {}, ()).model_dump(mode="json", exclude_defaults=True)
        changes = [f"link={json.dumps(link)}", *changes]
    return tuple(changes)


def trace_of(label: str) -> str:
    """The file for the trace of a robot, or the DVA, in the folder for traces."""
    return f"{label}.trace.jsonl"
