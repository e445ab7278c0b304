"""The messages of the DVA, one frozen class per element of `protocol/dva.xsd`.

The specification with its rules of use is `protocol/README.md`. Units are SI; angles are in
radians except latitude and longitude, which are WGS-84 degrees. Devices are named by ids such
as `70:1A:04:F9:81:D6`, with capital letters, so that one device has one spelling.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from dva_sim.kernel.makers import maker
from dva_sim.protocol.control_room import (
    Acknowledge,
    AddNote,
    Assign,
    AuditRecord,
    ByWhom,
    Candidate,
    ControlRoomBody,
    ControlRoomContent,
    DispatchStatus,
    Escalate,
    EventList,
    EventStatus,
    FalseAlarm,
    GetDispatch,
    GetEventList,
    GetProposal,
    GetRequestLog,
    LastDecision,
    LoggedRequest,
    Proposal,
    Proposed,
    ReleaseEmergency,
    RequestLog,
    Revoke,
    SetDispatch,
    TakeOff,
)
from dva_sim.protocol.event_kinds import EVENT_KINDS, EventKind
from dva_sim.protocol.missions import (
    CancelMission,
    GetMissionStatus,
    GoTo,
    Inspect,
    MissionStatus,
    Patrol,
    ReturnToBase,
)
from dva_sim.protocol.peers import (
    GiveBack,
    HandOver,
    PeerBody,
    PeerStatus,
    Replicate,
    ServedRegion,
)
from dva_sim.protocol.places import Position
from dva_sim.protocol.reply_codes import (
    BAD_MESSAGE,
    BAD_SESSION,
    BUSY,
    CODE_NAMES,
    NOT_PERMITTED,
    NOT_REGISTERED,
    NOT_SUPPORTED,
    OBEYS_NO_MORE,
    OK,
    OUT_OF_ORDER,
    STALE,
    UNKNOWN_DEVICE,
    UNKNOWN_EVENT,
    UNKNOWN_SENSOR,
    WRONG_MODE,
)


@dataclass(frozen=True, slots=True)
class Emergency:
    """Stop everything and stand idle until further orders; obeyed whatever the session."""


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The sender is alive. Carries no session, so it must never keep a robot moving."""


@dataclass(frozen=True, slots=True)
class Registration:
    """A device makes itself known to the DVA.

    Attributes:
        label: Name for people, up to 64 characters.
        device_type: Such as `Robot`, `Guard` or `TeleOp`, up to 64 characters.
        address: IPv4 address, with `:port` where it is not the default.
    """

    label: str
    device_type: str
    address: str


@dataclass(frozen=True, slots=True)
class StartTeleOp:
    """Begin teleoperation in the session of the header."""


class SetTeleOp(NamedTuple):
    """Drive at this speed and turn rate until the next command.

    It is made so often that it is a named tuple, like the message around it: a third of the time.

    Attributes:
        speed: Forward speed [m/s].
        turn_rate: Turn rate, counter-clockwise positive [rad/s].
        seen_tick: Newest `RobotStatus.tick` the sender has seen [ms]; it lets the robot bound
            the age of the command without a shared clock.
    """

    speed: float
    turn_rate: float
    seen_tick: int | None = None


make_set_tele_op = maker(SetTeleOp)


@dataclass(frozen=True, slots=True)
class StopTeleOp:
    """Stand still and leave teleoperation."""


@dataclass(frozen=True, slots=True)
class RobotStatus:
    """Status that a robot publishes about itself.

    Attributes:
        mode: `Idle`, `Mission` or `Teleoperation`.
        position: Position of the robot.
        heading: Counter-clockwise from east [rad], any number of turns.
        speed: Forward speed [m/s].
        turn_rate: Turn rate [rad/s].
        tick: The robot's own clock, from any start [ms].
    """

    mode: str
    position: Position
    heading: float
    speed: float
    turn_rate: float
    tick: int


@dataclass(frozen=True, slots=True)
class RobotHolder:
    """Device that may control a robot now; published by the robot.

    Attributes:
        holder: Id of the device that holds it; None: nobody.
        label: Label of that device, if the robot knows it.
        held_for: Time for which it has had control [s], up to 1e6.
        code: Reply code that its newest command got, or would get now; None: success.
    """

    holder: str | None
    label: str | None
    held_for: float
    code: int | None = None


@dataclass(frozen=True, slots=True)
class RobotEmergency:
    """Emergency that holds a robot: published by the robot, and sent to the DVA for a release.

    Attributes:
        stopped_by: Id of the device that stopped it first; None: its own button.
        stopped_for: Time since then [s], up to 1e6.
        tick: The robot's own clock at the newest emergency [ms]; a release is for that one.
        released: Person who has released it; None: it is still stopped.
    """

    stopped_by: str | None
    stopped_for: float
    tick: int
    released: ByWhom | None = None


ReleasedBy = Literal["person", "drive"]
"""Rule by which a robot is released: by a permitted person, or by a new start of its holder."""


