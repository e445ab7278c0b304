"""Everything one run needs but its seed, with the site and the profiles that a scenario names."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, cast

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from dva_sim.agents.people.profiles import BystanderProfile, GuardProfile
from dva_sim.agents.population import Population, with_medians
from dva_sim.agents.robot.profile import RobotProfile, load_robot
from dva_sim.agents.tilt import PhoneProfile
from dva_sim.kernel import resources
from dva_sim.kernel.config import AlsoCalled, Config, Fail, Key, M, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import Document, KeyPath, load_yaml
from dva_sim.network.connections import Depth, TransportKind, ZeromqConfig
from dva_sim.network.link import LinkConfig
from dva_sim.network.patterns import Pattern, load_pattern
from dva_sim.protocol.event_kinds import EventKind
from dva_sim.simulation.scenario.event_table import OrTable, WithTable
from dva_sim.simulation.scenario.parts import (
    AccessConfig,
    BystanderConfig,
    CameraConfig,
    CommandConfig,
    DispatchConfig,
    DisturbanceConfig,
    DvaConfig,
    EmergencyConfig,
    EventConfig,
    GuardConfig,
    OperatorConfig,
    PatrolConfig,
    PhoneConfig,
    RequestConfig,
    RobotConfig,
    SiteConfig,
)
from dva_sim.worlds.site import FOOTPRINT, Site, load_site, map_site, with_places

NEWER = (
    ("pattern_options",),
    ("dispatch", "depart_within_s", "still_within_s", "mode", "decide_within_s", "person"),
    ("command", "heeds"),
    ("guard", "kind"),
    ("operator", "kind"),
    ("disturbance",),
    ("dva",),
    ("dva", "control_rooms", "severity", "regions", "deaths", "backbone"),
    ("emergency",),
    ("instructions",),
)
"""Keys that came after results were published: a part, or some keys of one."""


class Scenario(WithTable):
    """Everything one run needs but its seed.

    Attributes:
        model: Name of this kind of scenario.
        control: Mode of control. `direct`: operators close the loop over the link. `coordinated`:
            the robot also watches its path, and slows down by itself. `supervisory`: operators name
            the goal and judge the picture, and the robot drives alone.
        pattern: Messaging pattern of the commands: by name, or a class in a file, `mine.py:Mine`.
        pattern_options: Options of the pattern, such as `{every: 5}` of one that requests now and
            then.
        transport: Transport of the messages: ZeroMQ over TCP, or datagrams.
        events: List of events, or a table of dated alarms.
        instructions: Text file for people at a console by kind of event, such as `{fire: fire.md}`,
            beside the scenario; lines of a list are steps that they tick.
        network_depth: Depth of the model of ZeroMQ over TCP: whole messages, exact where nothing is
            lost or queued; TCP segments; or as each link requires.
    """

    model: Literal["full"] = "full"
    description: str = ""
    site: SiteConfig = SiteConfig()
    robot: RobotConfig = RobotConfig()
    guard: GuardConfig = GuardConfig()
    bystander: BystanderConfig = BystanderConfig()
    operator: OperatorConfig = OperatorConfig()
    control: Annotated[Literal["direct", "coordinated", "supervisory"], Key("control")] = "direct"
    pattern: Annotated[
        str,
        AlsoCalled("messaging", "messaging_pattern", "protocol"),
        Key("messaging pattern"),
    ] = "latest-wins"
    pattern_options: dict[str, Any] = Field(default_factory=dict)
    phone: PhoneConfig = PhoneConfig()
    command: CommandConfig = CommandConfig()
    request: RequestConfig = RequestConfig()
    transport: Annotated[TransportKind, Key("transport")] = "zeromq"
    zeromq: ZeromqConfig = ZeromqConfig()
    network_depth: Annotated[Depth, Key("depth of the network model", stated=False)] = "auto"
    link: LinkConfig = LinkConfig()
    camera: CameraConfig = CameraConfig()
    disturbance: DisturbanceConfig = DisturbanceConfig()
    events: Annotated[tuple[EventConfig, ...], Field(min_length=1), OrTable()] = (
        EventConfig(kind="fire"),
    )
    instructions: dict[EventKind, str] = Field(default_factory=dict)
    dispatch: DispatchConfig = DispatchConfig()
    access: tuple[AccessConfig, ...] = ()
    dva: DvaConfig = DvaConfig()
    emergency: EmergencyConfig = EmergencyConfig()
    patrols: tuple[PatrolConfig, ...] = ()
    horizon_s: Annotated[
        float,
        Field(ge=0.001, le=86_400),
        AlsoCalled("duration_s", "time_limit_s", "length_s"),
        Key("longest time of a run"),
    ] = 300.0

    @model_serializer(mode="wrap")
    def _as_before(self, usual: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Dump newer keys only where they differ from the default, so that hashes stay the same."""
        written: dict[str, Any] = usual(self)
        for part, *keys in NEWER:
            ours = getattr(self, part)
            usually = type(self).model_fields[part].get_default(call_default_factory=True)
            if not keys and ours == usually:
                written.pop(part, None)
            for key in keys:
                if part in written and getattr(ours, key) == getattr(usually, key):
                    written[part].pop(key, None)
        return written

    @model_validator(mode="after")
    def _somebody_can_act(self) -> Scenario:
        if self.robot.count and not self.operator.count:
            raise ValueError("robots need an operator: operator.count is 0")
        if not self.robot.count and not self.guard.count:
            raise ValueError("nobody can respond: robot.count and guard.count are 0")
        operators = {f"operator-{number}" for number in range(1, self.operator.count + 1)}
        for name in self.dva.supervisors:
            if ":" not in name and name not in operators:
                raise ValueError(f"dva.supervisors: {unknown('operator', name, operators)}")
        return self


