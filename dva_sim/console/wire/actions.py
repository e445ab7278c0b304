"""The declarations of all actions that clients may request; the rest is derived from them.

A new action is an entry of `ACTIONS`, a function in what it acts on (found there by its name), and
whatever shows it on a page. Checks at the web, roles, patience, rows of the audit log, the page's
constants (`python -m dva_sim.console.wire.generated`) and the reference page of the console follow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum, Flag, auto
from itertools import pairwise
from typing import Any, Final, TypeAlias

from dva_sim.console.wire.arguments import (
    AssignAsked,
    CalibrationAsked,
    DetailsAsked,
    FakeAsked,
    FaultSwitch,
    FindingAsked,
    GuardAnswer,
    GuardAsked,
    GuardWord,
    HandOverAsked,
    LinkChange,
    LogsLooked,
    MarkAsked,
    MissionAsked,
    MissionOrdered,
    ModeAsked,
    MomentAsked,
    NoteAsked,
    Nothing,
    OfAlarm,
    OfDevice,
    OfEvent,
    OfferAnswered,
    OfRegion,
    OfRobot,
    OfSome,
    PaceChange,
    PagesHere,
    PatternChoice,
    PhoneIdentity,
    PhoneWish,
    PlaceAsked,
    PortAsked,
    RecordingAsked,
    RegistrationAsked,
    ReportAsked,
    RobotsWatched,
    RoomName,
    SampleBatch,
    SensorsChosen,
    ShelveAsked,
    TakeAsked,
    TakeOffAsked,
    TakeoverAsked,
    TickAsked,
    TourTime,
    Wish,
    WithGoodReason,
    WithReason,
)
from dva_sim.console.wire.kinds import BadMessage, Labels, adapter_of, read_arguments
from dva_sim.console.wire.limits import ANSWER_WAIT_S, LONG
from dva_sim.console.wire.roles import Role

# What the web process asks for: an action with its arguments, and who asks.
Asked: TypeAlias = dict[str, Any]


class ActionPlace(Flag):
    """Places in which an action can act."""

    WORLD = auto()
    REMOTE = auto()
    ROBOT = auto()
    REPLAY = auto()


class Audit(Enum):
    """The row of the audit log that records an action.

    Attributes:
        OWN: The console writes one when the action is answered.
        DVA: The DVA's decision has one.
    """

    OWN = auto()
    DVA = auto()


class Queueing(Enum):
    """The order in which requests wait.

    Attributes:
        IN_TURN: Behind those before it.
        FIRST: Before all others, and never refused for want of room.
        NEWEST: Only the newest of each client waits.
        BATCH: A few of each client, in their order; of too many the oldest are lost.
    """

    IN_TURN = auto()
    FIRST = auto()
    NEWEST = auto()
    BATCH = auto()


def _agree(_: dict[str, Any]) -> None:
    return None


def check_times(request: dict[str, Any]) -> None:
    """Check that each sample has a time, later than the one before.

    Raises:
        BadMessage: it is otherwise.
    """
    at = request["at"]
    if len(at) != len(request["xyz"]):
        raise BadMessage("at and xyz should be equally long")
    if any(later <= one for one, later in pairwise(at)):
        raise BadMessage("at should rise")


@dataclass(frozen=True)
class Action:
    """One action.

    Attributes:
        name: By which it is asked for.
        does: Its effect, in words for the documentation.
        arguments: A `TypedDict` that pydantic checks.
        at: Places in which it acts.
        role: The least that may ask for it.
        audit: The row of the audit log that records it, or the reason why none does.
        stops: True if it only stops or releases something: then it never waits for a disk.
        over_link: True if the answer comes from a robot or the DVA, over links that may be slow.
        waits: Its order among other requests.
        seats: True if a program needs a seat, or another thing of its own, from then on.
        has_answer: True if it is answered.
        check: Raises `BadMessage` if the arguments contradict each other.
    """

    name: str
    does: str
    arguments: type = Nothing
    at: ActionPlace = ActionPlace.WORLD
    role: Role = Role.PHONE
    audit: Audit | str = Audit.OWN
    stops: bool = False
    over_link: bool = False
    waits: Queueing = Queueing.IN_TURN
    seats: bool = False
    has_answer: bool = True
    check: Callable[[dict[str, Any]], object] = _agree

    @property
    def patience(self) -> float:
        """Time allowed for its answer [s]."""
        return LONG if self.over_link else ANSWER_WAIT_S

    def read(self, arguments_given: Any, labels: Labels | None = None) -> dict[str, Any]:
        """Check its arguments; see `read_arguments`.

        Raises:
            BadMessage: they make no sense.
        """
        try:
            request = read_arguments(self.arguments, arguments_given, labels)
            self.check(request)
        except BadMessage as error:
            raise BadMessage(f"{self.name}: {error}") from None
        return request


_OFTEN = "comes many times a second; what became of it is in the recording"
_LOOKS = "changes nothing but what a page shows"
_RUN = ActionPlace.WORLD | ActionPlace.REMOTE
_HANDS = ActionPlace.WORLD | ActionPlace.ROBOT
_ALL = ActionPlace.WORLD | ActionPlace.REMOTE | ActionPlace.ROBOT | ActionPlace.REPLAY
_DECIDE: Any = {"at": _RUN, "role": Role.DISPATCH, "audit": Audit.DVA, "over_link": True}
_ALARM: Any = {"at": _RUN, "role": Role.DISPATCH}
_ALONE: Any = {"at": ActionPlace.ROBOT, "role": Role.DRIVE}
_PLAYED: Any = {"at": ActionPlace.REPLAY, "role": Role.DRIVE, "audit": _LOOKS}
_LOOKED: Any = {"has_answer": False, "waits": Queueing.NEWEST, "audit": _LOOKS}
_SILENT: Any = {"has_answer": False, "waits": Queueing.NEWEST, "audit": _OFTEN}

_LIST = (
    Action(
        "take",
        "takes control of robots",
        TakeAsked,
        at=_RUN,
        over_link=True,
        seats=True,
        role=Role.DRIVE,
    ),
    Action("release", "gives back all that one holds", at=_RUN | _HANDS, stops=True),
    Action("start", "begins to drive", at=_RUN, over_link=True),
    Action("stop", "ends the drive", at=_RUN, stops=True, over_link=True),
    Action(
        "emergency",
        "stops robots before all else; one's own, or all",
        OfSome,
        at=_RUN | _HANDS,
        role=Role.LOOK,
        stops=True,
        over_link=True,
        waits=Queueing.FIRST,
    ),
    Action(
        "release_emergency",
        "releases robots after an emergency; some, or all that are stopped",
        OfSome,
        at=_RUN,
        role=Role.DISPATCH,
        audit=Audit.DVA,
        over_link=True,
    ),
    Action("link", "changes the link", LinkChange, role=Role.DRIVE),
    Action(
        "pattern",
        "changes the pattern of a robot's next drive",
        PatternChoice,
        at=_RUN,
        role=Role.DRIVE,
    ),
    Action(
        "pace",
        "halts time, or lets it go by faster",
        PaceChange,
        at=ActionPlace.WORLD | ActionPlace.REPLAY,
        role=Role.DRIVE,
    ),
    Action("confirm", "reports an event as real", at=_RUN, over_link=True),
    Action("refute", "reports an event as false", at=_RUN, over_link=True),
    Action("decline", "declines an order", at=_RUN),
    Action(
        "mission_order",
        "has a robot that one holds go by itself",
        MissionOrdered,
        at=_RUN,
        over_link=True,
    ),
    Action(
        "sense",
        "reads sensors of a robot that one holds",
        SensorsChosen,
        at=_RUN,
        audit=_LOOKS,
        over_link=True,
    ),
    Action(
        "mission_cancel",
        "ends what such a robot does by itself",
        OfRobot,
        at=_RUN,
        stops=True,
        over_link=True,
    ),
    Action("tour", "finds goals for the guided tour", audit=_LOOKS, role=Role.DRIVE),
    Action("tour_time", "notes how long a goal of the tour took", TourTime, role=Role.DRIVE),
    Action("mark", "marks this moment in the story", MarkAsked, role=Role.DRIVE),
    # --- recordings
    Action("seek", "goes to a moment", MomentAsked, **_PLAYED),
    Action("open_recording", "plays another recording", RecordingAsked, **_PLAYED),
    # --- a robot's windows
    Action("manual_take", "takes a robot by hand", OfRobot, at=_HANDS, role=Role.DRIVE, seats=True),
    Action("manual_release", "lets the robot go", at=_HANDS, stops=True),
    Action(
        "fault",
        "makes something go wrong with a robot, or ends that",
        FaultSwitch,
        at=_HANDS,
        role=Role.DRIVE,
    ),
    Action(
        "robot_register", "registers a robot at a DVA", RegistrationAsked, over_link=True, **_ALONE
    ),
    Action("robot_listen", "opens the robot's port", OfRobot, **_ALONE),
    Action("robot_release", "releases the robot after an emergency", OfRobot, **_ALONE),
    Action("robot_off", "switches the robot off", OfRobot, stops=True, **_ALONE),
    # --- phones
    Action(
        "phone_register", "registers a phone at the DVA", PhoneIdentity, over_link=True, seats=True
    ),
    Action(
        "phone_devices",
        "asks the DVA who is there",
        audit="only reads the list of devices",
        over_link=True,
    ),
    Action("phone_permission", "asks for the permission for a robot", PhoneWish, over_link=True),
    Action("phone_report", "reports an event that its person sees", ReportAsked, over_link=True),
    Action("phone_calibrate", "calibrates a phone", CalibrationAsked),
    # --- guards
    Action("guard_join", "plays a guard from then on", GuardAsked, seats=True),
    Action("guard_leave", "plays the guard no longer", stops=True),
    Action("guard_answer", "accepts or declines an order", GuardAnswer),
    Action("guard_go", "has the DVA send oneself to an event, as a guard", OfEvent, over_link=True),
    Action("guard_say", "says how far one has come", GuardWord, over_link=True),
    Action(
        "guard_place",
        "says where one is",
        PlaceAsked,
        audit="comes every 2 s from a satellite; where a guard was is in the recording",
    ),
    Action("guard_report", "reports an event", ReportAsked, over_link=True),
    # --- the DVA's server and devices
    Action("server_start", "starts the DVA's server", PortAsked, at=_RUN, role=Role.DRIVE),
    Action("server_stop", "stops the DVA's server", at=_RUN, role=Role.DRIVE),
    Action(
        "revoke",
        "ends the permission for a robot",
        OfDevice,
        **_DECIDE | {"role": Role.SUPERVISE},
    ),
    Action(
        "fake_add",
        "registers a device that is not there",
        FakeAsked,
        at=_RUN,
        role=Role.DRIVE,
        over_link=True,
    ),
    Action("fake_remove", "removes such a device", OfDevice, at=_RUN, role=Role.DRIVE),
    # --- control rooms
    Action(
        "room_join",
        "says who decides at a page",
        RoomName,
        at=_RUN,
        role=Role.DRIVE,
        over_link=True,
        seats=True,
    ),
    Action("event_raise", "reports an event", ReportAsked, **_DECIDE | {"role": Role.DRIVE}),
    Action("event_acknowledge", "says that somebody answers for an event", OfEvent, **_DECIDE),
    Action("event_assign", "sends somebody to an event", AssignAsked, **_DECIDE),
    Action("event_take_off", "calls somebody off an event", TakeOffAsked, **_DECIDE),
    Action("event_false_alarm", "ends an event as a false alarm", WithGoodReason, **_DECIDE),
    Action("event_escalate", "hands an event to others", WithReason, **_DECIDE),
    Action("event_note", "writes a note at an event", NoteAsked, **_DECIDE),
    Action(
        "event_proposal",
        "asks whom the policy would send",
        OfEvent,
        **_DECIDE | {"role": Role.DRIVE, "audit": "only reads what the policy would do"},
    ),
    Action(
        "dispatch_mode",
        "says whether the policy asks first",
        ModeAsked,
        **_DECIDE | {"role": Role.SUPERVISE},
    ),
    Action(
        "mission",
        "sends a robot to an event by itself",
        MissionAsked,
        at=_RUN,
        role=Role.DISPATCH,
        over_link=True,
    ),
    Action(
        "mission_found",
        "says what such a robot has found",
        FindingAsked,
        at=_RUN,
        role=Role.DISPATCH,
        over_link=True,
    ),
    Action(
        "take_over",
        "takes a robot from its holder",
        TakeoverAsked,
        at=_RUN,
        role=Role.SUPERVISE,
        over_link=True,
        seats=True,
    ),
    Action(
        "give_back",
        "gives a region back to its own DVA, which is there again",
        OfRegion,
        at=_RUN,
        role=Role.SUPERVISE,
        over_link=True,
    ),
    Action(
        "event_details",
        "asks for the history of events, and for instructions",
        DetailsAsked,
        at=_RUN | ActionPlace.REPLAY,
        role=Role.LOOK,
        audit="only reads what has happened",
    ),
    Action("event_tick", "says that a step of the instructions is done", TickAsked, **_ALARM),
    Action("hand_over", "offers events and robots to a colleague", HandOverAsked, **_ALARM),
    Action(
        "hand_over_answer",
        "accepts or declines what a colleague offers",
        OfferAnswered,
        over_link=True,
        **_ALARM,
    ),
    Action("alarm_acknowledge", "says that an alarm is seen", OfAlarm, over_link=True, **_ALARM),
    Action("alarm_shelve", "takes an alarm out of the list for a while", ShelveAsked, **_ALARM),
    Action("alarm_unshelve", "puts an alarm back into the list", OfAlarm, **_ALARM),
    # --- without an answer
    Action("input", "says what a hand wants", Wish, at=_RUN, **_SILENT),
    Action(
        "manual",
        "says what a hand at a robot's window wants",
        Wish,
        at=_HANDS,
        role=Role.DRIVE,
        **_SILENT,
    ),
    Action(
        "samples",
        "says what a phone's sensor measures",
        SampleBatch,
        check=check_times,
        **_SILENT | {"waits": Queueing.BATCH},
    ),
    Action(
        "gone",
        "says that the page is hidden",
        at=_RUN | _HANDS,
        stops=True,
        **_SILENT
        | {
            "waits": Queueing.FIRST,
            "audit": "nobody asks for it; the end of a drive is in the story",
        },
    ),
)
ACTIONS: Final[Mapping[str, Action]] = {action.name: action for action in _LIST}
# Sent by the web process itself, for all pages together.
OF_THE_WEB: Final[Mapping[str, Action]] = {
    action.name: action
    for action in (
        Action("watch", "says whose pictures are looked at", RobotsWatched, at=_ALL, **_LOOKED),
        Action("look", "says which logs and tables are looked at", LogsLooked, at=_ALL, **_LOOKED),
        Action("here", "says which clients are there", PagesHere, at=_RUN, **_LOOKED),
    )
}


def prepare_checks() -> None:
    """Load what checks arguments, so that the first action need not wait for it."""
    for action in ACTIONS.values():
        adapter_of(action.arguments)
