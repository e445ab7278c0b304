"""Loading of scenarios: reading, checking and completing them; all names must resolve."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dva_sim.agents.tilt import try_phone
from dva_sim.kernel import config_overrides, resources
from dva_sim.kernel.config import Fail
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import Document, KeyPath, load_yaml
from dva_sim.simulation.scenario.alarms import table_of, why_not, with_events
from dva_sim.simulation.scenario.instructions import read_instructions
from dva_sim.simulation.scenario.parts import EventConfig
from dva_sim.simulation.scenario.regions import check_regions
from dva_sim.simulation.scenario.scenario import (
    Scenario,
    bystander_profile,
    guard_profile,
    pattern_of,
    phone_profile,
    population,
    robot_profiles,
    site_of,
)
from dva_sim.simulation.scenario.time_outs import command_timeout_s, request_timeout_s
from dva_sim.worlds.hazards import KINDS, find_hazard, make_hazard
from dva_sim.worlds.site import load_site

if TYPE_CHECKING:
    from dva_sim.agents.tilt import PhoneProfile


_OPTION = re.compile(r"option '([^']+)'")  # form in which factories name a wrong option
_IN_FILES = (
    (None, "pattern"),
    ("dispatch", "policy"),
    ("operator", "strategy"),
    ("phone", "filter"),
    ("phone", "mapping"),
)


def locate_files(data: dict[str, Any], folders: Sequence[Path]) -> None:
    """Let a class in a file beside the one that names it be found from anywhere."""
    events = data.get("events")
    if isinstance(events, str):
        data["events"] = events = {"table": events}
    if isinstance(events, dict):
        _locate_table(events, folders)
    _locate_instructions(data.get("instructions"), folders)
    holders = [(data if part is None else data.get(part), key) for part, key in _IN_FILES]
    holders += [(event, "kind") for event in events] if isinstance(events, list | tuple) else []
    for holder, key in holders:
        named = holder.get(key) if isinstance(holder, dict) else None
        file, colon, class_name = named.rpartition(":") if isinstance(named, str) else ("", "", "")
        beside = [folder / file for folder in folders if colon and resources.is_file(folder / file)]
        if beside and isinstance(holder, dict):
            holder[key] = f"{beside[0]}:{class_name}"


def _locate_table(events: dict[str, Any], folders: Sequence[Path]) -> None:
    """Locate a table beside the scenario that names it, or in the working folder."""
    table = events.get("table")
    if isinstance(table, str):
        beside = (folder / table for folder in folders)
        events["table"] = str(next(filter(resources.is_file, beside), table))


def _locate_instructions(named: object, folders: Sequence[Path]) -> None:
    """Locate instructions beside the scenario that names them, or in the working folder."""
    if not isinstance(named, dict):
        return
    for kind, file in named.items():
        if isinstance(file, str):
            beside = (folder / file for folder in folders)
            named[kind] = str(next(filter(resources.is_file, beside), file))


def check_names(scenario: Scenario, error: Fail) -> None:
    """Refuse a profile, strategy or policy that does not exist, before anything runs."""
    choices: dict[KeyPath, tuple[str | tuple[str, ...], str]] = {
        ("phone", "profile"): (scenario.phone.profile, "agents/phones"),
        ("robot", "profile"): (scenario.robot.profile, "agents/robots"),
        ("guard", "profile"): (scenario.guard.profile, "agents/people"),
        ("bystander", "profile"): (scenario.bystander.profile, "agents/people"),
        ("operator", "population"): (scenario.operator.population, "agents/people"),
    }
    for path, (chosen, folder) in choices.items():
        for name in (chosen,) if isinstance(chosen, str) else chosen:
            if not resources.is_there(name, folder) and not resources.is_file(Path(name)):
                key = ".".join(str(p) for p in path)
                available = resources.available(folder)
                raise error(unknown(key, name, sorted(available)), path)
    if scenario.operator.traits:
        with _located(error, lambda _: ("operator", "traits")):
            population(scenario.operator)
    if scenario.guard.traits:
        with _located(error, lambda _: ("guard", "traits")):
            guard_profile(scenario)
    if scenario.bystander.traits:
        with _located(error, lambda _: ("bystander", "traits")):
            bystander_profile(scenario)
    with _located(error, _pattern_key):
        pattern_of(scenario)
    check_strategy(scenario.operator.strategy, scenario.operator.options, error)
    check_policy(scenario.dispatch.policy, scenario.dispatch.options, error)
    for kind, file in scenario.instructions.items():
        _check_instructions(file, ("instructions", kind), error)
    for number, event in enumerate(scenario.events):
        _check_position(scenario, event, ("events", number, "position"), error)
        if event.kind not in KINDS:
            _check_hazard(event, ("events", number), error)


def _check_instructions(file: str, path: KeyPath, error: Fail) -> None:
    """Refuse instructions that cannot be read."""
    with _located(error, lambda _: path):
        read_instructions(Path(file))


def _check_position(scenario: Scenario, event: EventConfig, path: KeyPath, error: Fail) -> None:
    """Refuse a place where no event can be, or that is in another room."""
    if event.position is None:
        return
    x, y = event.position
    site = site_of(scenario, seed=0)
    if why := why_not(site, x, y):
        raise error(f"position ({x:g}, {y:g}) {why}", path)
    if event.room is not None and (around := site.room_at(x, y)) != event.room:
        where = f"in {around!r}" if around else "in no room"
        raise error(f"position ({x:g}, {y:g}) is {where}, not in {event.room!r}", path)


def _check_hazard(event: EventConfig, path: KeyPath, error: Fail) -> None:
    """Refuse a user's hazard that cannot be loaded, or does not know its settings."""
    with _located(error, lambda _: (*path, "kind")):
        find_hazard(event.kind)
    with _located(error, lambda _: (*path, "hazard")):
        make_hazard(event.kind, (0.0, 0.0), event.at_s, **event.hazard)