def pattern_of(scenario: Scenario) -> Pattern:
    """Return the messaging pattern of a scenario, for its attributes.

    Raises:
        ConfigError: there is no such pattern, or it does not know its options.
    """
    return load_pattern(scenario.pattern, scenario.pattern_options)()


def site_of(scenario: Scenario, seed: int) -> Site:
    """Return the site a scenario plays on; bases and posts that it has not are placed by `seed`.

    Raises:
        ConfigError: the site cannot be read, or has no room for so many.
    """
    robot = scenario.robot
    guard = scenario.guard
    radius = max((each.radius_m for each in robot_profiles(scenario)), default=FOOTPRINT)
    if scenario.site.map is not None:
        team = max(1, robot.count), max(1, guard.count)
        return map_site(scenario.site.map, seed, *team, radius)
    site = load_site(scenario.site.name, scenario.site.options)
    at_bases = robot.count if robot.way_m is None else 0
    at_posts = guard.count if guard.way_m is None else 0
    return with_places(site, seed, at_bases, at_posts, radius)


def robot_profiles(scenario: Scenario) -> list[RobotProfile]:
    """Return the profiles of the scenario's robots, in order."""
    named = scenario.robot.profile
    names = (named,) if isinstance(named, str) else named
    kinds = [load_robot(name) for name in names]
    return [kinds[number % len(kinds)] for number in range(scenario.robot.count)]


def phone_profile(scenario: Scenario, error: Fail | None = None) -> PhoneProfile:
    """Return the tilt phone the operators hold: its profile, and what the scenario changes of it.

    Args:
        scenario: Names the profile.
        error: Function that makes the error for a change that is not valid, at its key path.

    Raises:
        ConfigError: no such profile, or a change that is not valid.
    """
    phone = scenario.phone
    if not phone.changes:
        return _profile(PhoneProfile, phone.profile, "agents/phones")

    def wrong(problem: str, path: KeyPath) -> ConfigError:
        text = f"phone: {problem}"
        return error(text, ("phone", *path)) if error else ConfigError(text)

    data = _merged(_read_document(phone.profile, "agents/phones").data, phone.changes)
    return validate(PhoneProfile, data, wrong)


def guard_profile(scenario: Scenario) -> GuardProfile:
    """Return the profile from which the scenario's guards are drawn.

    Raises:
        ConfigError: there is no such profile or trait.
    """
    guard = scenario.guard
    profile = _profile(GuardProfile, guard.profile, "agents/people")
    if guard.mobilisation_s is not None:
        profile = with_medians(profile, {"mobilisation_s": guard.mobilisation_s}, "guard")
    return _changed(profile, guard, "guard")


def bystander_profile(scenario: Scenario) -> BystanderProfile:
    """Return the profile from which the scenario's bystanders are drawn.

    Raises:
        ConfigError: there is no such profile or trait.
    """
    profile = _profile(BystanderProfile, scenario.bystander.profile, "agents/people")
    return _changed(profile, scenario.bystander, "bystander")


def population(operator: OperatorConfig) -> Population:
    """Return the population that persons are drawn from, with the medians and habits set otherwise.

    Raises:
        ConfigError: there is no such population or trait.
    """
    people = _profile(Population, operator.population, "agents/people")
    return _changed(people, operator, "operator")


Drawn = TypeVar("Drawn", Population, GuardProfile, BystanderProfile)


def _changed(
    profile: Drawn, by: OperatorConfig | GuardConfig | BystanderConfig, whose: str
) -> Drawn:
    """Return a profile with the medians and habits that a scenario sets otherwise."""
    profile = with_medians(profile, by.traits, whose)
    habits = profile.habits.changed_by(by.habits)
    return profile if habits is profile.habits else profile.model_copy(update={"habits": habits})


def _profile(model: type[M], name: str, folder: str) -> M:
    profile = _read_profile(model, name, folder)
    assert isinstance(profile, model)
    return profile


@cache
def _read_profile(model: type[Config], name: str, folder: str) -> Config:
    """Return a profile, read once per process: reading costs more than a short run."""
    document = _read_document(name, folder)
    return validate(model, document.data, document.error)


@cache
def _read_document(name: str, folder: str) -> Document:
    return load_yaml(resources.find(name, folder))


def _merged(data: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data with some values changed, mappings within it key by key."""
    merged = dict(data)
    for key, value in changes.items():
        old = merged.get(key)
        nested = isinstance(old, Mapping) and isinstance(value, Mapping)
        merged[key] = _merged(cast(Mapping[str, Any], old), value) if nested else value
    return merged
