"""How a scenario is read, completed and checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dva_sim import changing, resources
from dva_sim.config import Document, Fail, load_yaml
from dva_sim.errors import ConfigError
from dva_sim.scenario.names import check_names, check_phone, locate_files
from dva_sim.scenario.patience import command_timeout_s, request_timeout_s
from dva_sim.scenario.profiles import phone_profile, robot_profiles, site_of
from dva_sim.scenario.scenario import Scenario
from dva_sim.worlds.site import load_site

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
    """A scenario from a file or plain data, with some keys changed.

    Args:
        source: A document (mistakes are told with their place) or plain data.
        changes: New values by dotted key, for example `{"link.delay_s": 0.25}`.

    Raises:
        ConfigError: an unknown key, a wrong type, a value out of range, a missing profile.
    """
    return changing.build(Scenario, source, changes or {}, _complete, locate_files)


def _complete(scenario: Scenario, error: Fail) -> Scenario:
    """With what follows from the profiles; refuses what does not go together."""
    check_names(scenario, error)
    _check_options(scenario, error)
    check_phone(phone_profile(scenario, error), error)
    _check_draughts(scenario, error)
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


def _check_options(scenario: Scenario, error: Fail) -> None:
    """Options of a site say what it becomes, so it has to be made to judge them."""
    if scenario.site.options and scenario.site.map is None:
        try:
            load_site(scenario.site.name, scenario.site.options)
        except ConfigError as problem:
            raise error(problem.problem, ("site", "options")) from None


def _check_draughts(scenario: Scenario, error: Fail) -> None:
    """Where a draught blows is on the site, so it has to be made to judge that."""
    for number, event in enumerate(scenario.events):
        if "draught" in event.hazard:
            west, south, east, north = site_of(scenario, seed=0).extent
            for end in ("supply", "exhaust"):
                x, y = (float(event.hazard.get(f"{end}_{axis}", 0.0)) for axis in "xy")
                if not (west <= x <= east and south <= y <= north):
                    problem = f"{end} of a draught ({x:g}, {y:g}) is not on the site, which is "
                    extent = f"from ({west:g}, {south:g}) to ({east:g}, {north:g})"
                    raise error(problem + extent, ("events", number, "hazard"))