def check_strategy(strategy: str, options: Mapping[str, Any], error: Fail) -> None:
    """Refuse a way of steering that cannot be loaded, or does not know its options."""
    from dva_sim.agents.operator.strategies import try_strategy  # late: start-up

    with _located(error, lambda problem: _place(problem, "operator", "strategy", "options")):
        try_strategy(strategy, options)


def check_policy(policy: str, options: Mapping[str, Any], error: Fail) -> None:
    """Refuse a policy that cannot be loaded, or does not know its options."""
    from dva_sim.core.dispatch import load_policy  # late: start-up

    with _located(error, lambda problem: _place(problem, "dispatch", "policy", "options")):
        load_policy(policy, options)


def check_phone(profile: PhoneProfile, error: Fail) -> None:
    """Refuse a phone whose part, filter or mapping cannot be had, or does not know its options."""

    def place(problem: ConfigError) -> KeyPath:
        stages = ("accelerometer", "mapping", "filter")
        key = next((s for s in stages if problem.problem.startswith(s)), "filter")
        return _place(problem, "phone", key, f"{key}_options")

    with _located(error, place):
        try_phone(profile)


@contextmanager
def _located(error: Fail, place: Callable[[ConfigError], KeyPath]) -> Iterator[None]:
    """Tell a mistake at its key of the scenario, unless it is in another file."""
    try:
        yield
    except ConfigError as problem:
        if problem.file is not None:
            raise
        raise error(problem.problem, place(problem)) from None


def _pattern_key(problem: ConfigError) -> KeyPath:
    match = _OPTION.search(problem.problem)
    return ("pattern_options", match[1]) if match else ("pattern",)


def _place(problem: ConfigError, part: str, key: str, options: str) -> KeyPath:
    """Return the key for reporting a problem: the option that it mentions, or the name."""
    match = _OPTION.search(problem.problem)
    return (part, options, match[1]) if match else (part, key)


FOLDER = "experiments/scenarios"


def load(name: str, base: Path | None = None) -> Document:
    """Read a scenario by name or path; the data is checked by `build`.

    Raises:
        ConfigError: not found or not YAML.
    """
    return load_yaml(resources.find(name, FOLDER, base=base, is_asked=base is None))


def build(
    source: Document | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> Scenario:
    """Return a scenario from a file or plain data, with some keys changed.

    Args:
        source: Document, whose mistakes are reported with their place, or plain data.
        changes: New values by dotted key, for example `{"link.delay_s": 0.25}`.

    Raises:
        ConfigError: an unknown key, a wrong type, a value out of range, a missing profile.
    """
    return config_overrides.build(Scenario, source, changes, _complete, locate_files)


def _complete(scenario: Scenario, error: Fail) -> Scenario:
    """Return it with what follows from the profiles; refuse what does not go together."""
    if (table := table_of(scenario)) is not None:
        scenario = with_events(scenario, table, error)
    check_names(scenario, error)
    if scenario.site.options and scenario.site.map is None:
        try:
            load_site(scenario.site.name, scenario.site.options)
        except ConfigError as problem:
            raise error(problem.problem, ("site", "options")) from None
    check_phone(phone_profile(scenario, error), error)
    _check_draughts(scenario, error)
    if scenario.dva.regions:
        check_regions(scenario.dva.regions, site_of(scenario, seed=0), error)
    processing = {profile.processing_s for profile in robot_profiles(scenario)}
    if scenario.robot.processing_s is None and len(processing) == 1:
        robot = scenario.robot.model_copy(update={"processing_s": processing.pop()})
        scenario = scenario.model_copy(update={"robot": robot})
    waits = {"request": request_timeout_s(scenario), "command": command_timeout_s(scenario)}
    return scenario.model_copy(
        update={
            key: getattr(scenario, key).model_copy(update={"timeout_s": timeout})
            for key, timeout in waits.items()
        }
    )


def _check_draughts(scenario: Scenario, error: Fail) -> None:
    """Check draughts; their places are on the site, so the site has to be built for it."""
    for number, event in enumerate(scenario.events):
        if "draught" in event.hazard:
            west, south, east, north = site_of(scenario, seed=0).extent
            for end in ("supply", "exhaust"):
                x, y = (float(event.hazard.get(f"{end}_{axis}", 0.0)) for axis in "xy")
                if not (west <= x <= east and south <= y <= north):
                    problem = f"{end} of a draught ({x:g}, {y:g}) is not on the site, which is "
                    extent = f"from ({west:g}, {south:g}) to ({east:g}, {north:g})"
                    raise error(problem + extent, ("events", number, "hazard"))
