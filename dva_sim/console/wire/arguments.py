"""Arguments of actions, with all their limits in one place.

The annotations are read when a class is made, so that pydantic and the page's types have them.
"""

from collections.abc import Mapping
from typing import Annotated, Final, Literal, NotRequired

from typing_extensions import TypedDict

from dva_sim.console.wire.kinds import (
    MAX_ROBOTS,
    Kind,
    Label,
    Name,
    Number,
    Reason,
    Robot,
    Robots,
    RobotsOrAll,
    Several,
    Share,
    Text,
    Whole,
)

# What the sliders of the link reach.
LINK_LIMITS: Final[Mapping[str, tuple[float, float]]] = {
    "delay_s": (0.0, 5.0),
    "jitter_s": (0.0, 1.0),
    "loss": (0.0, 0.5),
    "rate_bps": (1e4, 1e9),
    "processing_s": (0.0, 3.0),
}
SLOWEST: Final = 0.1  # that a recording is played, as a multiple of real time
FASTEST: Final = 20.0  # that anything goes, likewise
MAX_PORT: Final = 65_534  # of a server: its publications have the next one
MAX_SAMPLES: Final = 64  # of a phone, in one message
MAX_MPS2: Final = 400.0  # no part of a phone measures more [m/s^2]
MAX_MS: Final = 10**13  # of a clock [ms]
STEPS: Final = (0.001, 100.0)  # of a phone's calibration [m/s^2]
DELAYS: Final = (0.02, 5.0)  # of a phone, at most [s]
MAX_LEG: Final = 3600.0  # of the tour [s]
MAX_COORDINATE_M: Final = 1e6  # distance from the origin; no site is this large [m]
SENSOR_RATES: Final = (0.02, 20.0)  # of the values of a robot [Hz]
SHIFT: Final = 8 * 3600  # no alarm is shelved for longer [s]

Axes = Annotated[list[Annotated[float, Number(-MAX_MPS2, MAX_MPS2)]], Several(3, 3)]
EventNumber = Annotated[int, Whole(1, 10**9)]
Millisecond = Annotated[float, Number(0, MAX_MS)]
Count = Annotated[int, Whole(0, 2**53)]
Coordinate = Annotated[float, Number(-MAX_COORDINATE_M, MAX_COORDINATE_M)]
# Pictures that the page has drawn last: a robot's index and when the picture was taken [ms].
Seen = Annotated[list[Annotated[list[Millisecond], Several(2, 2)]], Several(0, MAX_ROBOTS)]
# Decisions on the event, as the page knows it.
Decisions = Annotated[int, Whole(0, 10**9)] | None
Orientation = Annotated[
    int, Kind("one of: 0, 90, 180, 270", ge=0, le=270, multiple_of=90)
]  # of a screen [deg]
Kinds = Literal["fire", "gas_leak", "flood"]
Severity = Literal["low", "medium", "high", "critical"]


Level = Literal["teleoperation", "missions", "both"]
# Places on the site, each x and y [m].
Places = Annotated[list[Annotated[list[Coordinate], Several(2, 2)]], Several(0, 64)]


class Nothing(TypedDict):
    """No arguments."""


class OfRobots(TypedDict):
    """Some robots."""

    robots: Robots


class TakeAsked(OfRobots):
    """Robots, and what one may do with them; by default, drive them."""

    level: NotRequired[Level]


class OfRobot(TypedDict):
    """One robot."""

    robot: Robot


class OfSome(TypedDict):
    """Some robots; all if none is named."""

    robots: NotRequired[RobotsOrAll]


class OfDevice(TypedDict):
    """One device, by its id."""

    device: Name


class OfRegion(TypedDict):
    """One region, by its name."""

    region: Name


class LinkChange(TypedDict, total=False):
    """Change of the link."""

    delay_s: Annotated[float, Number(*LINK_LIMITS["delay_s"])]
    jitter_s: Annotated[float, Number(*LINK_LIMITS["jitter_s"])]
    loss: Annotated[float, Number(*LINK_LIMITS["loss"])]
    rate_bps: Annotated[float, Number(*LINK_LIMITS["rate_bps"])]
    processing_s: Annotated[float, Number(*LINK_LIMITS["processing_s"])]


class PatternChoice(OfRobot):
    """By which pattern a robot is driven next."""

    name: Name


class PaceChange(TypedDict, total=False):
    """Change of the simulation speed."""

    factor: Annotated[float, Number(SLOWEST, FASTEST)]
    paused: bool


class TourTime(OfRobot):
    """Time of a person for a leg of the tour."""

    took_s: Annotated[float, Number(0, MAX_LEG)]


class MarkAsked(TypedDict):
    """Words that mark this moment."""

    text: Annotated[str, Text(1, 256)]


class MomentAsked(TypedDict):
    """A moment of a recording."""

    t_ms: Annotated[int, Whole(0, 10**10)]


class RecordingAsked(TypedDict):
    """A recording by its name."""

    name: Annotated[str, Text(1, 255)]


class RegistrationAsked(OfRobot):
    """The DVA at which a robot registers."""

    dva: Annotated[str, Text(3, 80)]


class FaultSwitch(OfRobot):
    """A fault of a robot."""

    what: Literal["processing", "replies", "freeze", "camera", "sensor"]
    on: bool
    seconds: NotRequired[Annotated[float, Number(*LINK_LIMITS["processing_s"])]]
    sensor: NotRequired[Name]


class PhoneIdentity(TypedDict):
    """Identity and server of a phone's registration."""

    server: Annotated[str, Text(1, 64)]
    port: Annotated[int, Whole(1, MAX_PORT + 1)]
    label: Label
    type: Literal["Robot", "Remote Control", "Teleoperation"]


