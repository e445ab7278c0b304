"""Names in a timed scenario: each must mean something, before anything runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dva_sim.config import Fail, Path_
from dva_sim.errors import ConfigError
from dva_sim.guesses import unknown
from dva_sim.scenario import check_policy

if TYPE_CHECKING:
    from dva_sim.timed.scenario import TimedScenario


def check_names(scenario: TimedScenario, error: Fail) -> TimedScenario:
    """Refuse names that mean nothing, before anything runs.

    Raises:
        ConfigError: an unknown site, zone, responder, station or policy.
    """
    zones = zone_names(scenario, error)
    for number, stream in enumerate(scenario.demand):
        _known(stream.zones, zones, "zone", ("demand", number, "zones"), error)
        if stream.notice == "detectors" and scenario.site is None:
            raise error("notice 'detectors' needs a site", ("demand", number, "notice"))
    dispatch = scenario.dispatch
    _known(dispatch.preferences, zones, "zone", ("dispatch", "preferences"), error)
    for zone, names in dispatch.preferences.items():
        path = ("dispatch", "preferences", zone)
        _known(names, scenario.names, "responder", path, error)
    for zone in sorted({z for s in scenario.demand for z in s.zones or zones}):
        if dispatch.preferences and zone not in dispatch.preferences:
            problem = f"preferences has no list for zone {zone!r}"
            raise error(problem, ("dispatch", "preferences"))
    _check_places(scenario, zones, error)
    if dispatch.policy != "oracle":  # which is made from the run's own luck
        check_policy(dispatch.policy, dispatch.options, error)
    return scenario


def zone_names(scenario: TimedScenario, error: Fail) -> list[str]:
    """Names of the zones, in order."""
    if scenario.site is None:
        return list(scenario.zones) or ["area" if scenario.area else "here"]
    from dva_sim.worlds.site import load_site

    try:
        return [room.name for room in load_site(scenario.site.name).rooms]
    except ConfigError as problem:
        if problem.file is not None:
            raise
        raise error(problem.problem, ("site", "name")) from None


def _known(names: Any, known: list[str], what: str, path: Path_, error: Fail) -> None:
    for name in names:
        if name not in known:
            raise error(unknown(what, name, known), (*path, name))


def _check_places(scenario: TimedScenario, zones: list[str], error: Fail) -> None:
    stations = [s.name for s in scenario.dispatch.stations]
    places: list[tuple[Any, Path_, list[str]]] = [
        (group.base, ("responders", number, "base"), stations)
        for number, group in enumerate(scenario.responders)
    ]
    places += [
        (station.at, ("dispatch", "stations", number, "at"), [])
        for number, station in enumerate(scenario.dispatch.stations)
    ]
    for place, path, names in places:
        if isinstance(place, str) and not _names_place(place, scenario, [*zones, *names]):
            known = ["random", *(["post", "robot_base"] if scenario.site else []), *names, *zones]
            raise error(unknown("place", place, known), path)


def _names_place(place: str, scenario: TimedScenario, names: list[str]) -> bool:
    if place in names or place == "random":
        return True
    what, _, number = place.partition("-")
    if scenario.site is None or what not in ("post", "robot_base"):
        return False
    return not number or (number.isdigit() and int(number) > 0)