@dataclass(frozen=True, slots=True)
class EmergencyRelease:
    """Answer of the DVA to a `RobotEmergency`: how that ends, or that it has ended.

    Attributes:
        tick: As in the request.
        released_by: `person`: a permitted person has to release the robot. `drive`: nobody is
            registered who could, so a new `StartTeleOp` of its holder does.
        released: Person who has released it; None: nobody has.
    """

    tick: int
    released_by: str
    released: ByWhom | None = None


@dataclass(frozen=True, slots=True)
class PersonStatus:
    """Activity and position of a guard; published by the guard's terminal."""

    activity: str
    position: Position


@dataclass(frozen=True, slots=True)
class GetSensorInfo:
    """Ask a robot for its sensors (`SensorInfo`), or the DVA for those of one or all robots."""

    device: str | None = None


@dataclass(frozen=True, slots=True)
class SensorValue:
    """Reading of a sensor, published to one subscriber.

    Attributes:
        sensor: Its name, up to 64 characters.
        values: Values in the unit; one, or up to 360 from a sensor with many directions.
        unit: Such as `kW/m2`, up to 64 characters.
        tick: The robot's own clock when it was measured [ms].
    """

    sensor: str
    values: tuple[float, ...]
    unit: str
    tick: int


@dataclass(frozen=True, slots=True)
class GetDeviceList:
    """Ask the DVA for the registered devices; answered with `DeviceList`."""


@dataclass(frozen=True, slots=True)
class DevSub:
    """Subscribe to a sensor, or renew the subscription.

    Attributes:
        sensor: Its name, up to 64 characters.
        frequency: Desired rate of values [Hz], up to 1000; 0 ends the subscription.
    """

    sensor: str
    frequency: float


@dataclass(frozen=True, slots=True)
class PermissionRequest:
    """An operator asks the DVA to act on a device; answered with `Permission`.

    Attributes:
        device: Id of the device.
        level: `teleoperation`, `missions`, `both`, or `sensors` for nothing but these.
        sensors: Names of the sensors to subscribe to; at most 16.
        takeover: Request when somebody holds it: `no` names the holder, `ask` asks the holder to
            give it up, `force` takes it. None: `no`, from a device that may not know these words.
    """

    device: str
    level: str
    sensors: tuple[str, ...] = ()
    takeover: str | None = None


@dataclass(frozen=True, slots=True)
class HandoverRequest:
    """The DVA asks who holds the robot `device` to give it up to `holder`: `OK`, or `BUSY`."""

    device: str
    holder: str
    label: str


@dataclass(frozen=True, slots=True)
class GetGrant:
    """A robot asks the DVA who may act on it, and trusts no other source.

    Attributes:
        holder: The device asked about; None: the current holder.
        level: `sensors`: what the holder may read; None: who may drive it, or send it somewhere.
    """

    holder: str | None = None
    level: str | None = None


@dataclass(frozen=True, slots=True)
class PermissionGrant:
    """The DVA tells a robot who may act on it; a higher session ends every lower one.

    Attributes:
        holder: Id of the device that may act.
        level: `teleoperation`, `missions`, `both`, or `sensors`, which ends nobody's session.
        session: The fencing token, at least 1.
        address: Address at which the holder publishes, if the DVA knows it.
        sensors: Names of the sensors that the holder may subscribe to; at most 16.
    """

    holder: str
    level: str
    session: int
    address: str | None = None
    sensors: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PermissionRevocation:
    """A session is over: said by its holder to the DVA, and by the DVA to robot and holder.

    Attributes:
        device: Id of the robot.
        holder: Id of the device that held it.
        session: The session that is over.
    """

    device: str
    holder: str
    session: int


@dataclass(frozen=True, slots=True)
class EventReport:
    """Something was detected, or looked at from near.

    Attributes:
        event_id: The DVA's number of the event; None while it has none.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position of the event.
        severity: 0 (harmless) to 1.
        confidence: Confidence of the sender, 0 to 1.
        finding: `detected`, `confirmed`, `refuted` or `contained`.
        origin: Id of the device that has reported it to another DVA, which passes it on.
    """

    event_id: int | None
    kind: str
    position: Position
    severity: float
    confidence: float
    finding: str
    origin: str | None = None


@dataclass(frozen=True, slots=True)
class Order:
    """The DVA sends a responder to an event.

    Attributes:
        event_id: The event.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position of the event.
        device: Id of the robot that an operator is to drive there; None: a guard walks.
        task: `confirm`: look what is there. `contain`: deal with it. `stand_by`: wait near it,
            out of danger, for the order to deal with it.
    """

    event_id: int
    kind: str
    position: Position
    device: str | None
    task: str = "confirm"


@dataclass(frozen=True, slots=True)
class OrderProgress:
    """State of an order.

    Attributes:
        event_id: The event of the order.
        state: `accepted`, `declined`, `departed`, `arrived`, `failed` or `done`.
    """

    event_id: int
    state: str


