"""Scenario of one timed run; units are in the keys, and names are checked.

Nobody drives and nothing is sent over a network: responders are travel and service times. What
is asked, decided and answered is the DVA's own core, so that a queue known from the books is a
scenario of this kind, and so is a shift on a site with guards, robots and operators.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from dva_sim.kernel import config_overrides
from dva_sim.kernel.config import Config, Fail, Key, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.kernel.yaml_files import Document, KeyPath
from dva_sim.protocol.event_kinds import EventKind
from dva_sim.simulation.scenario import check_policy, locate_files
from dva_sim.simulation.scenario.alarms import why_not
from dva_sim.simulation.scenario.event_table import (
    EventTableConfig,
    Ground,
    TableEvents,
    WithTable,
    read_events,
)
from dva_sim.simulation.timed.distributions import ZERO, Constant, Law
from dva_sim.worlds.site import load_site


def check_names(scenario: TimedScenario, error: Fail) -> TimedScenario:
    """Refuse names that mean nothing, before anything runs.

    Raises:
        ConfigError: an unknown site, zone, responder, station or policy.
    """
    zones = zone_names(scenario, error)
    for number, stream in enumerate(scenario.demand):
        _known(stream.zones, zones, "zone", ("demand", number, "zones"), error)
        for event, listed in enumerate(stream.listed):
            if listed.zone is not None and listed.zone not in zones:
                where: KeyPath = ("demand", number, "listed", event, "zone")
                raise error(unknown("zone", listed.zone, zones), where)
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
    if dispatch.policy != "oracle":  # which is made from the run's own random numbers
        check_policy(dispatch.policy, dispatch.options, error)
    return scenario


def zone_names(scenario: TimedScenario, error: Fail) -> list[str]:
    """Return names of the zones, in order."""
    if scenario.site is None:
        return list(scenario.zones) or ["area" if scenario.area else "here"]

    try:
        return [room.name for room in load_site(scenario.site.name).rooms]
    except ConfigError as problem:
        if problem.file is not None:
            raise
        raise error(problem.problem, ("site", "name")) from None


def _known(names: Any, valid: list[str], what: str, path: KeyPath, error: Fail) -> None:
    for name in names:
        if name not in valid:
            raise error(unknown(what, name, valid), (*path, name))


def _check_places(scenario: TimedScenario, zones: list[str], error: Fail) -> None:
    stations = [s.name for s in scenario.dispatch.stations]
    places: list[tuple[Any, KeyPath, list[str]]] = [
        (group.base, ("responders", number, "base"), stations)
        for number, group in enumerate(scenario.responders)
    ]
    places += [
        (station.at, ("dispatch", "stations", number, "at"), [])
        for number, station in enumerate(scenario.dispatch.stations)
    ]
    for place, path, names in places:
        if isinstance(place, str) and not _names_place(place, scenario, [*zones, *names]):
            valid = ["random", *(["post", "robot_base"] if scenario.site else []), *names, *zones]
            raise error(unknown("place", place, valid), path)


def _names_place(place: str, scenario: TimedScenario, names: list[str]) -> bool:
    if place in names or place == "random":
        return True
    what, _, number = place.partition("-")
    if scenario.site is None or what not in ("post", "robot_base"):
        return False
    return not number or (number.isdigit() and int(number) > 0)


def with_alarms(scenario: TimedScenario, error: Fail) -> TimedScenario:
    """Return the scenario with the alarms of its table as streams, one for each kind.

    Raises:
        ConfigError: see `read_events`.
    """
    table_rows = table_events(scenario, error)
    by_kind: dict[str, list[ListedEvent]] = {}
    for alarm in table_rows.alarms:
        by_kind.setdefault(alarm.kind, []).append(
            ListedEvent(
                at_s=alarm.at_s,
                zone=alarm.room,
                position=alarm.position,
                severity=alarm.severity,
                confidence=alarm.confidence,
                false_alarm=alarm.false_alarm,
            )
        )
    taken = set(scenario.stream_names)
    streams = []
    for kind, events in by_kind.items():
        name = f"{kind}_table" if kind in taken else ""
        data = {"kind": kind, "name": name or kind, "listed": events}
        streams.append(validate(EventStream, data, lambda p, _: error(p, ("events", "kinds"))))
    scenario = scenario.model_copy(update={"demand": (*scenario.demand, *streams), "events": None})
    scenario.tell(table_rows)
    return scenario


def table_events(scenario: TimedScenario, error: Fail) -> TableEvents:
    """Return the alarms of a scenario's table, and remarks on them; raises as `read_events`."""
    assert scenario.events is not None

    def fail(problem: str, path: KeyPath) -> ConfigError:
        return error(problem, ("events", *path))

    return read_events(scenario.events, scenario.horizon_s, _ground_of(scenario, error), fail)


