"""Parts of a scenario; units are in the keys, and `Key` gives their names."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from dva_sim.agents.control_room.profile import DispatcherProfile, RoleName
from dva_sim.agents.habits import BystanderHabits, GuardHabits, OperatorHabits
from dva_sim.agents.robot.command_queue import ServiceTime
from dva_sim.agents.robot.sensors import FASTEST, SLOWEST, SensorConfig
from dva_sim.agents.tilt import PhoneProfile
from dva_sim.core.assignments import Rules
from dva_sim.core.permissions import LEVELS
from dva_sim.kernel.assumed import OmitsUnset
from dva_sim.kernel.config import AlsoCalled, Config, Key
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown
from dva_sim.network.link import LinkConfig
from dva_sim.protocol.messages import ReleasedBy
from dva_sim.worlds.hazards import KINDS, make_hazard

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
OwnTraits = dict[str, NonNegative]
"""Medians of traits by name; whether they are known is judged where the profile is read."""
CONTROL_ROOM = r"^(control-room-[1-9][0-9]?|[0-9A-F]{2}(:[0-9A-F]{2}){5})$"
SUPERVISOR = r"^(operator-[1-9][0-9]*|[0-9A-F]{2}(:[0-9A-F]{2}){5})$"
REGION = r"^[a-z][a-z0-9-]{0,31}$"
AnyNumber = Annotated[float, Field(allow_inf_nan=True)]  # `make_hazard` says what is wrong with it


class SiteConfig(Config):
    """Site by name or path, or a bare map in ROS map_server form.

    Attributes:
        options: Options of a generated site, such as `{seed: 7, width_m: 80}`.
    """

    name: str = "caparica"
    options: dict[str, Any] = Field(default_factory=dict)
    map: str | None = None

    @model_validator(mode="after")
    def _one_place(self) -> SiteConfig:
        if self.map is not None and self.name != SiteConfig.model_fields["name"].default:
            raise ValueError(f"site.map and site.name {self.name!r} are two places; leave out one")
        if self.map is not None and self.options:
            raise ValueError("site.options are of a generated site: site.map takes none")
        return self


class RobotConfig(Config):
    """The robots: how many, which kind, and the limits that keep them safe.

    Attributes:
        profile: Profile of all, or a list: the first robot has the first, and so on in turn.
        processing_s: Time a message takes a robot's computer, a number or a law such as
            `{law: gamma, mean_s: 0.2, cv: 0.5, first_s: 2}`; left out: as its profile says.
        sensors: Sensors that they carry; by default those of their profile.
        charge: Share of the battery's capacity that they begin with.
        way_m: They begin at places from which the way to the first event is so long, rather than
            at the site's bases. Those for whom the site has no base begin where it is free.
    """

    profile: Annotated[str | Annotated[tuple[str, ...], Field(min_length=1)], Key("robot")] = (
        "servrobot"
    )
    count: Annotated[int, Field(ge=0, le=1000), AlsoCalled("robots", "n_robots"), Key("robots")] = 1
    processing_s: Annotated[
        ServiceTime | None,
        Key(
            "processing time at the robot",
            stated="processing time of a command at the robot",
        ),
    ] = None
    sensors: Annotated[tuple[SensorConfig, ...], Field(max_length=16)] | None = None
    charge: Annotated[
        float, Field(gt=0, le=1), Key("charge of the robots at the beginning", stated=False)
    ] = 1.0
    way_m: Positive | None = None
    watchdog_s: Annotated[float, Field(gt=0, le=60), Key("watchdog of the robot")] = 3.0
    max_age_s: Annotated[float, Field(gt=0, le=120), Key("age limit of a command")] = 6.0

    @model_validator(mode="after")
    def _every_profile_has_a_robot(self) -> RobotConfig:
        if isinstance(self.profile, tuple) and len(self.profile) > self.count:
            raise ValueError(
                f"robot.profile names {len(self.profile)} robots, robot.count is {self.count}"
            )
        return self


Kind = Literal["simulated", "person"]


def _number(key: object) -> object:
    """Return a number that was a key of JSON, where each is a text."""
    return int(key) if isinstance(key, str) and key.isascii() and key.isdigit() else key


Kinds = Kind | dict[Annotated[int, BeforeValidator(_number), Field(ge=1)], Kind]
"""One kind for all, or kinds of some by their numbers from 1; the others are simulated."""


def persons_of(kinds: Kinds, count: int) -> tuple[int, ...]:
    """Return the numbers of the operators who are persons."""
    if isinstance(kinds, str):
        return tuple(range(1, count + 1)) if kinds == "person" else ()
    return tuple(sorted(number for number, kind in kinds.items() if kind == "person"))


def check_kinds(kinds: Kinds, count: int, what: str) -> None:
    """Refuse numbers of operators that do not exist.

    Raises:
        ValueError: there are some.
    """
    if not isinstance(kinds, str) and max(kinds, default=0) > count:
        raise ValueError(f"{what}.kind names {what} {max(kinds)}, {what}.count is {count}")


class GuardConfig(OmitsUnset):
    """The guards: how many, and from which profile they are drawn.

    Attributes:
        kind: Player of each guard: `simulated`, `person`, or some by number, as in `{2: person}`.
        traits: Medians that take the place of the profile's, such as `{contain_s: 300}`.
        habits: Assumed numbers that take the place of the profile's, such as
            `{work: {stands_off_m: 12}}`.
        mobilisation_s: Median from the order to the first step; left out: as the profile says.
        way_m: They wait at places from which the way to the first event is so long, rather than
            at the site's posts.
    """

    omitted = ("traits",)
    profile: str = "guard"
    count: Annotated[int, Field(ge=0, le=1000), AlsoCalled("guards", "n_guards"), Key("guards")] = 0
    traits: OwnTraits = Field(default_factory=dict)
    habits: GuardHabits = Field(default_factory=GuardHabits)
    mobilisation_s: Annotated[
        Positive | None, Key("time until the guard sets out", stated=False)
    ] = None
    way_m: Annotated[Positive | None, Key("way of the guard", stated=False)] = None
    kind: Annotated[Kinds, Key("who plays the guards", stated=False)] = "simulated"

    @model_validator(mode="after")
    def _persons_are_there(self) -> GuardConfig:
        check_kinds(self.kind, self.count, "guard")
        return self

    @model_validator(mode="after")
    def _mobilisation_is_given_once(self) -> GuardConfig:
        if self.mobilisation_s is not None and "mobilisation_s" in self.traits:
            raise ValueError(
                "guard.mobilisation_s and guard.traits.mobilisation_s set the same median: "
                "give one of them"
            )
        return self

    @property
    def persons(self) -> tuple[int, ...]:
        """The numbers of the guards whom people play."""
        return persons_of(self.kind, self.count)


class BystanderConfig(OmitsUnset):
    """People who are there for other reasons: how many, and from which profile they are drawn.

    Attributes:
        traits: Medians that take the place of the profile's, such as `{premovement_s: 30}`.
        habits: Assumed numbers that take the place of the profile's.
    """

    omitted = ("traits",)
    profile: str = "bystanders"
    count: Annotated[
        int, Field(ge=0, le=1000), AlsoCalled("bystanders", "people"), Key("bystanders")
    ] = 0
    traits: OwnTraits = Field(default_factory=dict)
    habits: BystanderHabits = Field(default_factory=BystanderHabits)


class PhoneConfig(BaseModel):
    """The tilt phones of the operators: a profile, and whatever of it is otherwise.

    Any key of a phone's profile may stand beside its name, such as `filter: none`; they are
    judged where the profile is read.
    """

    model_config = ConfigDict(extra="allow", frozen=True, allow_inf_nan=False)

    profile: Annotated[str, Key("phone")] = "default"

    @classmethod
    def further_keys(cls) -> type[BaseModel]:
        """Return the model of all other keys that it may have."""

        return PhoneProfile

    @property
    def changes(self) -> dict[str, Any]:
        """Keys that differ from the profile."""
        return dict(self.__pydantic_extra__ or {})


class OperatorConfig(OmitsUnset):
    """The operators: how they drive, and which simulated person each is.

    Attributes:
        strategy: Name, or a class in a file, `mine.py:Mine`.
        options: Options of the strategy, such as `{inner: pursuit, quality: 0.8}` of the predictor.
        traits: Medians that take the place of the population's, such as `{margin: 0.4}`.
        habits: Assumed numbers that take the place of the population's, such as
            `{waiting: {shortest_s: 0.7}}`.
        span: Maximum number of robots that one operator handles at once.
        person: Index of the first operator's person in the population; the next operator
            is the next person.
        population_seed: Draws the population; a study gives its own seed.
        kind: Kind of each operator: `simulated`, `person`, or some by number, as in `{2: person}`.
            People take part at a console only.
    """

    strategy: Annotated[str, Key("operator strategy")] = "adaptive"
    options: Annotated[
        dict[str, Any], Key(inner={"quality": Key("quality of the prediction", stated=False)})
    ] = Field(default_factory=dict)
    traits: dict[str, Positive] = Field(default_factory=dict)
    habits: OperatorHabits = Field(default_factory=OperatorHabits)
    count: Annotated[
        int, Field(ge=0, le=50), AlsoCalled("operators", "n_operators"), Key("operators")
    ] = 1
    span: Annotated[int, Field(ge=1, le=20)] = 1
    population: str = "operators"
    person: Annotated[int, Field(ge=0)] = 0
    population_seed: Annotated[int, Field(ge=0)] = 1
    kind: Annotated[Kinds, Key("who the operators are", stated=False)] = "simulated"

    @model_validator(mode="after")
    def _persons_are_there(self) -> OperatorConfig:
        check_kinds(self.kind, self.count, "operator")
        return self

    @property
    def persons(self) -> tuple[int, ...]:
        """The numbers of the operators who are people."""
        return persons_of(self.kind, self.count)


class CommandConfig(Config):
    """Sending of commands, the same for every pattern.

    Attributes:
        timeout_s: Time-out of a command that needs a reply; by default 9 s, or longer if the link's
            round trip needs it.
        attempts: Number of attempts before the link counts as lost.
        window: Maximum number of unanswered requests under `pipelined`.
        heeds: True if the app reacts to refused commands. As the document has it, it does not.
    """

    rate_hz: Annotated[
        float, Field(gt=0, le=100), AlsoCalled("rate", "command_hz"), Key("wanted command rate")
    ] = 10.0
    timeout_s: Annotated[
        Annotated[float, Field(gt=0, le=120)] | None, Key("time-out of a request")
    ] = None
    attempts: Annotated[
        int, Field(ge=1, le=10), Key("attempts of a request", stated="attempts")
    ] = 3
    window: Annotated[int, Field(ge=2, le=1000)] = 8
    heeds: Annotated[bool, Key("whether the app heeds refusals", stated=False)] = True


class RequestConfig(Config):
    """All other requests: registration, permissions, orders, the start and end of a drive.

    A time-out below four round trips is never met over a new connection, which needs three
    before the request leaves: nothing would ever be answered.

    Attributes:
        timeout_s: Time-out of a request; by default 9 s, or longer if the link's round trip needs
            it.
        attempts: Number of attempts before the link counts as lost.
    """

    timeout_s: Annotated[float, Field(gt=0, le=120)] | None = None
    attempts: Annotated[int, Field(ge=1, le=10)] = 3


class DisturbanceConfig(Config):
    """Disturbance of the first drive, to see how soon its operator notices.

    Attributes:
        kind: `revoke`: the DVA ends the permission. `take_over`: and gives the robot to another.
            `refuse`: from then on the robot answers every command with NOT_PERMITTED.
        after_s: Time from the start of the drive.
        holder_told: True if the DVA's notice reaches the previous holder of the robot.
    """

    kind: Annotated[
        Literal["none", "revoke", "take_over", "refuse"], Key("disturbance of the drive")
    ] = "none"
    after_s: Positive = 10.0
    holder_told: bool = True


class CameraConfig(Config):
    """The robots' cameras: what a frame costs and what it can show.

    Attributes:
        encode_s: Time from taking a frame to publishing it; one frame at a time.
    """

    rate_hz: Annotated[
        float, Field(gt=0, le=60), AlsoCalled("fps", "frame_rate_hz"), Key("camera rate")
    ] = 10.0
    frame_bytes: Annotated[int, Field(ge=100, le=1_000_000), Key("size of a frame")] = 12_000
    encode_s: Annotated[float, Field(ge=0, le=5)] = 0.0
    field_of_view_deg: Annotated[
        float, Field(gt=10, le=360), AlsoCalled("fov"), Key("field of view")
    ] = 70.0
    range_m: Positive = 6.0


class EventConfig(Config):
    """A fire, a gas leak, a flood, or a hazard of the user's own.

    Attributes:
        kind: `fire`, `gas_leak`, `flood`, a class in a file as `mine.py:Mine`, or what an
            installed package offers.
        room: Name of the room; by default the run's seed chooses one.
        position: Its place x, y [m]; by default the run's seed chooses one in the room.
        at_s: Start time.
        latest_s: Latest start time: if given, the seed draws the start between `at_s` and this.
        reported: True if somebody reports it at once; otherwise detectors must notice it.
        false_alarm: True for a false alarm: it is reported in the usual way, but nothing is there.
        hazard: Parameters of its kind, such as `{growth: fast}` of a fire or `{gas: propane, rate:
            0.01}` of a leak.
        reports: Number of reports; the further ones are by people who see it a little later and
            report a slightly different place.
    """

    kind: str
    room: str | None = None
    position: tuple[float, float] | None = None
    at_s: NonNegative = 0.0
    latest_s: NonNegative | None = None
    reported: bool = False
    false_alarm: bool = False
    hazard: dict[str, str | AnyNumber] = Field(default_factory=dict)
    reports: Annotated[int, Field(ge=1, le=20)] = 1

    @model_serializer(mode="wrap")
    def _as_before(self, usual: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Dump a position only where there is one, so that hashes stay the same."""
        written: dict[str, Any] = usual(self)
        if self.position is None:
            written.pop("position", None)
        return written

    @model_validator(mode="after")
    def _in_order(self) -> EventConfig:
        if self.latest_s is not None and self.latest_s < self.at_s:
            raise ValueError(f"latest_s {self.latest_s:g} is before at_s {self.at_s:g}")
        return self

    @model_validator(mode="after")
    def _hazard_can_be_made(self) -> EventConfig:
        if self.kind not in KINDS:
            return self  # files are loaded when a scenario is built from one that names them
        try:
            make_hazard(self.kind, (0.0, 0.0), self.at_s, **self.hazard)
        except ConfigError as error:
            raise ValueError(error.problem) from None
        return self


