"""What one run consists of: site, team, network, phone, events; units are in the keys."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, model_validator

from dva_sim import resources
from dva_sim.agents.guard import GuardProfile
from dva_sim.agents.operator.person import Population
from dva_sim.agents.robot import RobotProfile
from dva_sim.agents.tilt.phone import PhoneProfile
from dva_sim.config import Config, Document, M, Path_, load_yaml, validate
from dva_sim.core.access import LEVELS
from dva_sim.core.rules import Rules
from dva_sim.errors import ConfigError
from dva_sim.network.link import LinkConfig
from dva_sim.worlds.site import Site, load_site, map_site

FOLDER = "experiments/scenarios"

C = TypeVar("C", bound=Config)
Error = Callable[[str, Path_], ConfigError]

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]


class SiteConfig(Config):
    """Where it happens: a site by name or path, or a bare map in ROS map_server form."""

    name: str = "caparica"
    map: str | None = None


class RobotConfig(Config):
    """The robots: how many, which kind, and the limits that keep them safe."""

    profile: str = "servrobot"
    count: Annotated[int, Field(ge=0, le=50)] = 1
    processing_s: Annotated[float, Field(ge=0, le=10)] = 0.05
    watchdog_s: Annotated[float, Field(gt=0, le=60)] = 3.0
    max_age_s: Annotated[float, Field(gt=0, le=120)] = 6.0


class GuardConfig(Config):
    """The guards: how many, and from which profile they are drawn."""

    profile: str = "guard"
    count: Annotated[int, Field(ge=0, le=200)] = 0


class OperatorConfig(Config):
    """The operators: how they drive, and which simulated person each is.

    Attributes:
        person: Index of the first operator's person in the population; the next operator
            is the next person.
        population_seed: Draws the population; a study gives its own seed.
    """

    strategy: str = "pursuit"
    count: Annotated[int, Field(ge=0, le=50)] = 1
    population: str = "operators"
    person: Annotated[int, Field(ge=0)] = 0
    population_seed: Annotated[int, Field(ge=0)] = 1


class CommandConfig(Config):
    """How commands are sent, the same for every pattern.

    Attributes:
        window: How many requests may be unanswered at once under `pipelined`.
    """

    rate_hz: Annotated[float, Field(gt=0, le=100)] = 10.0
    timeout_s: Annotated[float, Field(gt=0, le=120)] = 9.0
    attempts: Annotated[int, Field(ge=1, le=10)] = 3
    window: Annotated[int, Field(ge=2, le=1000)] = 8


class CameraConfig(Config):
    """The robots' cameras: what a frame costs and what it can show."""

    rate_hz: Annotated[float, Field(gt=0, le=60)] = 10.0
    frame_bytes: Annotated[int, Field(ge=100, le=1_000_000)] = 12_000
    field_of_view_deg: Annotated[float, Field(gt=10, le=360)] = 70.0
    range_m: Positive = 6.0


class EventConfig(Config):
    """A fire, a gas leak or a flood.

    Attributes:
        room: Where, by name; left out, the run's seed chooses a room.
        at_s: When it starts.
        latest_s: If given, the seed draws the start between `at_s` and this.
        reported: Whether somebody reports it at once; otherwise detectors must notice it.
        false_alarm: Whether nothing is there: it is reported as it would be, and that is all.
        reports: How many report it; the others are people who see it a little later, and tell
            the place a little otherwise.
    """

    kind: Literal["fire", "gas_leak", "flood"]
    room: str | None = None
    at_s: NonNegative = 0.0
    latest_s: NonNegative | None = None
    reported: bool = False
    false_alarm: bool = False
    reports: Annotated[int, Field(ge=1, le=20)] = 1

    @model_validator(mode="after")
    def _in_order(self) -> EventConfig:
        if self.latest_s is not None and self.latest_s < self.at_s:
            raise ValueError(f"latest_s {self.latest_s:g} is before at_s {self.at_s:g}")
        return self


class DispatchConfig(Config):
    """How the DVA chooses who goes, and the rules that hold whatever is chosen.

    Attributes:
        policy: By name, or as `my_policy.py:Mine`.
        options: Of that policy.
        escalate_after_s: An event that has waited so long for somebody is escalated; 0: at
            once if nobody is free; null: never.
        containment: Whether a confirmed event also needs a guard who deals with it.
        most_waiting: More events than that do not wait: the newest is escalated at once.
        merge_distance_m: Reports of one kind nearer than this are one event; 0: never.
        order_limit_s: Who has not settled an event so long after the order gives it back.
        bid_within_s: How long an auction takes bids.
    """

    policy: str = "min_eta"
    options: dict[str, Any] = Field(default_factory=dict)
    escalate_after_s: NonNegative | None = 120.0
    containment: bool = False
    most_waiting: Annotated[int, Field(ge=0)] | None = None
    merge_distance_m: NonNegative = 8.0
    max_attempts: Annotated[int, Field(ge=1)] = 4
    order_limit_s: Positive = 900.0
    bid_within_s: Positive = 2.0

    def rules(self) -> Rules:
        """As the core wants them."""
        never = math.inf
        return Rules(
            never if self.escalate_after_s is None else self.escalate_after_s,
            self.containment,
            self.most_waiting,
            self.merge_distance_m,
            self.max_attempts,
            self.order_limit_s,
            self.bid_within_s,
        )


