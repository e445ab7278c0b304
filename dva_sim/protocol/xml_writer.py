"""Bodies to XML: a check per simple type of the schema, then a template per element.

Every value passes a check made from its type in `protocol/dva.xsd`, so that what leaves here is
valid by construction; templates are six times faster than building trees.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final, TypeVar

from dva_sim.protocol import limits
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.limits import bounds, choices, length, most

DECLARATION: Final = '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'
_T = TypeVar("_T")


def _bad(reason: str) -> ProtocolError:
    return ProtocolError(m.BAD_MESSAGE, reason)


def _real(name: str, kind: str) -> Callable[[float], str]:
    low, high = bounds(kind)

    def write(value: float) -> str:
        if low <= value <= high:
            # float() because a numpy scalar spells its own type in its repr.
            return repr(float(value))
        raise _bad(f"{name} must be within {low:g} and {high:g}, not {value!r}")

    return write


def _integer(name: str, kind: str) -> Callable[[int], str]:
    low, high = bounds(kind)

    def write(value: int) -> str:
        if low <= value <= high:
            return f"{value:d}"
        raise _bad(f"{name} must be within {low} and {high}, not {value!r}")

    return write


def _optional(element: str, write: Callable[[_T], str], value: _T | None) -> str:
    return "" if value is None else f"<{element}>{write(value)}</{element}>"


def _escape(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _string(name: str, pattern: str, form: str) -> Callable[[str], str]:
    match = re.compile(pattern).fullmatch

    @lru_cache(maxsize=1024)
    def write(value: str) -> str:
        if match(value):
            return _escape(value)
        raise _bad(f"{name} must be {form}, not {value!r}")

    return write


def _text_of(name: str, kind: str, form: str) -> Callable[[str], str]:
    """Text that has a length; `form` says what characters it has."""
    least, most_ = length(kind)
    told = f"{least} to {most_} {form}" if least else f"up to {most_} {form}"
    return _string(name, f"(?=(?s:.{{{least},{most_}}})\\Z){limits.pattern(kind)}", told)


def _choice(name: str, kind: str) -> Callable[[str], str]:
    return _string(name, "|".join(choices(kind)), " or ".join(choices(kind)))


_device_id = _string("an id", limits.pattern("DeviceID"), "like 70:1A:04:F9:81:D6")
_clock = _string("Timestamp", limits.pattern("Timestamp"), "HH:MM:SS")
_name = _text_of("a name", "Name", "printable characters")
_text = _text_of("Text", "Text", "printable characters")
_address = _string("IpAddr", limits.pattern("Address"), "like 192.168.1.48 or with :port")
_url = _text_of("CameraUrl", "Url", "ASCII characters without spaces")
_mode = _choice("Mode", "Mode")
_level = _choice("Level", "Level")
_kind = _choice("Kind", "EventKind")
_finding = _choice("Finding", "Finding")
_task = _choice("Task", "Task")
_mission_state = _choice("MissionState", "MissionState")
_state = _choice("State", "OrderState")
_takeover = _choice("Takeover", "Takeover")

_message_id = _integer("MessageID", "Positive")
_answers = _integer("Answers", "Natural")
_session_id = _integer("SessionID", "SessionID")
_session = _integer("Session", "Session")
_event_id = _integer("EventID", "Positive")
_code = _integer("Code", "Code")
_tick = _integer("a tick", "Tick")
_mission_id = _integer("MissionID", "Natural")
_laps = _integer("Laps", "Laps")
_waypoints_left = _integer("WaypointsLeft", "WaypointsLeft")

_speed = _real("Speed", "Speed")
_turn_rate = _real("TurnRate", "TurnRate")
_heading = _real("Heading", "Heading")
_latitude = _real("Latitude", "Latitude")
_longitude = _real("Longitude", "Longitude")
_unit = _real("Severity and Confidence", "Fraction")
_frequency = _real("Frequency", "Frequency")
_duration = _real("a duration", "Duration")
_measured = _real("Value", "Measured")

_VALUES = most("SensorValue", "Value")
_WAYPOINTS = most("GoTo", "Waypoint")
_SENSORS = most("SensorInfo", "Sensor")
_NAMES = most("PermissionRequest", "SensorName")
_DEVICES = most("DeviceList", "Device")
_LISTED = most("SensorList", "Device")


def _write_position(at: m.Position, tag: str = "Position") -> str:
    return (
        f"<{tag}><Latitude>{_latitude(at.latitude)}</Latitude>"
        f"<Longitude>{_longitude(at.longitude)}</Longitude></{tag}>"
    )


def _write_registration(body: m.Registration | m.Device) -> str:
    return (
        f"<DeviceLabel>{_name(body.label)}</DeviceLabel>"
        f"<DeviceType>{_name(body.device_type)}</DeviceType>"
        f"<IpAddr>{_address(body.address)}</IpAddr>"
    )


def _write_set_teleop(body: m.SetTeleOp) -> str:
    seen = _optional("SeenTick", _tick, body.seen_tick)
    return (
        f"<TeleOp><SetTeleOp><Speed>{_speed(body.speed)}</Speed>"
        f"<TurnRate>{_turn_rate(body.turn_rate)}</TurnRate>{seen}</SetTeleOp></TeleOp>"
    )


def _write_status(body: m.RobotStatus) -> str:
    return (
        f"<RobotStatus><Mode>{_mode(body.mode)}</Mode>{_write_position(body.position)}"
        f"<Heading>{_heading(body.heading)}</Heading><Speed>{_speed(body.speed)}</Speed>"
        f"<TurnRate>{_turn_rate(body.turn_rate)}</TurnRate><Tick>{_tick(body.tick)}</Tick>"
        "</RobotStatus>"
    )


def _write_robot_holder(body: m.RobotHolder) -> str:
    holder = _optional("HolderID", _device_id, body.holder)
    label = _optional("DeviceLabel", _name, body.label)
    held = f"<HeldFor>{_duration(body.held_for)}</HeldFor>"
    code = _optional("Code", _code, body.code)
    return f"<RobotHolder>{holder}{label}{held}{code}</RobotHolder>"


def _write_person_status(body: m.PersonStatus) -> str:
    return (
        f"<PersonStatus><Activity>{_name(body.activity)}</Activity>"
        f"{_write_position(body.position)}</PersonStatus>"
    )


def _write_get_sensor_info(body: m.GetSensorInfo) -> str:
    device = _optional("DeviceID", _device_id, body.device)
    return f"<Sensor><GetSensorInfo>{device}</GetSensorInfo></Sensor>"


def _write_sensor_value(body: m.SensorValue) -> str:
    if not 1 <= len(body.values) <= _VALUES:
        raise _bad(f"SensorValue must have 1 to {_VALUES} values, not {len(body.values)}")
    values = "".join([f"<Value>{_measured(value)}</Value>" for value in body.values])
    return (
        f"<Sensor><SensorValue><SensorName>{_name(body.sensor)}</SensorName>"
        f"{values}<Unit>{_name(body.unit)}</Unit>"
        f"<Tick>{_tick(body.tick)}</Tick></SensorValue></Sensor>"
    )


def _write_go_to(body: m.GoTo) -> str:
    return f"<Mission><GoTo>{_write_waypoints(body.waypoints)}</GoTo></Mission>"


def _write_waypoints(waypoints: tuple[m.Position, ...]) -> str:
    if not 1 <= len(waypoints) <= _WAYPOINTS:
        raise _bad(f"a mission must have 1 to {_WAYPOINTS} waypoints, not {len(waypoints)}")
    return "".join(_write_position(at, "Waypoint") for at in waypoints)


def _write_patrol(body: m.Patrol) -> str:
    way = _write_waypoints(body.waypoints)
    return f"<Mission><Patrol>{way}<Laps>{_laps(body.laps)}</Laps></Patrol></Mission>"


def _write_inspect(body: m.Inspect) -> str:
    return (
        f"<Mission><Inspect><EventID>{_event_id(body.event_id)}</EventID>"
        f"<Kind>{_kind(body.kind)}</Kind>{_write_position(body.position)}</Inspect></Mission>"
    )


def _write_mission(body: m.MissionStatus) -> str:
    return f"<Mission>{_write_mission_status(body)}</Mission>"


def _write_mission_status(body: m.MissionStatus) -> str:
    return (
        f"<MissionStatus><MissionID>{_mission_id(body.mission_id)}</MissionID>"
        f"<MissionState>{_mission_state(body.mission_state)}</MissionState>"
        f"<WaypointsLeft>{_waypoints_left(body.waypoints_left)}</WaypointsLeft>"
        f"<Reason>{_text(body.reason)}</Reason></MissionStatus>"
    )


def _write_dev_sub(body: m.DevSub) -> str:
    return (
        f"<DevSub><SensorName>{_name(body.sensor)}</SensorName>"
        f"<Frequency>{_frequency(body.frequency)}</Frequency></DevSub>"
    )


def _write_permission_request(body: m.PermissionRequest) -> str:
    takeover = _optional("Takeover", _takeover, body.takeover)
    return (
        f"<Access><PermissionRequest><DeviceID>{_device_id(body.device)}</DeviceID>"
        f"<Level>{_level(body.level)}</Level>{_write_sensor_names(body.sensors)}"
        f"{takeover}</PermissionRequest></Access>"
    )


def _write_sensor_names(names: tuple[str, ...]) -> str:
    if len(names) > _NAMES:
        raise _bad(f"at most {_NAMES} sensors fit into a message, not {len(names)}")
    return "".join(f"<SensorName>{_name(name)}</SensorName>" for name in names)


def _write_granted(body: m.PermissionGrant | m.Permission) -> str:
    """What a grant and the reply about it have in common."""
    address = _optional("IpAddr", _address, body.address)
    return (
        f"<Level>{_level(body.level)}</Level><Session>{_session(body.session)}</Session>"
        f"{address}{_write_sensor_names(body.sensors)}"
    )


def _write_permission_grant(body: m.PermissionGrant) -> str:
    return (
        f"<Access><PermissionGrant><HolderID>{_device_id(body.holder)}</HolderID>"
        f"{_write_granted(body)}</PermissionGrant></Access>"
    )


def _write_permission_revocation(body: m.PermissionRevocation) -> str:
    return (
        f"<Access><PermissionRevocation><DeviceID>{_device_id(body.device)}</DeviceID>"
        f"<HolderID>{_device_id(body.holder)}</HolderID>"
        f"<Session>{_session(body.session)}</Session></PermissionRevocation></Access>"
    )


def _write_handover_request(body: m.HandoverRequest) -> str:
    return (
        f"<Access><HandoverRequest><DeviceID>{_device_id(body.device)}</DeviceID>"
        f"<HolderID>{_device_id(body.holder)}</HolderID>"
        f"<DeviceLabel>{_name(body.label)}</DeviceLabel></HandoverRequest></Access>"
    )


def _write_get_grant(body: m.GetGrant) -> str:
    holder = _device_id(body.holder)
    return f"<Access><GetGrant><HolderID>{holder}</HolderID></GetGrant></Access>"


def _write_event_report(body: m.EventReport) -> str:
    number = _optional("EventID", _event_id, body.event_id)
    return (
        f"<Event><EventReport>{number}<Kind>{_kind(body.kind)}</Kind>"
        f"{_write_position(body.position)}<Severity>{_unit(body.severity)}</Severity>"
        f"<Confidence>{_unit(body.confidence)}</Confidence>"
        f"<Finding>{_finding(body.finding)}</Finding></EventReport></Event>"
    )


def _write_order(body: m.Order) -> str:
    device = _optional("DeviceID", _device_id, body.device)
    # Left out where it is the usual one, so that a receiver of version 1.1 understands it.
    task = "" if body.task == "confirm" else f"<Task>{_task(body.task)}</Task>"
    return (
        f"<Event><Order><EventID>{_event_id(body.event_id)}</EventID>"
        f"<Kind>{_kind(body.kind)}</Kind>{_write_position(body.position)}{device}{task}"
        "</Order></Event>"
    )


def _write_order_progress(body: m.OrderProgress) -> str:
    return (
        f"<Event><OrderProgress><EventID>{_event_id(body.event_id)}</EventID>"
        f"<State>{_state(body.state)}</State></OrderProgress></Event>"
    )


def _write_task_announcement(body: m.TaskAnnouncement) -> str:
    return (
        f"<Event><TaskAnnouncement><EventID>{_event_id(body.event_id)}</EventID>"
        f"<Kind>{_kind(body.kind)}</Kind>{_write_position(body.position)}"
        f"<Severity>{_unit(body.severity)}</Severity>"
        f"<BidWithin>{_duration(body.bid_within)}</BidWithin></TaskAnnouncement></Event>"
    )


def _write_task_bid(body: m.TaskBid) -> str:
    return (
        f"<Event><TaskBid><EventID>{_event_id(body.event_id)}</EventID>"
        f"<ArrivalIn>{_duration(body.arrival_in)}</ArrivalIn></TaskBid></Event>"
    )


def _write_task_award(body: m.TaskAward) -> str:
    number = _event_id(body.event_id)
    return f"<Event><TaskAward><EventID>{number}</EventID></TaskAward></Event>"


def _write_relocation(body: m.Relocation) -> str:
    return f"<Event><Relocation>{_write_position(body.position)}</Relocation></Event>"


def _write_reply(body: m.Reply) -> str:
    content = "" if body.content is None else _CONTENT_WRITERS[type(body.content)](body.content)
    return (
        f"<reply><Answers>{_answers(body.answers)}</Answers><Code>{_code(body.code)}</Code>"
        f"<Text>{_text(body.text)}</Text>{content}</reply>"
    )


def _write_device_list(content: m.DeviceList) -> str:
    if len(content.devices) > _DEVICES:
        raise _bad(f"DeviceList must have at most {_DEVICES} devices, not {len(content.devices)}")
    devices = "".join(
        f"<Device><IdTag>{_device_id(device.id_tag)}</IdTag>{_write_registration(device)}</Device>"
        for device in content.devices
    )
    return f"<DeviceList>{devices}</DeviceList>"


def _write_sensor_info(content: m.SensorInfo) -> str:
    url = _url(content.camera_url)
    return f"<SensorInfo><CameraUrl>{url}</CameraUrl>{_write_sensors(content.sensors)}</SensorInfo>"


def _write_sensors(sensors: tuple[m.Sensor, ...]) -> str:
    if len(sensors) > _SENSORS:
        raise _bad(f"a device must have at most {_SENSORS} sensors, not {len(sensors)}")
    return "".join(
        f"<Sensor><SensorName>{_name(sensor.name)}</SensorName>"
        f"<Unit>{_name(sensor.unit)}</Unit></Sensor>"
        for sensor in sensors
    )


def _write_sensor_list(content: m.SensorList) -> str:
    if len(content.devices) > _LISTED:
        raise _bad(f"SensorList must have at most {_LISTED} devices, not {len(content.devices)}")
    return f"<SensorList>{''.join(map(_write_device_sensors, content.devices))}</SensorList>"


def _write_device_sensors(device: m.DeviceSensors) -> str:
    camera = _optional("CameraUrl", _url, device.camera_url)
    return (
        f"<Device><DeviceID>{_device_id(device.device)}</DeviceID>"
        f"{camera}{_write_sensors(device.sensors)}</Device>"
    )


def _write_holder(content: m.Holder) -> str:
    return (
        f"<Holder><HolderID>{_device_id(content.holder)}</HolderID>"
        f"<DeviceLabel>{_name(content.label)}</DeviceLabel>"
        f"<HeldFor>{_duration(content.held_for)}</HeldFor></Holder>"
    )


def _write_session_floor(content: m.SessionFloor) -> str:
    return f"<SessionFloor><Session>{_session(content.session)}</Session></SessionFloor>"


def _write_permission(content: m.Permission) -> str:
    return (
        f"<Permission><DeviceID>{_device_id(content.device)}</DeviceID>"
        f"{_write_granted(content)}</Permission>"
    )


def _always(text: str) -> Callable[[Any], str]:
    return lambda body: text


_CONTENT_WRITERS: Final[dict[type, Callable[[Any], str]]] = {
    m.DeviceList: _write_device_list,
    m.SensorInfo: _write_sensor_info,
    m.Permission: _write_permission,
    m.MissionStatus: _write_mission_status,
    m.Holder: _write_holder,
    m.SessionFloor: _write_session_floor,
    m.SensorList: _write_sensor_list,
}
_WRITERS: Final[dict[type, tuple[str, Callable[[Any], str]]]] = {
    m.Emergency: ("EmergencyMsg", _always("")),
    m.Heartbeat: ("HBMsg", _always("")),
    m.Registration: ("RegMsg", _write_registration),
    m.StartTeleOp: ("SimpleMsg", _always("<TeleOp><StartTeleOp></StartTeleOp></TeleOp>")),
    m.SetTeleOp: ("SimpleMsg", _write_set_teleop),
    m.StopTeleOp: ("SimpleMsg", _always("<TeleOp><StopTeleOp></StopTeleOp></TeleOp>")),
    m.RobotStatus: ("SimpleMsg", _write_status),
    m.RobotHolder: ("SimpleMsg", _write_robot_holder),
    m.PersonStatus: ("SimpleMsg", _write_person_status),
    m.GoTo: ("SimpleMsg", _write_go_to),
    m.Patrol: ("SimpleMsg", _write_patrol),
    m.Inspect: ("SimpleMsg", _write_inspect),
    m.ReturnToBase: ("SimpleMsg", _always("<Mission><ReturnToBase></ReturnToBase></Mission>")),
    m.CancelMission: ("SimpleMsg", _always("<Mission><CancelMission></CancelMission></Mission>")),
    m.GetMissionStatus: (
        "SimpleMsg",
        _always("<Mission><GetMissionStatus></GetMissionStatus></Mission>"),
    ),
    m.MissionStatus: ("SimpleMsg", _write_mission),
    m.GetSensorInfo: ("SimpleMsg", _write_get_sensor_info),
    m.SensorValue: ("SimpleMsg", _write_sensor_value),
    m.GetDeviceList: ("SimpleMsg", _always("<Access><GetDeviceList></GetDeviceList></Access>")),
    m.DevSub: ("SimpleMsg", _write_dev_sub),
    m.PermissionRequest: ("SimpleMsg", _write_permission_request),
    m.PermissionGrant: ("SimpleMsg", _write_permission_grant),
    m.PermissionRevocation: ("SimpleMsg", _write_permission_revocation),
    m.HandoverRequest: ("SimpleMsg", _write_handover_request),
    m.GetGrant: ("SimpleMsg", _write_get_grant),
    m.EventReport: ("SimpleMsg", _write_event_report),
    m.Order: ("SimpleMsg", _write_order),
    m.OrderProgress: ("SimpleMsg", _write_order_progress),
    m.TaskAnnouncement: ("SimpleMsg", _write_task_announcement),
    m.TaskBid: ("SimpleMsg", _write_task_bid),
    m.TaskAward: ("SimpleMsg", _write_task_award),
    m.Relocation: ("SimpleMsg", _write_relocation),
    m.Reply: ("SimpleMsg", _write_reply),
}


def _write_session(message: m.Message) -> str:
    if type(message.body) is m.Heartbeat:
        if message.session is not None:
            raise _bad("a heartbeat carries no session")
        return ""
    if message.session is None:
        raise _bad("only a heartbeat carries no session; before one is granted it is 0")
    return f"<SessionID>{_session_id(message.session)}</SessionID>"


def write(message: m.Message) -> str:
    """The message as XML.

    Raises:
        ProtocolError: a value that the schema cannot hold.
    """
    try:
        kind, write_body = _WRITERS[type(message.body)]
        return (
            f"{DECLARATION}<msg><{kind}><DestinationID>{_device_id(message.destination)}</DestinationID>"
            f"<MessageID>{_message_id(message.message_id)}</MessageID>"
            f"<SourceID>{_device_id(message.source)}</SourceID>"
            f"<Timestamp>{_clock(message.timestamp)}</Timestamp>"
            f"{_write_session(message)}{write_body(message.body)}</{kind}></msg>"
        )
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise _bad(f"a value of the wrong type: {error}") from error