def _ground_of(scenario: TimedScenario, error: Fail) -> Ground:
    zones = zone_names(scenario, error)
    if scenario.site is not None:
        site = load_site(scenario.site.name)
        return Ground(zones, True, site.frame.to_xy, lambda x, y: why_not(site, x, y), site.room_at)
    area = scenario.area
    if area is None:
        return Ground(zones, False, None, lambda x, y: "", lambda x, y: None)
    width = area.width_m
    height = area.height_m

    def outside(x: float, y: float) -> str:
        inside = 0 <= x <= width and 0 <= y <= height
        return "" if inside else f"is outside the area, which is {width:g} m by {height:g} m"

    def zone_at(x: float, y: float) -> str | None:
        boxes = scenario.zones.items()
        within = (n for n, (a, b, c, d) in boxes if a <= x <= c and b <= y <= d)
        return next(within, None if scenario.zones else zones[0])

    return Ground(zones, True, None, outside, zone_at)


Name = Annotated[str, Field(min_length=1, max_length=40)]
Share = Annotated[float, Field(ge=0, le=1)]
NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Limit = Annotated[float, Field(ge=0, allow_inf_nan=True)] | None
Point = tuple[float, float]
Box = tuple[float, float, float, float]

LOOK_S = Constant(mean_s=0.0)
ACT_S = Constant(mean_s=0.0)
MAX_UNITS = 2000


class TimedSite(Config):
    """A site whose rooms are the zones.

    Attributes:
        name: Name or path.
        spots: Events happen at so many places of each room; ways to them are planned once.
    """

    name: str = "caparica"
    spots: Annotated[int, Field(ge=1, le=50)] = 4


class Area(Config):
    """A bare rectangle with a corner at x = y = 0."""

    width_m: Positive
    height_m: Positive


class Group(Config):
    """Responders that are alike.

    Attributes:
        name: Members are `NAME-1`, `NAME-2`, ...; a group of one is just `NAME`.
        base: `[x, y]`; `post` (guard posts) or `robot_base` of the site, in turn; the name of a
            station or zone; or `random`: anywhere, by the run's seed. Left out, the post or
            robot base on a site, the middle of an area.
        speed_mps: The mean, and what the DVA expects.
        speed_sd_mps: Between members.
        mobilisation: Time from the order to the first step.
        look: Time from arrival to certainty, unless the event says otherwise.
        act: Time for a person to contain an event, unless the event sets another.
        after: `stay` where the event was; `return` to base and be busy until there; or `recall`:
            walk back, but take orders on the way.
        from_s: Start of the shift.
    """

    name: Name
    kind: Literal["guard", "robot"] = "guard"
    count: Annotated[int, Field(ge=1, le=MAX_UNITS)] = 1
    base: Point | str | None = None
    speed_mps: Positive = 1.0
    speed_sd_mps: NonNegative = 0.0
    mobilisation: Law = ZERO
    look: Law = LOOK_S
    act: Law = ACT_S
    after: Literal["stay", "return", "recall"] = "stay"
    from_s: NonNegative = 0.0

    @model_validator(mode="after")
    def _robots_are_driven(self) -> Group:
        if self.kind == "robot" and self.after == "recall":
            raise ValueError("a robot is driven back by its operator: after is stay or return")
        return self


class Operators(Config):
    """Drivers of the robots."""

    count: Annotated[int, Field(ge=0, le=MAX_UNITS)] = 0


class Severity(Config):
    """Anything between two bounds."""

    low: Share
    high: Share


class Sources(Config):
    """A fixed number of sources; each brings its next event `rest` after its last was closed."""

    count: Annotated[int, Field(ge=1, le=10_000)]
    rest: Law


class Batch(Config):
    """A number of events at once."""

    count: Annotated[int, Field(ge=1, le=5000)]
    at_s: NonNegative = 0.0


class Repeats(Config):
    """Some events are reported once more, by another source, `after` the first report."""

    share: Share
    after: Law = ZERO


class ListedEvent(Config):
    """An event at a certain time.

    Attributes:
        zone: Zone in which it is; by default as the stream says.
        position: Its place x, y [m].
        severity: Reported severity; by default as the stream says.
        confidence: Reported confidence; by default as the stream says.
        false_alarm: True for a false alarm.
    """

    at_s: NonNegative
    zone: str | None = None
    position: Point | None = None
    severity: Share | None = None
    confidence: Share | None = None
    false_alarm: bool = False