class AccessConfig(Config):
    """What some devices may ask for, for a time; what no rule allows is refused.

    Attributes:
        holders: Labels such as `operator-1`; left out: all.
        robots: Labels such as `robot-1`; left out: all.
        levels: `teleoperation`, `missions`, `both`, `sensors`.
        sensors: Names of the sensors that may be read; left out: all.
        from_s: From when on.
        until_s: Up to when; what is in use then is revoked. Left out: for good.
    """

    holders: tuple[str, ...] = ()
    robots: tuple[str, ...] = ()
    levels: tuple[Literal["teleoperation", "missions", "both", "sensors"], ...] = LEVELS
    sensors: tuple[str, ...] | None = None
    from_s: NonNegative = 0.0
    until_s: Positive | None = None


class Scenario(Config):
    """Everything one run needs but its seed.

    Attributes:
        model: Tells this kind of scenario from the timed ones.
    """

    model: Literal["full"] = "full"
    description: str = ""
    site: SiteConfig = SiteConfig()
    robot: RobotConfig = RobotConfig()
    guard: GuardConfig = GuardConfig()
    operator: OperatorConfig = OperatorConfig()
    pattern: Literal["req-rep", "pipelined", "pub-sub", "latest-wins"] = "latest-wins"
    profile: str = "default"
    command: CommandConfig = CommandConfig()
    link: LinkConfig = LinkConfig()
    camera: CameraConfig = CameraConfig()
    events: Annotated[tuple[EventConfig, ...], Field(min_length=1)] = (EventConfig(kind="fire"),)
    dispatch: DispatchConfig = DispatchConfig()
    access: tuple[AccessConfig, ...] = ()
    horizon_s: Annotated[float, Field(gt=0, le=86_400)] = 300.0

    @property
    def window(self) -> int | None:
        """How many commands may be unanswered at once; None if nobody answers them."""
        return {"req-rep": 1, "pipelined": self.command.window}.get(self.pattern)

    @model_validator(mode="after")
    def _somebody_can_act(self) -> Scenario:
        if self.robot.count and not self.operator.count:
            raise ValueError("robots need an operator: operator.count is 0")
        if not self.robot.count and not self.guard.count:
            raise ValueError("nobody can respond: robot.count and guard.count are 0")
        return self

    @model_validator(mode="after")
    def _timeout_admits_the_delay(self) -> Scenario:
        """Below four round trips a retry never gets through: the socket opens anew each time."""
        longest = self.link.delay_s + self.link.jitter_s
        needed = 8 * longest + self.robot.processing_s
        if self.robot.count and self.command.timeout_s <= needed:
            raise ValueError(
                f"command.timeout_s {self.command.timeout_s:g} s should be above four round "
                f"trips and the processing time ({needed:g} s), or link.delay_s be shorter"
            )
        return self


def load(name: str, base: Path | None = None) -> Document:
    """Read a scenario by name or path; the data is checked by `build`.

    Raises:
        ConfigError: not found or not YAML.
    """
    return load_yaml(resources.find(name, FOLDER, base=base))


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
    return resolve(Scenario, source, changes or {}, check_names)


def resolve(
    model: type[C],
    source: Document | Mapping[str, Any],
    changes: Mapping[str, Any],
    check: Callable[[C, Error], object],
) -> C:
    """A configuration with some keys changed, whose mistakes are told with their place.

    Args:
        model: What it is.
        source: A document or plain data.
        changes: New values by dotted key; a number chooses an item of a list.
        check: Looks at what the model alone cannot judge.

    Raises:
        ConfigError: an unknown key, a wrong type, a value out of range, or what `check` finds.
    """
    document = source if isinstance(source, Document) else None
    data = copy.deepcopy(dict(document.data if document else source))  # type: ignore[arg-type]
    for key, value in changes.items():
        set_key(data, key, value)

    def error(problem: str, path: Path_) -> ConfigError:
        dotted = ".".join(str(p) for p in path)
        if document is None or any(dotted == k or dotted.startswith(k + ".") for k in changes):
            return ConfigError(problem)
        return document.error(problem, path)

    locate_policy(data, [document.file.parent] if document else [])
    made = validate(model, data, error)
    check(made, error)
    return made