class DispatchConfig(Config):
    """Dispatch policy of the DVA, and the rules that hold whatever it advises.

    Attributes:
        policy: Name, or as `my_policy.py:Mine`.
        options: Options of that policy.
        escalate_after_s: An event that has waited so long for somebody is escalated; 0: at
            once if nobody is free; null: never.
        containment: True if a confirmed event also needs a guard to contain it.
        most_waiting: More events than that do not wait: the newest is escalated at once.
        merge_distance_m: Reports of one kind nearer than this are one event; 0: never.
        order_limit_s: Time limit of an order; a responder who has not settled the event by then
            gives it back.
        depart_within_s: Time limit for setting out; a responder who accepted an order and stays
            gives it back then. null: never.
        still_within_s: Time limit without movement on the way; the same applies then. null: never.
        bid_within_s: Time for which an auction takes bids.
        mode: `automatic`: the policy sends whom it wants. `ask_first`: it asks people at a control
            room, as long as one is there.
        decide_within_s: Time for which it then waits for an answer before it acts by itself.
        person: Scripted dispatcher; by default none.
    """

    policy: Annotated[str, Key("dispatch policy")] = "min_eta"
    options: dict[str, Any] = Field(default_factory=dict)
    escalate_after_s: Annotated[
        NonNegative | None, Key("time until an event is escalated", stated=False)
    ] = 120.0
    containment: bool = False
    most_waiting: Annotated[int, Field(ge=0)] | None = None
    merge_distance_m: NonNegative = 8.0
    max_attempts: Annotated[int, Field(ge=1)] = 4
    order_limit_s: Positive = 900.0
    depart_within_s: Positive | None = 300.0
    still_within_s: Positive | None = 60.0
    bid_within_s: Positive = 2.0
    mode: Annotated[
        Literal["automatic", "ask_first"], Key("how orders are given", stated=False)
    ] = "automatic"
    decide_within_s: Annotated[
        Positive, Key("time the policy waits for a person", stated=False)
    ] = 60.0
    person: DispatcherProfile | None = None

    def rules(self) -> Rules:
        """Return the rules as the core wants them."""
        never = math.inf
        return Rules(
            escalate_after=never if self.escalate_after_s is None else self.escalate_after_s,
            containment=self.containment,
            most_waiting=self.most_waiting,
            merge_distance=self.merge_distance_m,
            max_attempts=self.max_attempts,
            order_limit=self.order_limit_s,
            depart_within=never if self.depart_within_s is None else self.depart_within_s,
            still_within=never if self.still_within_s is None else self.still_within_s,
            bid_within=self.bid_within_s,
            decide_within=self.decide_within_s,
        )


