"""Checks of the options of a live run before anything starts, and its scenario."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from dva_sim.kernel.config_overrides import blame, parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.resources import refuse_to_replace
from dva_sim.live.open_files import check_room_for
from dva_sim.network.addresses import check_address
from dva_sim.network.emulator.forwarder import links_of
from dva_sim.network.link import LinkConfig
from dva_sim.network.link.files import read_link
from dva_sim.options.runs import LOCALHOST, OPERATORS, SUFFIX, ConsoleOptions, LiveOptions
from dva_sim.recordings.writing import check_both, try_to_write
from dva_sim.simulation.full import rehearse
from dva_sim.simulation.scenario import Scenario, build, load

ROSBRIDGE = "rosbridge"  # name of the part for clients of ROS, which never runs alone
PATHS = ("keys", "record", "state")  # options that name files
CAMERA_PORT = 8764  # preferred port for the robots' pictures
TRACED = {
    None: "*",
    "dva": "dva",
    "world": "robot-*",
    "operator": "",
}  # pattern of traced labels, by `--only`
AS_IN_SCENARIO = "scenario"  # value of `--link` for the scenario's own link


def scenario_of(options: LiveOptions) -> Scenario:
    """Load the scenario with its changes.

    Raises:
        ConfigError: it is not valid, or cannot be run live.
    """
    if options.operators not in OPERATORS:
        raise ConfigError(f"--operators {options.operators!r} should be {' or '.join(OPERATORS)}")
    if not 0 <= options.port < 65_000:
        raise ConfigError(f"--port {options.port} should be from 1 to 64999")
    if options.duration is not None and not 0 < options.duration < math.inf:
        raise ConfigError(f"--for {options.duration:g} should be a number of seconds above 0")
    for address in addresses_of(options):
        check_address(address, "--dva ")
    changes = changes_of(options)
    try:
        scenario = build(load(options.scenario), parse_changes(changes))
    except ConfigError as error:
        raise set_by(changes, error) from None
    if scenario.operator.strategy == "oracle":
        raise ConfigError("operator.strategy 'oracle' knows the truth: only in virtual time")
    if scenario.transport != "zeromq":
        raise ConfigError(f"transport {scenario.transport!r}: only in virtual time")
    if scenario.zeromq.conflate != "none":
        raise ConfigError(
            f"zeromq.conflate {scenario.zeromq.conflate!r}: only in virtual time, since real "
            "sockets would keep one part of a message and not the message"
        )
    _check_regions(options, scenario)
    return scenario


def addresses_of(options: LiveOptions | ConsoleOptions) -> list[str]:
    """Return the addresses of the DVAs, in the order of their regions; none if none is given."""
    return [] if options.dva is None else [each.strip() for each in options.dva.split(",")]


def check_count(options: LiveOptions | ConsoleOptions, scenario: Scenario) -> int:
    """Return the number of DVAs of a scenario, after checking the number of addresses.

    Raises:
        ConfigError: the number of addresses is not that of the regions.
    """
    addresses = len(addresses_of(options))
    count = max(1, len(scenario.dva.regions))
    if addresses not in (0, count):
        has = f"{count} regions" if scenario.dva.regions else "one DVA"
        raise ConfigError(f"--dva names {addresses} addresses, and the scenario has {has}")
    return count


def _check_regions(options: LiveOptions, scenario: Scenario) -> None:
    """Reject a wrong number of addresses, and options for a single DVA if there are several."""
    count = check_count(options, scenario)
    if scenario.dva.deaths:
        raise ConfigError("dva.deaths: only in virtual time; end the process of a DVA instead")
    if scenario.dva.backbone is not None:
        raise ConfigError("dva.backbone: only in virtual time; live, DVAs share the local network")
    if scenario.dva.regions and options.link:
        raise ConfigError("--link: not with dva.regions, whose DVAs would all be at one end")
    if options.only == "dva" and options.number > count:
        raise ConfigError(f"--number {options.number}: the scenario has {count} DVAs")


def check(options: LiveOptions) -> Scenario:
    """Return the scenario after checking all options, with a trial placement of the team.

    Raises:
        ConfigError: see `scenario_of`; or the site has no place for the team, or the recording
            cannot be written.
        DvaSimError: this process may open too few files for the team.
    """
    scenario = scenario_of(options)
    document = load(options.scenario)
    changes = changes_of(options)
    if options.only is not None and options.rosbridge is not None:
        raise ConfigError("--rosbridge is for whole runs: leave out --only")
    if options.keys is not None and options.rosbridge is not None:
        raise ConfigError("--rosbridge has no keys for its clients: leave out --keys")
    if options.only is not None and options.foxglove is not None:
        raise ConfigError("--foxglove is for whole runs: leave out --only")
    if options.only != "dva" and (options.page is not None or options.no_page):
        raise ConfigError(f"--{'no-page' if options.no_page else 'page'} is for --only dva")
    if options.users is not None and not options.serves_page:
        raise ConfigError("--users is for the page of --only dva")
    if options.link:
        _check_emulated(options, scenario)
    check_room_for(scenario.robot.count + scenario.guard.count + scenario.operator.count)

    def make(changes: Mapping[str, Any]) -> None:
        rehearse(build(document, changes), options.seed)

    try:
        rehearse(scenario, options.seed)
    except ConfigError as error:
        mistake = blame(error, parse_changes(changes), make, document)
        raise set_by(changes, mistake) from None
    if options.record is not None:
        _check_record(options, options.record)
    return scenario


def _check_emulated(options: LiveOptions, scenario: Scenario) -> None:
    exclusive = {
        "--only": options.only is not None,
        "--dva": options.dva is not None,
        "--host": options.host != LOCALHOST,
        "--camera-port": options.camera_port is not None,
    }
    if excluded := [name for name, is_given in exclusive.items() if is_given]:
        raise ConfigError(
            f"{excluded[0]} cannot be given with --link, where all parts run in networks of their "
            "own"
        )
    check_emulated(scenario.link, options.seed)


def _check_record(options: LiveOptions, record: Path) -> None:
    if options.records_run:
        check_both(record, options.overwrite)
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
    refuse_to_replace(
        sorted(record.glob(trace_of(TRACED.get(options.only, "")))), options.overwrite
    )
    try_to_write(record)


def check_emulated(link: LinkConfig, seed: int) -> None:
    """Reject a link that cannot be emulated.

    Raises:
        ConfigError: it has partitions, or names a file that cannot be read.
    """
    if link.partitions:
        raise ConfigError(
            "link.partitions: only on modelled links, since all robots share the emulated one; "
            "link.outages are understood"
        )
    links_of(link, seed)


def changes_of(options: LiveOptions | ConsoleOptions) -> tuple[str, ...]:
    """Return the changes of the scenario as `KEY=VALUE`, including those of the emulated link."""
    return (*options.set, *changes_by_link(options.link))


def changes_by_link(words: Sequence[str]) -> tuple[str, ...]:
    """Return the changes of a scenario, as `KEY=VALUE`, that give it the emulated link.

    Args:
        words: Keys of the link with new values, and at most one file of a link, which replaces
            the scenario's link; `scenario` stands for the scenario's link.

    Raises:
        ConfigError: it is not a valid link.
    """
    pairs = [text for text in words if "=" in text]
    files = [text for text in words if "=" not in text and text != AS_IN_SCENARIO]
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
    """Return the name of the trace file of a robot or the DVA."""
    return f"{label}.trace.jsonl"
