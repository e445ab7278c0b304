"""Hazards, events, what is decided on them, alarms, and the story."""

from typing import Literal, NotRequired

from typing_extensions import TypedDict

from dva_sim.console.wire.scenes import Happened, LabelledMoment, RasterShown


class HazardShown(TypedDict):
    """A hazard on the map."""

    n: int
    kind: str
    x_m: float
    y_m: float
    radius_m: float
    severity: float
    contained: bool


class FieldScale(TypedDict):
    """The quantity that a full cell stands for."""

    value: float
    unit: str


class FieldShown(RasterShown):
    """Effect of hazards on the air or the floor."""

    kind: str
    full: FieldScale


class HazardsLine(TypedDict):
    """Positions and extents of hazards."""

    k: Literal["hazards"]
    t: int
    hazards: list[HazardShown]
    fields: list[FieldShown]


class DecidedShown(LabelledMoment):
    """The newest decision on an event."""

    action: str
    reason: str


class EventDecisions(TypedDict):
    """Decisions of people and the policy on an event."""

    decisions: int
    acknowledged: LabelledMoment | None
    decided: DecidedShown | None
    note: str | None


class SiteEventShown(EventDecisions):
    """State of an event, and what was decided on it."""

    number: int
    kind: str
    x_m: float
    y_m: float
    latitude_deg: float
    longitude_deg: float
    room: str | None
    severity: str
    severity_value: float
    state: str
    over: bool
    since_ms: int
    reported_ms: int
    assigned: list[str]


class EventsLine(TypedDict):
    """All events that are open, and the last that are over."""

    k: Literal["events"]
    t: int
    events: list[SiteEventShown]


class DispatchShown(TypedDict):
    """Dispatch mode."""

    mode: str
    decide_within_s: float
    switched: LabelledMoment | None


class RoomEntry(TypedDict):
    """A control room."""

    label: str
    role: str
    client: str


class OfferShown(TypedDict):
    """Work that somebody offers to a colleague.

    `sender` and `to` are names of people, `client` the page of the colleague; `whole` is true where
    all is handed over, at the end of a shift, and `accepted` null until the colleague has answered.
    """

    number: int
    sender: str
    to: str
    client: str
    events: list[int]
    robots: list[str]
    note: str
    whole: bool
    at_ms: int
    accepted: bool | None


class OwnerShown(TypedDict):
    """Person who answers for an event that was handed over."""

    event: int
    label: str


class ControlLine(TypedDict):
    """Dispatch mode, who decides, and what they hand over to each other."""

    k: Literal["control"]
    t: int
    dispatch: DispatchShown | None
    rooms: list[RoomEntry]
    offers: NotRequired[list[OfferShown]]
    owners: NotRequired[list[OwnerShown]]


class StepShown(TypedDict):
    """Step in the history of an event."""

    event: int
    at_ms: int
    what: str
    who: str
    device: str
    reason: str


class InstructionShown(TypedDict):
    """Line of the instructions for an event; `step` is its number among the boxes to tick."""

    text: str
    step: int | None
    done: LabelledMoment | None


class DetailsShown(TypedDict):
    """History of one event or of all, and the instructions of one."""

    event: int | None
    history: list[StepShown]
    instructions: list[InstructionShown]


class AlarmRow(TypedDict):
    """A row of the list of alarms."""

    key: str
    priority: str
    state: str
    text: str
    place: str
    count: int
    event: int | None
    since_ms: int
    is_new: bool
    seen_by: str
    left_s: int | None
    shelved_by: str
    shelved_why: str


class AlarmsLine(TypedDict):
    """The alarms, and how many there were lately."""

    k: Literal["alarms"]
    t: int
    alarms: list[AlarmRow]
    shelved: list[AlarmRow]
    flood: bool
    rate: int
    left_out: int


class AuditLine(TypedDict):
    """State of the audit log."""

    k: Literal["audit"]
    t: int
    rows: int
    hash: str
    problem: str
    lasting: bool
    file: str


class StoryLine(Happened):
    """Something has happened."""

    k: Literal["story"]


class StorySoFarLine(TypedDict):
    """All that has happened up to a moment of a recording."""

    k: Literal["story_so_far"]
    t: int
    lines: list[Happened]