class AccessConfig(Config):
    """Permission of some devices for a time; what no rule allows is refused.

    Attributes:
        holders: Labels such as `operator-1`; left out: all.
        robots: Labels such as `robot-1`; left out: all.
        levels: `teleoperation`, `missions`, `both`, `sensors`.
        sensors: Names of the sensors that may be read; left out: all.
        from_s: Start of the permission.
        until_s: Up to when; what is in use then is revoked. Left out: for good.
    """

    holders: tuple[str, ...] = ()
    robots: tuple[str, ...] = ()
    levels: tuple[Literal["teleoperation", "missions", "both", "sensors"], ...] = LEVELS
    sensors: tuple[str, ...] | None = None
    from_s: NonNegative = 0.0
    until_s: Positive | None = None


class RegionConfig(Config):
    """A region of the site, which a DVA of its own serves.

    Attributes:
        rooms: Names of rooms, paths and grounds that belong to it.
        polygon: Corners of an area that belongs to it, as `[x, y]` in metres on the site's plane.
        rest: True for the region that has whatever no other has.
        deputy: Region whose DVA takes over if this one's dies; left out: the next region.
    """

    rooms: tuple[str, ...] = ()
    polygon: Annotated[tuple[tuple[float, float], ...], Field(max_length=256)] = ()
    rest: bool = False
    deputy: str | None = None

    @model_validator(mode="after")
    def _is_somewhere(self) -> RegionConfig:
        if not (self.rooms or self.polygon or self.rest):
            raise ValueError("a region needs rooms, a polygon, or rest: true")
        if 0 < len(self.polygon) < 3:
            raise ValueError("a polygon has at least three corners")
        return self


