"""Contradictions within a scenario, reported before it runs.

A contradiction is not a mistake: the scenario can be run, and somebody may want to see what
happens. Each is one sentence that names the keys and says what would go together.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from dva_sim.agents.robot.controller import LEASE_S
from dva_sim.network.link.delay_logs import read_delay_log
from dva_sim.network.link.recorded import longest_gap_s, read_trace
from dva_sim.simulation.scenario.scenario import (
    Scenario,
    pattern_of,
    phone_profile,
    robot_profiles,
    site_of,
)
from dva_sim.simulation.scenario.time_outs import (
    command_needs_s,
    command_timeout_s,
    mean_processing_s,
    request_timeout_s,
    round_trip_s,
    start_needs_s,
)
from dva_sim.worlds.hazards import find_hazard
from dva_sim.worlds.maps import doubts_of_map

_BITS = 8
_OVER_TRACE = ("rate_bps",)
_OF_SOCKETS = "zeromq"


def contradictions(scenario: Scenario, *, live: bool = False) -> list[str]:
    """List contradictory settings, a sentence each without its full stop.

    Args:
        scenario: Scenario as `build` makes it.
        live: True for runs over real sockets, where the modelled link plays no part.
    """
    link = _of_modelled_link(scenario) if live else _of_link(scenario)
    checks = (
        _of_map(scenario),
        _of_watchdog(scenario, live),
        _of_team(scenario),
        _of_time(scenario),
    )
    return [*link, *itertools.chain(*checks)]


def _of_map(scenario: Scenario) -> Iterator[str]:
    if scenario.site.map is not None:
        yield from (f"site.map: {doubt}" for doubt in doubts_of_map(scenario.site.map))


def _of_modelled_link(scenario: Scenario) -> Iterator[str]:
    if keys := sorted(scenario.link.model_fields_set):
        named = ", ".join(f"link.{key}" for key in keys)
        yield f"{named}: a live run has the real link; the modelled one plays no part in it"


def _of_link(scenario: Scenario) -> Iterator[str]:
    """Yield time-outs and limits that the link's delay, or its rate, goes beyond."""
    trip = round_trip_s(scenario.link)
    needs, timeout = start_needs_s(scenario), request_timeout_s(scenario)
    why = f"with a round trip of {trip:g} s"
    if _moves_robots(scenario) and timeout < needs:
        yield (
            f"request.timeout_s {timeout:g} is below {needs:g} s, which a "
            f"request over a new connection needs {why}: nothing will be answered; give more, or "
            "leave it out"
        )
    if not _drives(scenario):
        return
    answer = command_needs_s(scenario)
    waits = command_timeout_s(scenario)
    if pattern_of(scenario).answered and waits <= answer:
        yield (
            f"command.timeout_s {waits:g} is not above {answer:g} s, which "
            f"the reply to a command takes {why}: every command counts as unanswered; give more, "
            "or leave it out"
        )
    if scenario.robot.max_age_s <= answer:
        yield (
            f"robot.max_age_s {scenario.robot.max_age_s:g} is not above {answer:g} s, the age of "
            f"every command {why}: the robot refuses all of them; give more"
        )
    yield from _of_computer(scenario)
    if needs > LEASE_S:
        yield (
            f"a robot ends a drive that is {LEASE_S:g} s without a command, and {why} (link."
            f"delay_s) the first takes {needs:g} s: no drive will begin"
        )
    yield from _of_pictures(scenario)
    if scenario.link.trace_up or scenario.link.trace_down:
        for key in _OVER_TRACE:
            if key in scenario.link.model_fields_set:
                yield f"link.{key} has no effect where link.trace_up or trace_down gives the rate"
    if file := scenario.link.delay_log:
        yield from (f"link.delay_log {file!r}: {doubt}" for doubt in read_delay_log(file).doubts)
    for key, file in (
        ("trace_up", scenario.link.trace_up),
        ("trace_down", scenario.link.trace_down),
    ):
        if file is not None and (gap := longest_gap_s(read_trace(file))) > scenario.horizon_s:
            yield (
                f"link.{key} {file!r} carries nothing for {gap:,.0f} s at a stretch, longer than a "
                f"run (horizon_s {scenario.horizon_s:g}): runs that begin there carry nothing"
            )


def _of_computer(scenario: Scenario) -> Iterator[str]:
    """Yield a robot that needs longer for a command than the next one takes to come."""
    takes = mean_processing_s(scenario)
    rate = scenario.command.rate_hz
    pattern = pattern_of(scenario)
    if pattern.published and not pattern.newest_wins and takes * rate > 1:
        yield (
            f"robot.processing_s {takes:g} is longer than the time between two commands "
            f"(command.rate_hz {rate:g}), and under {scenario.pattern} each of "
            "them is obeyed: they queue, and a stop is obeyed ever later"
        )