def locate_policy(data: dict[str, Any], folders: Sequence[Path]) -> None:
    """Let a policy in a file beside the one that names it be found from anywhere."""
    dispatch = data.get("dispatch")
    named = dispatch.get("policy") if isinstance(dispatch, dict) else None
    file, colon, wanted = named.rpartition(":") if isinstance(named, str) else ("", "", "")
    beside = [folder / file for folder in folders if colon and (folder / file).is_file()]
    if beside and isinstance(dispatch, dict):
        dispatch["policy"] = f"{beside[0]}:{wanted}"


def set_key(data: dict[str, Any], key: str, value: Any) -> None:
    """Change one value by dotted key, making the mappings on the way.

    Raises:
        ConfigError: a part of the key names something that is not there, or holds no keys.
    """
    node: Any = data
    above, names = "", key.split(".")
    for depth, name in enumerate(names, 1):
        place: Any = _place_in(node, name, above, key)
        if depth == len(names):
            node[place] = value
        else:
            node = node[place] if isinstance(node, list) else node.setdefault(place, {})
            above = name


def _place_in(node: Any, name: str, above: str, key: str) -> str | int:
    """Where a part of a dotted key leads: a key of a mapping, or an item of a list."""
    if isinstance(node, dict):
        return name
    if not isinstance(node, list):
        raise ConfigError(f"unknown key {key!r}: {above!r} holds no keys")
    if not name.isdigit() or int(name) >= len(node):
        raise ConfigError(f"unknown key {key!r}: {above!r} has items 0 to {len(node) - 1}")
    return int(name)


def check_names(scenario: Scenario, error: Error) -> None:
    """Refuse a profile, strategy or policy that does not exist, before anything runs."""
    from dva_sim.agents.operator.strategies import STRATEGIES

    choices: dict[Path_, tuple[str, Mapping[str, object]]] = {
        ("operator", "strategy"): (scenario.operator.strategy, STRATEGIES),
        ("profile",): (scenario.profile, resources.available("agents/phones")),
        ("robot", "profile"): (scenario.robot.profile, resources.available("agents/robots")),
        ("guard", "profile"): (scenario.guard.profile, resources.available("agents/people")),
        ("operator", "population"): (
            scenario.operator.population,
            resources.available("agents/people"),
        ),
    }
    for path, (given, known) in choices.items():
        if given not in known and not Path(given).is_file():
            key = ".".join(str(p) for p in path)
            raise error(f"{key} {given!r} is unknown; known: {', '.join(sorted(known))}", path)
    check_policy(scenario.dispatch.policy, scenario.dispatch.options, error)


def check_policy(policy: str, options: Mapping[str, Any], error: Error) -> None:
    """Refuse a policy that cannot be loaded, or does not know its options."""
    from dva_sim.core.dispatch import load_policy

    try:
        load_policy(policy, options)
    except ConfigError as problem:
        if problem.file is not None:
            raise
        key = "options" if "option" in problem.problem else "policy"
        raise error(problem.problem, ("dispatch", key)) from None


def site_of(scenario: Scenario, seed: int) -> Site:
    """The site a scenario plays on; a bare map places its bases by `seed`."""
    if scenario.site.map is None:
        return load_site(scenario.site.name)
    team = max(1, scenario.robot.count), max(1, scenario.guard.count)
    return map_site(scenario.site.map, seed, robots=team[0], guards=team[1])


def robot_profile(scenario: Scenario) -> RobotProfile:
    """Mass, size and limits of the scenario's robots."""
    return _profile(RobotProfile, scenario.robot.profile, "agents/robots")


def phone_profile(scenario: Scenario) -> PhoneProfile:
    """The tilt phone the operators hold."""
    return _profile(PhoneProfile, scenario.profile, "agents/phones")


def guard_profile(scenario: Scenario) -> GuardProfile:
    """How the scenario's guards are drawn."""
    return _profile(GuardProfile, scenario.guard.profile, "agents/people")


def population(scenario: Scenario) -> Population:
    """The population that the scenario's operators are drawn from."""
    return _profile(Population, scenario.operator.population, "agents/people")


def _profile(model: type[M], name: str, folder: str) -> M:
    profile = _read_profile(model, name, folder)
    assert isinstance(profile, model)
    return profile


@cache
def _read_profile(model: type[Config], name: str, folder: str) -> Config:
    """A profile, read once per process: reading costs more than a short run."""
    document = load_yaml(resources.find(name, folder))
    return validate(model, document.data, document.error)
