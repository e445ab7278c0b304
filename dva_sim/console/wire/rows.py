"""Positions of everybody, and states of clock, link, robots and devices."""

from typing import Literal, NotRequired

from typing_extensions import TypedDict

from dva_sim.console.wire.scenes import LinkShown, OrderShown, Place


class PlacesLine(TypedDict):
    """Positions of everybody."""

    k: Literal["pos"]
    t: int
    p: list[Place]


class ClockShown(TypedDict):
    """State of the clock."""

    factor: float
    paused: bool
    lag_s: float
    given_up_s: float
    held_by_lag: bool
    jumps: NotRequired[int]


# Whether the DVA shows its log of requests, and whether it is heard.
LogShown = Literal["unknown", "kept", "not_kept", "not_permitted"]
Hearing = Literal["answers", "silent", "never"]


class ServerShown(TypedDict):
    """Address of the DVA, and whether it listens.

    `own` is False if the console can neither start nor stop the server, `role` is what the DVA lets
    it do, and `console` the id of its own device.
    """

    listens: bool
    address: str
    port: int | None
    modelled: bool
    own: NotRequired[bool]
    role: NotRequired[str]
    console: NotRequired[str]
    hearing: NotRequired[Hearing]
    log: NotRequired[LogShown]


class EmergencyShown(TypedDict):
    """Emergency that holds a robot; `released_by`: `person`, `drive`, or empty where unknown."""

    at_ms: int
    by: str
    released_by: str


class RobotRow(TypedDict):
    """State of a robot; `silent`: the DVA has lost it, and lists it no longer."""

    i: int
    mode: str
    stop_reason: str
    pattern: str | None
    battery: float | None
    holder: str | None
    holder_label: str | None
    session_age_s: float | None
    watchdog_left_s: float | None
    set_speed_mps: float | None
    set_turn_rate_radps: float | None
    queue: int | None
    lost: int | None
    commands_hz: float | None
    refused: int | None
    timeouts: int | None
    emergency: EmergencyShown | None
    by_hand: NotRequired[bool]
    camera: NotRequired[str | None]
    sensors: NotRequired[list[str]]
    silent: NotRequired[bool]


class DoingShown(TypedDict):
    """Activity of somebody on foot."""

    i: int
    doing: str


# Whether a region is served by its own DVA, by its deputy, or by none that is there.
RegionState = Literal["served", "deputy", "dead"]


class RegionShown(TypedDict):
    """A region, in words who serves it, and whether its own DVA may have it back."""

    name: str
    state: RegionState
    text: str
    is_returnable: bool


class RowsLine(TypedDict):
    """States of clock, link, robots and people, and of regions if there are several DVAs."""

    k: Literal["rows"]
    t: int
    clock: ClockShown
    link: LinkShown | None
    dropped: int
    robots: list[RobotRow]
    people: list[DoingShown]
    order: OrderShown | None
    server: NotRequired[ServerShown]
    regions: NotRequired[list[RegionShown]]


class LatencyFigures(TypedDict):
    """Latency of a kind of messages."""

    last_ms: float
    median_ms: float
    p95_ms: float
    largest_ms: float
    count: int


class SensorShown(TypedDict):
    """A sensor, with its values or the least of many; neither: it has none."""

    name: str
    unit: str
    stuck: bool
    values: NotRequired[list[float]]
    least: NotRequired[float]


class StationShown(TypedDict):
    """Station of a robot: off, registered, listening."""

    state: str
    address: str | None
    dva: str | None
    problem: str
    asking: NotRequired[bool]
    by_hand: NotRequired[bool]


class FaultsShown(TypedDict):
    """Faults of a robot."""

    processing_s: float | None
    replies: bool
    freeze: bool
    camera: bool


class RobotWindowLine(TypedDict):
    """Contents of a robot's windows."""

    k: Literal["robot"]
    t: int
    i: int
    station: StationShown
    mode: str
    hand: int | None
    holder: str | None
    stop_reason: str
    link_lost: bool
    notice: str
    speed_mps: float | None
    turn_rate_radps: float | None
    now_mps: float
    now_radps: float
    watchdog_left_s: float | None
    one_way: LatencyFigures | None
    loop: LatencyFigures | None
    replies: LatencyFigures | None
    faults: FaultsShown
    sensors: list[SensorShown]


class DeviceRow(TypedDict):
    """A device, as the DVA knows it that `dva` names."""

    id: str
    label: str
    type: str
    address: str
    dva: str | None
    doing: str | None
    heard_s: float | None
    silent: bool
    beats_hz: float
    link: str | None
    fake: bool
    round_trip_s: float | None
    commands_hz: float | None
    refused: int | None
    picture_age_s: float | None
    holder: str | None
    holder_label: str | None
    level: str | None
    ends_s: float | None
    holder_known: NotRequired[bool]
    revocable: NotRequired[bool]
    camera: NotRequired[str | None]
    sensors: NotRequired[list[str]]


class DevicesLine(TypedDict):
    """All devices."""

    k: Literal["devices"]
    t: int
    devices: list[DeviceRow]
