"""Messages between control rooms and the DVA: events, decisions, proposals.

One frozen dataclass per element below `Dispatch` of `protocol/dva.xsd`, as in `messages`, where
all of them are found, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from dva_sim.protocol.places import Position

FREE: Final = "free"  # reason of a candidate that nothing holds back


@dataclass(frozen=True, slots=True)
class GetEventList:
    """Ask for the events above this number, or from the first on; answered with `EventList`."""

    event_id: int | None = None


@dataclass(frozen=True, slots=True)
class GetDispatch:
    """Ask how orders are given, and what one may do; answered with `DispatchStatus`."""


@dataclass(frozen=True, slots=True)
class SetDispatch:
    """Let the policy act by itself, or ask first.

    Attributes:
        dispatch_mode: `automatic` or `ask_first`.
        reason: Reason in words.
    """

    dispatch_mode: str
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class Acknowledge:
    """Acknowledge an event, and take responsibility for it."""

    event_id: int


@dataclass(frozen=True, slots=True)
class Assign:
    """Send a guard or a robot to an event.

    Attributes:
        event_id: The event.
        device: Id of the guard or robot.
        operator: Id of the device that is to drive the robot; None: the DVA chooses.
        task: Task as in `Order`; None: `confirm`.
        reason: Reason in words.
        decisions: `EventStatus.decisions` as the sender has seen it; without it no event can be
            taken from a device. If it is outdated, nothing is done.
    """

    event_id: int
    device: str
    operator: str | None = None
    task: str | None = None
    reason: str | None = None
    decisions: int | None = None


@dataclass(frozen=True, slots=True)
class TakeOff:
    """Recall a guard or a robot from an event; the policy may not send it there again.

    Attributes:
        event_id: The event.
        device: Id of the guard or robot.
        reason: Reason in words.
        decisions: Expected decision count, as in `Assign`.
    """

    event_id: int
    device: str
    reason: str | None = None
    decisions: int | None = None


@dataclass(frozen=True, slots=True)
class FalseAlarm:
    """Close an event as a false alarm, as if a device there had refuted it.

    Attributes:
        event_id: The event.
        reason: Reason in words.
        decisions: Expected decision count, as in `Assign`.
    """

    event_id: int
    reason: str
    decisions: int | None = None


@dataclass(frozen=True, slots=True)
class Escalate:
    """Escalate an event to others than the DVA's own devices.

    Attributes:
        event_id: The event.
        reason: Reason in words.
        decisions: Expected decision count, as in `Assign`.
    """

    event_id: int
    reason: str | None = None
    decisions: int | None = None


@dataclass(frozen=True, slots=True)
class AddNote:
    """Add a note on an event for others, up to 256 characters."""

    event_id: int
    text: str


@dataclass(frozen=True, slots=True)
class GetProposal:
    """Ask whom the policy would send to an event; answered with `Proposal`."""

    event_id: int


@dataclass(frozen=True, slots=True)
class Revoke:
    """Take a robot from its holder, so that it is free.

    Attributes:
        device: Id of the robot.
        reason: Reason in words.
    """

    device: str
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class ReleaseEmergency:
    """Let a robot that an emergency has stopped take orders again.

    The DVA sends the same to the robot, which asks the DVA before it believes that.

    Attributes:
        device: Id of the robot.
        reason: Reason in words.
    """

    device: str
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class ByWhom:
    """Device that did something, its label, and how long ago that was [s], up to 1e6."""

    device: str
    label: str
    ago: float


@dataclass(frozen=True, slots=True)
class LastDecision:
    """The last decision on an event.

    Attributes:
        device: Id of the author: a control room, or the DVA for its policy and its rules.
        label: Label of the author.
        action: `assign`, `take_off`, `false_alarm`, `escalate` or `expire`.
        ago: Age of the decision [s], up to 1e6.
        reason: Reason in words, if any were given.
    """

    device: str
    label: str
    action: str
    ago: float
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class Proposed:
    """Proposal of the policy that waits for a person to decide.

    Attributes:
        device: Id of the guard or robot that it would send.
        task: Proposed task, as in `Order`.
        arrival_in: Expected arrival [s from now].
        decide_within: Time until the proposal is carried out, if nobody has decided [s from now].
    """

    device: str
    task: str
    arrival_in: float
    decide_within: float


@dataclass(frozen=True, slots=True)
class EventStatus:
    """State of an event: published by the DVA on every change, and returned on request.

    Attributes:
        event_id: The DVA's number of the event.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position of the event.
        severity: 0 (harmless) to 1, the highest reported, or as the DVA has graded it since.
        confidence: Confidence that the event is real, 0 to 1.
        event_state: `pending`, `assigned`, `on_scene`, `confirmed`, `contained`, `refuted`,
            `escalated` or `expired`.
        age: Age since the first report [s], up to 1e6.
        state_for: Time in the present state [s], up to 1e6.
        decisions: Number of decisions on the event so far: assignments, recalls, and so on.
        closed_for: Time since the event closed [s], up to 1e6; None: it is open.
        waits_for: Task that still needs a responder: `confirm` or `contain`.
        responder: Id of the guard or robot that goes to look, or is there.
        operator: Id of the device that drives that robot.
        actor: Id of the guard that deals with it, or stands by to.
        acknowledged: Person who acknowledged it.
        last_decision: The last decision.
        proposed: Open proposal of the policy.
        note: The newest note.
    """

    event_id: int
    kind: str
    position: Position
    severity: float
    confidence: float
    event_state: str
    age: float
    state_for: float
    decisions: int
    closed_for: float | None = None
    waits_for: str | None = None
    responder: str | None = None
    operator: str | None = None
    actor: str | None = None
    acknowledged: ByWhom | None = None
    last_decision: LastDecision | None = None
    proposed: Proposed | None = None
    note: str | None = None


@dataclass(frozen=True, slots=True)
class EventList:
    """Events by number; at most 16, and no more than fit into one message: ask for those above."""

    events: tuple[EventStatus, ...]


@dataclass(frozen=True, slots=True)
class DispatchStatus:
    """Dispatch mode: published by the DVA on every change, and returned on request.

    Attributes:
        dispatch_mode: `automatic` or `ask_first`.
        decide_within: Time that a proposal waits for a person [s].
        switched: Person who last changed the mode.
        role: Role of the requester: `look`, `drive`, `dispatch` or `supervise`; not published.
    """

    dispatch_mode: str
    decide_within: float
    switched: ByWhom | None = None
    role: str | None = None


@dataclass(frozen=True, slots=True)
class Candidate:
    """Somebody who could be sent, or why not.

    Attributes:
        device: Id of a guard or robot.
        label: Label of the device.
        reason: `FREE`, or why it cannot go now, in words.
        arrival_in: Expected arrival [s from now]; None if unknown.
    """

    device: str
    label: str
    reason: str
    arrival_in: float | None = None


@dataclass(frozen=True, slots=True)
class Proposal:
    """Proposal of the policy for an event, as things are now.

    Attributes:
        event_id: The event.
        policy: Name of the policy.
        reason: Reason in words.
        task: Proposed task, as in `Order`; None: nothing is to be done.
        device: Id of the guard or robot that it would send; None: nobody.
        arrival_in: Expected arrival [s from now].
        decide_within: Time until it is carried out, if nobody has decided [s from now]; None:
            nobody is asked.
        candidates: All devices that could be sent, the earliest arrival first; at most 32, and as
            many as fit.
    """

    event_id: int
    policy: str
    reason: str
    task: str | None = None
    device: str | None = None
    arrival_in: float | None = None
    decide_within: float | None = None
    candidates: tuple[Candidate, ...] = ()


@dataclass(frozen=True, slots=True)
class AuditRecord:
    """A decision, published by the DVA as it is taken: by a person, the policy, or a rule.

    Attributes:
        author: Id of the device that decided; the DVA's for its policy and its rules.
        label: Label of the author.
        action: Kind of decision, such as `assign`.
        reason: Reason in words; may be empty.
        code: `OK`, or why it was refused.
        text: Result in words; may be empty.
        role: Role of the author, if it is a control room.
        event_id: Number of the event.
        device: About which guard or robot.
        task: Task of the order.
        arrival_in: Expected arrival of the device [s from then].
        advised: Id of the guard or robot that the policy would have sent; None: nobody.
        advised_in: Expected arrival of the advised device [s from then].
        operator: Id of the device that drives the robot.
        dispatch_mode: New mode of dispatch: `automatic` or `ask_first`.
        note: Text of a note, kind of an event that was raised, or word for its severity.
    """

    author: str
    label: str
    action: str
    reason: str
    code: int
    text: str
    role: str | None = None
    event_id: int | None = None
    device: str | None = None
    task: str | None = None
    arrival_in: float | None = None
    advised: str | None = None
    advised_in: float | None = None
    operator: str | None = None
    dispatch_mode: str | None = None
    note: str | None = None


@dataclass(frozen=True, slots=True)
class GetRequestLog:
    """Ask for the requests above this number, or from the first on; answered with `RequestLog`."""

    request_number: int | None = None


@dataclass(frozen=True, slots=True)
class LoggedRequest:
    """A request that the DVA has received, and its answer.

    Attributes:
        request_number: The DVA's number of the request, in the order of arrival.
        ago: Time since its arrival [s], up to 1e6.
        size: Its size [B].
        request: Its first 4096 bytes in Base64, with each session shown without its random half.
        service_time: Time until the answer [s]; None: there is none.
        code: Code of the answer.
        text: Text of the answer.
        reply: First bytes of the answer, as many as fit, like those of the request.
    """

    request_number: int
    ago: float
    size: int
    request: str
    service_time: float | None = None
    code: int | None = None
    text: str | None = None
    reply: str | None = None


@dataclass(frozen=True, slots=True)
class RequestLog:
    """Requests by number; no more than fit into one message: ask for those above.

    Attributes:
        newest: Number of the newest request; 0: there was none.
        requests: Requests that the DVA still keeps; missing numbers are kept no more.
    """

    newest: int
    requests: tuple[LoggedRequest, ...] = ()


ControlRoomBody = (
    GetEventList
    | GetRequestLog
    | GetDispatch
    | SetDispatch
    | Acknowledge
    | Assign
    | TakeOff
    | FalseAlarm
    | Escalate
    | AddNote
    | GetProposal
    | Revoke
    | ReleaseEmergency
    | EventStatus
    | DispatchStatus
    | AuditRecord
)
ControlRoomContent = EventList | RequestLog | EventStatus | Proposal | DispatchStatus
