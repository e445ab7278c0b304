"""Lines for people in seats: their drives, phones and guards; and answers to actions."""

from typing import Final, Literal, NotRequired

from typing_extensions import TypedDict

from dva_sim.console.wire.events import DetailsShown
from dva_sim.console.wire.scenes import OrderShown, Point


class InputHeard(TypedDict):
    """The input behind the newest command that took effect."""

    n: int
    at_ms: float


class MissionShown(TypedDict):
    """State of the newest mission of a robot in somebody's hands."""

    state: str
    places_left: int
    reason: str


class SensedShown(TypedDict):
    """A sensor of a robot in hand, with its values or the least of many while it is read."""

    name: str
    unit: str
    rate_hz: float | None
    age_s: float | None
    alarm_at: float | None
    values: NotRequired[list[float]]
    least: NotRequired[float]


class DriveShown(TypedDict):
    """A robot in somebody's hands."""

    i: int | None
    level: str
    mission: MissionShown | None
    sensors: list[SensedShown]
    pattern: str
    phase: str
    mode: str
    session: int | None
    wanted: Point
    command: Point
    command_age_ms: float | None
    picture_ms: int | None
    picture_arrived_ms: int | None
    silent_s: float | None
    loop_ms: float | None
    input: InputHeard | None
    sent: int
    answered: int
    timeouts: int
    refused: int
    superseded: int
    round_trip_ms: float | None
    outcome: str | None


class PhoneIdentityShown(TypedDict):
    """A phone on the network of devices."""

    id: str
    label: str
    address: str


class PhoneShown(PhoneIdentityShown):
    """A phone in somebody's hand."""

    registered: bool
    device: str | None
    level: str | None
    calibrated: bool
    pipeline: str
    filter: str | None
    mapping: str
    radius_deg: int
    speed_mps: float
    reading: Point | None
    sensor_hz: float | None
    samples: int
    samples_lost: int
    attempts: int


class SeatLine(TypedDict):
    """State of a seat's own drives."""

    k: Literal["seat"]
    t: int
    seat: str
    label: str
    phase: str
    order: OrderShown | None
    alert: str
    drives: list[DriveShown]
    phone: PhoneShown | None


class WayThere(TypedDict):
    """Path of a guard; too far away: nobody can walk there."""

    x_m: float
    y_m: float
    room: str | None
    distance_m: float | None
    way_m: list[Point]


class GuardOrder(WayThere):
    """An order for a guard."""

    event: int
    kind: str
    task: str
    answered: bool


class GuardLine(TypedDict):
    """State of the guard that a page's person plays."""

    k: Literal["guard"]
    t: int
    seat: str
    guard: int | None
    label: str
    doing: str
    order: GuardOrder | None
    alert: str


class TourPlan(TypedDict):
    """Two robots, and a goal for each."""

    robots: list[int]
    goals_m: list[Point]
    radius_m: float
    length_m: float
    side_rad: float


class DeviceShown(TypedDict):
    """A device on the DVA's list."""

    id: str
    label: str
    type: str
    address: str


class CandidateShown(TypedDict):
    """Somebody who could be sent to an event."""

    label: str
    robot: bool
    can: bool
    free: bool
    reason: str
    arrival_s: float | None


class ProposalShown(TypedDict):
    """Proposal of the policy about an event, with its reasons."""

    event: int
    policy: str
    reason: str
    task: str | None
    label: str
    arrival_s: float | None
    decide_within_s: float | None
    candidates: list[CandidateShown]


REFUSAL: Final = "refused"  # outcome of what was not done, and never will be by asking again


class Answered(TypedDict, total=False):
    """Answer besides success; `late`: no answer came in time."""

    t: int
    late: bool
    details: DetailsShown
    device: str
    devices: list[DeviceShown]
    event: int
    hand: int | None
    outcome: str
    phone: PhoneIdentityShown
    proposal: ProposalShown
    tour: TourPlan


class DoneLine(Answered):
    """Outcome of an action."""

    k: Literal["done"]
    id: str | None
    ok: bool
    text: str