class PhoneWish(OfDevice):
    """A permission that a phone asks for."""

    level: Level


class CalibrationAsked(TypedDict):
    """Calibration of a phone."""

    reference_mps2: Axes | None
    speed_step_mps2: Annotated[float, Number(*STEPS)]
    turn_step_mps2: Annotated[float, Number(*STEPS)]
    max_delay_s: Annotated[float, Number(*DELAYS)]
    pipeline: Literal["dissertation", "default"]
    filter: Name | None
    mapping: Literal["absolute", "differential", "leaky", "slew"]
    ios: NotRequired[bool]
    keep: NotRequired[bool]


class PortAsked(TypedDict):
    """Port of the DVA's server."""

    port: Annotated[int, Whole(1, MAX_PORT)]


class FakeAsked(TypedDict):
    """A device that is not there."""

    label: Label
    type: Literal["Robot", "Guard", "TeleOp", "Remote Control"]
    address: NotRequired[Annotated[str, Text(0, 64)]]
    id_tag: NotRequired[Annotated[str, Text(0, 17)]]


class GuardAsked(TypedDict):
    """A guard by its label."""

    guard: Label


class GuardAnswer(TypedDict):
    """A guard's answer to an order."""

    accept: bool
    reason: Annotated[str, Text(0, 200)]


class GuardWord(TypedDict):
    """Statement of a guard."""

    what: Literal["departed", "arrived", "confirmed", "refuted", "contained", "help"]


class PlaceAsked(TypedDict):
    """A place on the site."""

    x_m: Coordinate
    y_m: Coordinate


class ReportAsked(PlaceAsked):
    """An event that somebody reports."""

    kind: Kinds
    severity: Severity


class RoomName(TypedDict):
    """Name of a person in a control room."""

    name: Annotated[str, Text(0, 64)]


class OfEvent(TypedDict):
    """An event by its number."""

    event: EventNumber


class WithReason(OfEvent):
    """A decision on an event, and why."""

    decisions: NotRequired[Decisions]
    reason: NotRequired[Reason]


class WithGoodReason(OfEvent):
    """A decision on an event that needs a reason."""

    decisions: NotRequired[Decisions]
    reason: Annotated[str, Text(1, 256)]


class TakeOffAsked(WithReason):
    """A device that is called off an event."""

    device: Label


class AssignAsked(TakeOffAsked):
    """A device that is sent to an event."""

    task: NotRequired[Literal["confirm", "contain", "stand_by"]]


class NoteAsked(OfEvent):
    """A note on an event."""

    text: Annotated[str, Text(1, 256)]


class ModeAsked(TypedDict):
    """Dispatch mode."""

    mode: Literal["automatic", "ask_first"]
    reason: NotRequired[Reason]


class MissionAsked(OfRobot, WithReason):
    """A robot for an event."""


class MissionOrdered(OfRobot):
    """A mission of a robot that one holds: over places, to an event, or back."""

    what: Literal["go_to", "patrol", "inspect", "return_to_base"]
    places_m: NotRequired[Places]
    event: NotRequired[EventNumber]


class SensorsChosen(OfRobot):
    """Sensors of a robot that one holds, and how often they are read."""

    sensors: Annotated[list[Name], Several(0, 16)]
    rate_hz: Annotated[float, Number(*SENSOR_RATES)]


class FindingAsked(OfEvent):
    """Finding of a robot that goes by itself, as a person sees it."""

    finding: Literal["confirmed", "refuted"]


class TakeoverAsked(OfRobot):
    """A robot, why it is taken, and the event to drive it to; without one its own, if any."""

    reason: Annotated[str, Text(1, 256)]
    event: NotRequired[EventNumber]


class OfAlarm(TypedDict):
    """An alarm by its key."""

    alarm: Annotated[str, Text(1, 200)]


class ShelveAsked(OfAlarm):
    """An alarm, for how long it is shelved, and why."""

    for_s: Annotated[float, Number(1, SHIFT)]
    reason: Annotated[str, Text(1, 256)]


class DetailsAsked(TypedDict):
    """An event by its number; none: all of them."""

    event: NotRequired[EventNumber]


class TickAsked(OfEvent):
    """A step of the instructions for an event, and whether it is done."""

    step: Annotated[int, Whole(0, 63)]
    done: bool


class HandOverAsked(TypedDict):
    """Work for a colleague: one event, or all that one has in hand."""

    to: Annotated[str, Text(1, 64)]
    note: Annotated[str, Text(0, 256)]
    event: NotRequired[EventNumber]


class OfferAnswered(TypedDict):
    """Answer to an offer, by its number."""

    offer: EventNumber
    accept: bool


class Wish(TypedDict):
    """Position of a stick, as shares of the limits."""

    n: Count
    speed: Share
    turn: Annotated[float, Number(-1, 1)]
    held: bool
    seen: NotRequired[Seen]


class RobotsWatched(TypedDict):
    """Robots whose pictures somebody looks at, by their numbers."""

    robots: list[int]


class LogsLooked(TypedDict):
    """Logs that somebody looks at, each with whether publications are wanted, and tables."""

    logs: dict[str, bool]
    tables: list[str]


class PagesHere(TypedDict):
    """Clients that are there and may act, each with the role of its page; empty without one.

    `users` are the names of those who have logged in, by client.
    """

    pages: dict[str, Literal["", "drive", "dispatch", "supervise"]]
    users: NotRequired[dict[str, str]]


class SampleBatch(TypedDict):
    """Samples of a phone's sensor."""

    n: Count
    at: Annotated[list[Millisecond], Several(1, MAX_SAMPLES)]
    xyz: Annotated[list[Axes], Several(1, MAX_SAMPLES)]
    hand: bool
    orientation: Orientation
    seen: NotRequired[Seen]