@dataclass(frozen=True, slots=True)
class TaskAnnouncement:
    """The DVA asks who could go to an event.

    Attributes:
        event_id: The event.
        kind: `fire`, `gas_leak` or `flood`.
        position: Position of the event.
        severity: 0 (harmless) to 1.
        bid_within: Bids are taken for so long after this was sent [s].
    """

    event_id: int
    kind: str
    position: Position
    severity: float
    bid_within: float


@dataclass(frozen=True, slots=True)
class TaskBid:
    """Bid of a device: to arrive at the event this long after the bid was sent [s]."""

    event_id: int
    arrival_in: float


@dataclass(frozen=True, slots=True)
class TaskAward:
    """The bid is accepted: the device has to go to the event, as by an `Order`."""

    event_id: int


@dataclass(frozen=True, slots=True)
class Relocation:
    """The DVA lets an idle guard wait at another place from now on."""

    position: Position


@dataclass(frozen=True, slots=True)
class Device:
    """One line of the device list; fields as in `Registration`."""

    id_tag: str
    label: str
    device_type: str
    address: str


@dataclass(frozen=True, slots=True)
class DeviceList:
    """Registered devices; at most 64, and no more than fit into one message."""

    devices: tuple[Device, ...]


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor that a robot has: its name and the unit of its values."""

    name: str
    unit: str


@dataclass(frozen=True, slots=True)
class SensorInfo:
    """Sensor that a robot offers.

    Attributes:
        camera_url: URL of its camera; printable ASCII, up to 256 characters.
        sensors: Sensors to subscribe to; at most 16.
    """

    camera_url: str
    sensors: tuple[Sensor, ...] = ()


@dataclass(frozen=True, slots=True)
class DeviceSensors:
    """Entry of the sensor list: the sensors of a device, and its camera if it has one."""

    device: str
    camera_url: str | None
    sensors: tuple[Sensor, ...] = ()


@dataclass(frozen=True, slots=True)
class SensorList:
    """Sensors that the devices offer; at most 64, and no more than fit into one message."""

    devices: tuple[DeviceSensors, ...]


@dataclass(frozen=True, slots=True)
class Holder:
    """Current holder: its id, its label, and for how long it has held the robot [s], up to 1e6."""

    holder: str
    label: str
    held_for: float


@dataclass(frozen=True, slots=True)
class SessionFloor:
    """The highest session that a robot knows; a grant must be above it."""

    session: int


@dataclass(frozen=True, slots=True)
class Permission:
    """Permission granted: act on `device` with `session` in the header.

    Attributes:
        device: Id of the robot.
        level: Level as in `PermissionGrant`.
        session: The fencing token, at least 1.
        address: Address at which the robot takes requests, if the DVA knows it.
        sensors: Names of the sensors to which the device may subscribe; at most 16.
    """

    device: str
    level: str
    session: int
    address: str | None = None
    sensors: tuple[str, ...] = ()


Content = (
    DeviceList
    | SensorInfo
    | Permission
    | MissionStatus
    | Holder
    | SessionFloor
    | SensorList
    | EmergencyRelease
    | ControlRoomContent
)


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to one request.

    Attributes:
        answers: MessageID of the request; 0 if the request could not be read.
        code: `OK`, or why not.
        text: The reason for people, up to 256 characters; may be empty.
        content: Requested content.
    """

    answers: int
    code: int
    text: str
    content: Content | None = None

    @property
    def reason(self) -> str:
        """Its text, or else the name of its code."""
        return self.text or CODE_NAMES.get(self.code, str(self.code))


Body = (
    Emergency
    | Heartbeat
    | Registration
    | StartTeleOp
    | SetTeleOp
    | StopTeleOp
    | RobotStatus
    | RobotHolder
    | RobotEmergency
    | PersonStatus
    | GoTo
    | Patrol
    | Inspect
    | ReturnToBase
    | CancelMission
    | GetMissionStatus
    | MissionStatus
    | GetSensorInfo
    | SensorValue
    | GetDeviceList
    | DevSub
    | PermissionRequest
    | PermissionGrant
    | PermissionRevocation
    | HandoverRequest
    | GetGrant
    | EventReport
    | Order
    | OrderProgress
    | TaskAnnouncement
    | TaskBid
    | TaskAward
    | Relocation
    | ControlRoomBody
    | PeerBody
    | Reply
)


class Message(NamedTuple):
    """A body and the header that every message carries.

    Attributes:
        destination: Id of the receiver.
        message_id: Grows with every message that the source sends, from 1 on.
        source: Id of the sender.
        timestamp: `HH:MM:SS`, with an optional fraction; for people, never for ages.
        session: 0 before a session is granted; None for heartbeats, and only for them.
    """

    destination: str
    message_id: int
    source: str
    timestamp: str
    session: int | None
    body: Body


make_message = maker(Message)