class EventStream(Config):
    """Events of one class, one after the other.

    Attributes:
        name: Name of the stream; by default the kind.
        between: Time from one event to the next; exponential: a Poisson process.
        sources: Finite number of sources, in place of `between`.
        batch: Simultaneous events, in place of `between`.
        zones: Zones of the events, with weights. By default anywhere: uniform over the area, or
            over the rooms of the site.
        notice: Time from the outbreak to the first report; `detectors`: until a detector of the
            site notices.
        severity: Reported severity.
        confidence: Reported confidence.
        false_share: Share of false alarms.
        look: Law of this time, in place of the responders' own.
        act: Law of this time, in place of the responders' own.
        patience: Time after the report at which its sender withdraws it.
        repeats: Doubled reports.
        from_s: The first event comes one interval after this.
        until_s: No event after this; left out, the horizon.
        listed: Certain events in order of time, in place of `between`.
    """

    kind: EventKind = "fire"
    name: Name = ""
    between: Law | None = None
    sources: Sources | None = None
    batch: Batch | None = None
    zones: dict[str, Positive] = Field(default_factory=dict)
    notice: Literal["detectors"] | Law = ZERO
    severity: Share | Severity = 0.5
    confidence: Share = 0.9
    false_share: Share = 0.0
    look: Law | None = None
    act: Law | None = None
    patience: Law | None = None
    repeats: Repeats | None = None
    from_s: NonNegative = 0.0
    until_s: Positive | None = None
    listed: tuple[ListedEvent, ...] = ()

    @model_serializer(mode="wrap")
    def _as_before(self, usual: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Dump listed events only where there are any, so that hashes stay the same."""
        written: dict[str, Any] = usual(self)
        if not self.listed:
            written.pop("listed", None)
        return written

    @model_validator(mode="after")
    def _one_origin(self) -> EventStream:
        origins = [self.between, self.sources, self.batch, self.listed or None]
        if sum(g is not None for g in origins) != 1:
            raise ValueError("a stream needs one of between, sources, batch and listed")
        if isinstance(self.between, Constant) and self.between.mean_s <= 0:
            raise ValueError("between should be longer than 0 s")
        return self


class Station(Config):
    """A place where guards may wait: `[x, y]`, `post-2`, or a zone's name."""

    name: Name
    at: Point | str


class TimedDispatch(Config):
    """The policy and the rules.

    Attributes:
        policy: Name, or `file.py:Class`.
        options: Options of the policy.
        escalate_after_s: Time that an event may wait; 0: not at all; `.inf` or null: forever.
        containment: True if a confirmed event needs a person to contain it.
        most_waiting: Maximum number of waiting events.
        merge_distance_m: Reports so near each other are one event; left out, 8 m on a site,
            elsewhere 1 m if events are reported twice, and else 0 (never).
        max_attempts: Orders for one event.
        order_limit_s: Time limit of an order; by default none.
        bid_within_s: Time for which bids are taken.
        preferences: Names of responders in order of preference, by zone.
        stations: Places where guards may wait.
    """

    policy: Annotated[str, Key("dispatch policy")] = "min_eta"
    options: dict[str, Any] = Field(default_factory=dict)
    escalate_after_s: Limit = None
    containment: bool = False
    most_waiting: Annotated[int, Field(ge=0)] | None = None
    merge_distance_m: NonNegative | None = None
    max_attempts: Annotated[int, Field(ge=1, le=1_000_000)] = 4
    order_limit_s: Limit = None
    bid_within_s: NonNegative = 2.0
    preferences: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    stations: tuple[Station, ...] = ()


class TimedScenario(WithTable):
    """Everything one run needs but its seed.

    Attributes:
        model: Name of this kind of scenario.
        site: Site of the run, if there is one.
        area: Size of the area, if there is one; without site and area, place does not matter.
        zones: Named parts of an area: xmin, ymin, xmax, ymax [m].
        travel: `none`: no time; `straight`; `path`: planned on the site; or a law: a time for
            each pair of an event and a responder. Left out, whatever the ground allows best.
        demand: Streams of events; may be left out with a table of events.
        events: Table of dated alarms, which become streams, one for each kind.
        intensity: Events of every stream with a `between` come so many times as often.
        warm_up_s: Initial time that is not measured.
        horizon_s: No event after this.
        max_events: No event after so many.
        drain: Go on after the horizon until every event is closed.
        keep: `events`: a row for each; `batches`: sums only, for very long runs.
        batches: Number of equal parts of the measured time.
    """

    model: Literal["timed"]
    description: str = ""
    site: TimedSite | None = None
    area: Area | None = None
    zones: dict[str, Box] = Field(default_factory=dict)
    travel: Literal["none", "straight", "path"] | Law | None = None
    responders: Annotated[tuple[Group, ...], Field(min_length=1)]
    operators: Operators = Operators()
    demand: tuple[EventStream, ...] = ()
    events: EventTableConfig | None = None
    dispatch: TimedDispatch = TimedDispatch()
    intensity: Annotated[Positive, Key("rate of alarms", stated=False)] = 1.0
    warm_up_s: NonNegative = 0.0
    horizon_s: Annotated[float, Field(gt=0, le=1e11)] = 86_400.0
    max_events: Annotated[int, Field(ge=1)] | None = None
    drain: bool = False
    keep: Literal["events", "batches"] = "events"
    batches: Annotated[int, Field(ge=1, le=10_000)] = 20

    @property
    def way(self) -> Literal["none", "straight", "path"] | Law:
        """Law of travel times."""
        if self.travel is not None:
            return self.travel
        return "path" if self.site else "straight" if self.area else "none"

    def members(self, group: Group) -> list[str]:
        """Return names of a group's responders."""
        if group.count == 1:
            return [group.name]
        return [f"{group.name}-{number}" for number in range(1, group.count + 1)]

    @property
    def merge_distance(self) -> float:
        """Reports so near each other are one event [m]."""
        if self.dispatch.merge_distance_m is not None:
            return self.dispatch.merge_distance_m
        return 8.0 if self.site else 1.0 if any(s.repeats for s in self.demand) else 0.0

    @property
    def names(self) -> list[str]:
        """Names of all responders, in order."""
        return [name for group in self.responders for name in self.members(group)]

    @property
    def stream_names(self) -> list[str]:
        """Names of all streams, in order."""
        return [stream.name or stream.kind for stream in self.demand]

    @model_serializer(mode="wrap")
    def _as_before(self, usual: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Dump no table where there is none, so that hashes stay the same."""
        written: dict[str, Any] = usual(self)
        if self.events is None:
            written.pop("events", None)
        return written

    @model_validator(mode="after")
    def _something_happens(self) -> TimedScenario:
        if not self.demand and self.events is None:
            raise ValueError("nothing happens: give demand, or events with a table")
        return self

    @model_validator(mode="after")
    def _ground(self) -> TimedScenario:
        if self.site and self.area:
            raise ValueError("a scenario has a site or an area, not both")
        if self.zones and not self.area:
            raise ValueError("zones belong to an area; on a site the rooms are the zones")
        if self.travel == "path" and not self.site:
            raise ValueError("travel 'path' needs a site")
        if self.travel == "straight" and not (self.site or self.area):
            raise ValueError("travel 'straight' needs a site or an area")
        for name, (left, low, right, high) in self.zones.items():
            if right < left or high < low:
                raise ValueError(f"zone {name!r} should be xmin, ymin, xmax, ymax")
        return self

    @model_validator(mode="after")
    def _team(self) -> TimedScenario:
        for what, names in (("responder", self.names), ("stream", self.stream_names)):
            twice = next((n for n in names if names.count(n) > 1), None)
            if twice is not None:
                raise ValueError(f"there are two {what}s {twice!r}: give them different names")
        if any(g.kind == "robot" for g in self.responders) and not self.operators.count:
            raise ValueError("robots need an operator: operators.count is 0")
        if self.dispatch.containment and all(g.kind == "robot" for g in self.responders):
            raise ValueError("containment needs guards: robots only look")
        if not self.merge_distance and any(s.repeats for s in self.demand):
            raise ValueError("repeats need dispatch.merge_distance_m above 0, to be known as such")
        if self.warm_up_s >= self.horizon_s:
            raise ValueError(
                f"warm_up_s {self.warm_up_s:g} should be before horizon_s {self.horizon_s:g}"
            )
        return self


def build(
    source: Document | Mapping[str, Any], changes: Mapping[str, Any] | None = None
) -> TimedScenario:
    """Return a scenario from a file or plain data, with some keys changed.

    Args:
        source: Document, whose mistakes are reported with their place, or plain data.
        changes: New values by dotted key, for example `{"dispatch.policy": "batch"}`; a number
            chooses an item of a list: `{"responders.0.count": 3}`.

    Raises:
        ConfigError: an unknown key or name, a wrong type, a value out of range.
    """
    return config_overrides.build(TimedScenario, source, changes, _complete, locate_files)


def _complete(scenario: TimedScenario, error: Fail) -> TimedScenario:
    if scenario.events is not None:
        scenario = with_alarms(scenario, error)
    return check_names(scenario, error)


def limit_of(value: float | None) -> float:
    """Return a time limit [s]; none is infinite."""
    return math.inf if value is None else value