def _of_pictures(scenario: Scenario) -> Iterator[str]:
    camera = scenario.camera
    down = scenario.link.toward("down")
    bit_rate = camera.rate_hz * camera.frame_bytes * _BITS
    if scenario.link.trace_down is None and bit_rate > down.rate_bps:
        yield (
            f"the camera sends {bit_rate / 1e3:g} kbit/s (camera.rate_hz x frame_bytes) over a "
            f"link of {down.rate_bps / 1e3:g} kbit/s (link.rate_bps): pictures will come late or "
            "not at all"
        )
    if camera.encode_s * camera.rate_hz > 1:
        yield (
            f"camera.rate_hz {camera.rate_hz:g} cannot be reached with camera.encode_s "
            f"{camera.encode_s:g}: one picture is encoded at a time"
        )


def _of_watchdog(scenario: Scenario, live: bool) -> Iterator[str]:
    """Yield a robot that stops between any two commands."""
    if not _drives(scenario):
        return
    limit = scenario.robot.watchdog_s
    phone = phone_profile(scenario)
    period = 1 / scenario.command.rate_hz
    if limit <= period:
        yield (
            f"robot.watchdog_s {limit:g} is not above {period:g} s, the time between two commands "
            f"(command.rate_hz {scenario.command.rate_hz:g}): the robot stops after each"
        )
    elif pattern_of(scenario).in_step and not live and limit <= command_needs_s(scenario):
        yield (
            f"robot.watchdog_s {limit:g} is not above {command_needs_s(scenario):g} s, the time "
            f"between two commands under {scenario.pattern}, which waits for each reply: the robot "
            "stops after each"
        )
    if phone.send == "on_change" and limit <= phone.max_delay_s:
        yield (
            f"robot.watchdog_s {limit:g} is not above phone.max_delay_s {phone.max_delay_s:g}, "
            "the longest time between two commands: the robot stops after each"
        )


def _of_team(scenario: Scenario) -> Iterator[str]:
    if scenario.dispatch.containment and not scenario.guard.count:
        yield (
            "dispatch.containment waits for a guard, and guard.count is 0: no event will be "
            "contained"
        )
    default = scenario.robot.sensors
    carried = [default if default is not None else r.sensors for r in robot_profiles(scenario)]
    sensors = {sensor.name for each in carried for sensor in each}
    for name in (name for name in scenario.dva.sensors if name not in sensors):
        yield f"dva.sensors names {name!r}, which no robot carries"
    robots = {f"robot-{number}" for number in range(1, scenario.robot.count + 1)}
    holders = {f"operator-{number}" for number in range(1, scenario.operator.count + 1)} | {"dva"}
    for number, rule in enumerate(scenario.access):
        for kind, named, labels_there in (
            ("robots", rule.robots, robots),
            ("holders", rule.holders, holders),
        ):
            for label in (label for label in named if label not in labels_there):
                yield f"access.{number}.{kind} names {label!r}, who is not in this scenario"
    if scenario.transport != "zeromq" and scenario.zeromq.model_fields_set:
        keys = ", ".join(f"{_OF_SOCKETS}.{key}" for key in sorted(scenario.zeromq.model_fields_set))
        yield f"{keys}: transport {scenario.transport!r} has no ZeroMQ sockets"


def _of_time(scenario: Scenario) -> Iterator[str]:
    """Yield what would happen after the end, and rows of a table that are in doubt."""
    end = scenario.horizon_s
    yield from (f"events: {doubt}" for doubt in scenario.events_doubts)
    for number, event in enumerate(scenario.events):
        if event.at_s >= end:
            yield (
                f"events.{number}.at_s {event.at_s:g} is not before horizon_s {end:g}: the event "
                "will not happen"
            )
    yield from _of_detectors(scenario)
    for kind in ("outages", "partitions"):
        for number, gap in enumerate(getattr(scenario.link, kind)):
            if gap.from_s >= end:
                yield (
                    f"link.{kind}.{number}.from_s {gap.from_s:g} is not before horizon_s {end:g}: "
                    "it will not happen"
                )


def _of_detectors(scenario: Scenario) -> Iterator[str]:
    """Yield events that nobody reports and no detector of the site can notice."""
    unreported = [(n, event) for n, event in enumerate(scenario.events) if not event.reported]
    detector_kinds = {d.kind for d in site_of(scenario, seed=0).detectors} if unreported else set()
    for number, event in unreported:
        kind = find_hazard(event.kind)
        if detector_kinds.isdisjoint(kind.detectors):
            yield (
                f"events.{number}.reported is false, and the site has no detector for a "
                f"{kind.title}: the DVA will not hear of it"
            )


def _moves_robots(scenario: Scenario) -> bool:
    return scenario.robot.count > 0


def _drives(scenario: Scenario) -> bool:
    """Return True if operators send commands rather than goals."""
    return _moves_robots(scenario) and scenario.control != "supervisory"
