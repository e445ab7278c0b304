"""Checks of the options of a console before anything starts, and what follows from them."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from dva_sim.console.audit.audit_keeper import check_target as check_audit_target
from dva_sim.console.pages.addresses import own_address
from dva_sim.console.run.real_links import ConsoleSockets, MakeSockets
from dva_sim.console.world.kept_results import KeptResults
from dva_sim.kernel.config_overrides import parse_changes, set_by
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import either
from dva_sim.live.options import changes_of, check_emulated
from dva_sim.options.runs import LINKS, ConsoleOptions
from dva_sim.recordings.writing import check_both
from dva_sim.simulation.scenario import Scenario, build, load


def kept_results(options: ConsoleOptions) -> KeptResults | None:
    """Return what makes tables of people's drives, if they are wanted.

    Raises:
        ConfigError: the folder holds something already.
    """
    if options.out is None:
        return None
    return KeptResults(
        options.out, options.played, changes_of(options), options.seed, options.overwrite
    )


def motion_folder(options: ConsoleOptions) -> Path | None:
    """Return the folder for phones' motion, created if need be.

    Raises:
        ConfigError: it cannot be.
    """
    if options.keep_motion is not None:
        try:
            options.keep_motion.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigError(f"--keep-motion {options.keep_motion}: {error.strerror}") from None
    return options.keep_motion


def sockets(options: ConsoleOptions) -> MakeSockets | None:
    """Return what makes the sockets of real links."""
    if options.links == "modelled":
        return None
    host = own_address(options.host) if options.host in ("0.0.0.0", "::") else options.host
    seed = options.seed if options.link else None
    return partial(ConsoleSockets, host=host, port=options.dva_port, emulated=seed)


def scenario_of(options: ConsoleOptions) -> Scenario:
    """Return the scenario with its changes.

    Raises:
        ConfigError: it cannot be run before people's eyes, or not recorded as wanted.
    """
    if options.links not in LINKS:
        raise ConfigError(f"--links {options.links!r} should be {either(LINKS)}")
    document = load(options.played)
    changes = changes_of(options)
    model = document.data.get("model", "full")
    if model != "full":
        raise ConfigError(
            f"{options.played!r} has the model {model!r}; a console shows the model 'full' alone"
        )
    try:
        scenario = build(document, parse_changes(changes))
    except ConfigError as error:
        raise set_by(changes, error) from None
    if options.links == "real" and scenario.zeromq.conflate != "none":
        raise ConfigError("zeromq.conflate: only on modelled links, since messages have parts")
    if options.link:
        _check_emulated(options, scenario)
    if options.record is not None:
        check_both(options.record, options.overwrite)
    if options.audit is not None:
        check_audit_target(options.audit)
    return scenario


def _check_emulated(options: ConsoleOptions, scenario: Scenario) -> None:
    if options.links != "real":
        raise ConfigError("--link is for --links real; --set link.KEY changes a modelled link")
    if scenario.zeromq.send_buffer_bytes or scenario.zeromq.receive_buffer_bytes:
        raise ConfigError("zeromq: sizes of TCP's buffers cannot be chosen with --link")
    check_emulated(scenario.link, options.seed)