class DvaDeath(Config):
    """The end of a DVA in a run, as by kill -9.

    Attributes:
        region: Region whose own DVA ends; left out: the run's seed chooses one, or the only DVA
            ends.
        at_s: Time of its end.
        latest_s: Latest time of its end: if given, the seed draws it between `at_s` and this.
        back_after_s: Time until it is started again, with nothing kept; left out: never.
    """

    region: str | None = None
    at_s: NonNegative
    latest_s: NonNegative | None = None
    back_after_s: Positive | None = None

    @model_validator(mode="after")
    def _in_order(self) -> DvaDeath:
        if self.latest_s is not None and self.latest_s < self.at_s:
            raise ValueError(f"latest_s {self.latest_s:g} is before at_s {self.at_s:g}")
        return self


class DvaConfig(Config):
    """Duties of the DVA besides giving orders.

    Attributes:
        sensors: Robot sensors that it uses: a high value raises an event, or confirms one.
        sensor_rate_hz: Rate at which it requests their values.
        supervisors: Operators who may take a robot from its holder, by label or id.
        control_rooms: Roles of control rooms, `look`, `drive`, `dispatch` or `supervise`, by label,
            such as `control-room-1`, and of other devices by id. Others may look.
        severity: Severity of events. `reported`: the highest in a report, each of which is made
            once. `followed`: it rises with repeated reports, sensors of robots and findings, too,
            and detectors and callers report again as it grows. Left out: `followed` at a console,
            else `reported`.
        regions: Regions of the site by name, each with a DVA of its own; left out: one DVA.
        deaths: DVAs that end during a run in virtual time.
        backbone: Link between each two DVAs of regions, in virtual time; `up` is from the earlier
            to the later region. Left out: they share the local network. One DVA has none.
    """

    sensors: tuple[Literal["temperature", "smoke", "gas"], ...] = ()
    sensor_rate_hz: Annotated[float, Field(ge=SLOWEST, le=FASTEST)] = 1.0
    supervisors: tuple[Annotated[str, Field(pattern=SUPERVISOR)], ...] = ()
    control_rooms: dict[Annotated[str, Field(pattern=CONTROL_ROOM)], RoleName] = Field(
        default_factory=dict
    )
    severity: Literal["reported", "followed"] | None = None
    regions: Annotated[
        dict[Annotated[str, Field(pattern=REGION)], RegionConfig], Field(max_length=16)
    ] = Field(default_factory=dict)
    deaths: tuple[DvaDeath, ...] = ()
    backbone: Annotated[
        LinkConfig | None,
        Key(
            "link between DVAs",
            inner={
                "delay_s": Key("one-way delay between DVAs"),
                "loss": Key("packet loss between DVAs"),
            },
        ),
    ] = None

    @model_validator(mode="after")
    def _regions_are_a_division(self) -> DvaConfig:
        regions = self.regions
        if len(regions) == 1:
            raise ValueError("regions: one region is no division; name two, or leave it out")
        if sum(each.rest for each in regions.values()) > 1:
            raise ValueError("regions: only one region can have the rest")
        for name, each in regions.items():
            if each.deputy == name:
                raise ValueError(f"regions.{name}.deputy: a region is not its own deputy")
            if each.deputy is not None and each.deputy not in regions:
                raise ValueError(
                    f"regions.{name}.deputy: {unknown('region', each.deputy, regions)}"
                )
        for death in self.deaths:
            if death.region is not None and death.region not in regions:
                raise ValueError(f"deaths: {unknown('region', death.region, regions)}")
        if self.backbone is not None and self.backbone.partitions:
            raise ValueError("backbone.partitions: link.partitions part DVAs, too; use those")
        return self


class EmergencyConfig(Config):
    """Emergencies.

    Attributes:
        release: Rule by which a stopped robot takes orders again. `person`: a control room that
            may dispatch releases it. `drive`: its holder starts it again. Left out: in the
            console and in `live` a person, where one who may is registered; else a new start.
    """

    release: ReleasedBy | None = None


class PatrolConfig(Config):
    """A round that the DVA sends a robot while nothing happens.

    Attributes:
        robot: Its label, such as `robot-1`.
        places: Names of rooms, or places as `[x, y]` in metres on the site's plane, in order.
    """

    robot: str
    places: Annotated[tuple[str | tuple[float, float], ...], Field(min_length=1, max_length=64)]
