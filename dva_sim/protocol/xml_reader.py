"""XML to bodies: names, order, form and number of elements are validated before these run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from lxml import etree

from dva_sim.protocol import control_room_xml as control_room
from dva_sim.protocol import messages as m

_Element = etree._Element


def _children(element: _Element) -> list[_Element]:
    # Slicing is three times as fast as iterating; the stubs of lxml do not know it.
    return element[:]  # type: ignore[index, return-value]


def _str(element: _Element) -> str:
    return element.text or ""


def _int(element: _Element) -> int:
    return int(element.text or "")


def _float(element: _Element) -> float:
    return float(element.text or "")


def _read_position(element: _Element) -> m.Position:
    latitude, longitude = _children(element)
    return m.Position(_float(latitude), _float(longitude))


def _read_set_teleop(element: _Element) -> m.SetTeleOp:
    speed, turn_rate, *seen = _children(element)
    return m.SetTeleOp(_float(speed), _float(turn_rate), _int(seen[0]) if seen else None)


def _read_status(element: _Element) -> m.RobotStatus:
    mode, position, heading, speed, turn_rate, tick = _children(element)
    return m.RobotStatus(
        _str(mode),
        _read_position(position),
        _float(heading),
        _float(speed),
        _float(turn_rate),
        _int(tick),
    )


def _read_robot_holder(element: _Element) -> m.RobotHolder:
    told = {child.tag: _str(child) for child in _children(element)}
    code = int(told["Code"]) if "Code" in told else None
    return m.RobotHolder(
        told.get("HolderID"), told.get("DeviceLabel"), float(told["HeldFor"]), code
    )


def _read_person_status(element: _Element) -> m.PersonStatus:
    activity, position = _children(element)
    return m.PersonStatus(_str(activity), _read_position(position))


def _read_get_sensor_info(element: _Element) -> m.GetSensorInfo:
    return m.GetSensorInfo(*map(_str, element))


def _read_sensor_value(element: _Element) -> m.SensorValue:
    sensor, *values, unit, tick = _children(element)
    return m.SensorValue(_str(sensor), tuple(map(_float, values)), _str(unit), _int(tick))


def _read_go_to(element: _Element) -> m.GoTo:
    return m.GoTo(tuple(_read_position(waypoint) for waypoint in element))


def _read_patrol(element: _Element) -> m.Patrol:
    *waypoints, laps = _children(element)
    return m.Patrol(tuple(map(_read_position, waypoints)), _int(laps))


def _read_inspect(element: _Element) -> m.Inspect:
    number, kind, position = _children(element)
    return m.Inspect(_int(number), _str(kind), _read_position(position))


def _read_mission_status(element: _Element) -> m.MissionStatus:
    mission, state, left, reason = _children(element)
    return m.MissionStatus(_int(mission), _str(state), _int(left), _str(reason))


def _read_dev_sub(element: _Element) -> m.DevSub:
    sensor, frequency = _children(element)
    return m.DevSub(_str(sensor), _float(frequency))


def _read_permission_request(element: _Element) -> m.PermissionRequest:
    device, level, *rest = _children(element)
    takeover = _str(rest.pop()) if rest and rest[-1].tag == "Takeover" else None
    return m.PermissionRequest(_str(device), _str(level), tuple(map(_str, rest)), takeover)


def _read_get_grant(element: _Element) -> m.GetGrant:
    said = {field.tag: _str(field) for field in _children(element)}
    return m.GetGrant(said.get("HolderID"), said.get("Level"))


def _read_permission_grant(element: _Element) -> m.PermissionGrant:
    return m.PermissionGrant(*_granted(element))


def _granted(element: _Element) -> tuple[str, str, int, str | None, tuple[str, ...]]:
    """What a grant and the reply about it have in common; the address may be absent."""
    who, level, session, *rest = _children(element)
    address = _str(rest.pop(0)) if rest and rest[0].tag == "IpAddr" else None
    return _str(who), _str(level), _int(session), address, tuple(map(_str, rest))


def _read_permission_revocation(element: _Element) -> m.PermissionRevocation:
    device, holder, session = _children(element)
    return m.PermissionRevocation(_str(device), _str(holder), _int(session))


def _read_event_report(element: _Element) -> m.EventReport:
    *number, kind, position, severity, confidence, finding = _children(element)
    return m.EventReport(
        _int(number[0]) if number else None,
        _str(kind),
        _read_position(position),
        _float(severity),
        _float(confidence),
        _str(finding),
    )


def _read_order(element: _Element) -> m.Order:
    number, kind, position, *rest = _children(element)
    device = _str(rest.pop(0)) if rest and rest[0].tag == "DeviceID" else None
    task = _str(rest[0]) if rest else "confirm"
    return m.Order(_int(number), _str(kind), _read_position(position), device, task)


def _read_order_progress(element: _Element) -> m.OrderProgress:
    number, state = _children(element)
    return m.OrderProgress(_int(number), _str(state))


def _read_task_announcement(element: _Element) -> m.TaskAnnouncement:
    number, kind, position, severity, bid_within = _children(element)
    return m.TaskAnnouncement(
        _int(number), _str(kind), _read_position(position), _float(severity), _float(bid_within)
    )


def _read_task_bid(element: _Element) -> m.TaskBid:
    number, arrival_in = _children(element)
    return m.TaskBid(_int(number), _float(arrival_in))


def _read_reply(element: _Element) -> m.Reply:
    answers, code, text, *content = _children(element)
    return m.Reply(
        _int(answers),
        _int(code),
        _str(text),
        _CONTENT_READERS[content[0].tag](content[0]) if content else None,
    )


def _read_device_list(element: _Element) -> m.DeviceList:
    return m.DeviceList(tuple(m.Device(*map(_str, device)) for device in element))


def _read_sensor_info(element: _Element) -> m.SensorInfo:
    url, *sensors = _children(element)
    return m.SensorInfo(_str(url), _read_sensors(sensors))


def _read_sensors(elements: list[_Element]) -> tuple[m.Sensor, ...]:
    return tuple(m.Sensor(*map(_str, element)) for element in elements)


def _read_sensor_list(element: _Element) -> m.SensorList:
    return m.SensorList(tuple(map(_read_device_sensors, element)))


def _read_device_sensors(element: _Element) -> m.DeviceSensors:
    device, *rest = _children(element)
    url = _str(rest.pop(0)) if rest and rest[0].tag == "CameraUrl" else None
    return m.DeviceSensors(_str(device), url, _read_sensors(rest))


def _read_holder(element: _Element) -> m.Holder:
    holder, label, held = _children(element)
    return m.Holder(_str(holder), _str(label), _float(held))


def _read_permission(element: _Element) -> m.Permission:
    return m.Permission(*_granted(element))


_CONTENT_READERS: Final[dict[str, Callable[[_Element], Any]]] = {
    "DeviceList": _read_device_list,
    "SensorInfo": _read_sensor_info,
    "Permission": _read_permission,
    "MissionStatus": _read_mission_status,
    "Holder": _read_holder,
    "SessionFloor": lambda element: m.SessionFloor(_int(element[0])),
    "SensorList": _read_sensor_list,
    **control_room.CONTENT_READERS,
}
_COMMAND_READERS: Final[dict[str, Callable[[_Element], m.Body]]] = {
    "StartTeleOp": lambda element: m.StartTeleOp(),
    "SetTeleOp": _read_set_teleop,
    "StopTeleOp": lambda element: m.StopTeleOp(),
    "GoTo": _read_go_to,
    "Patrol": _read_patrol,
    "Inspect": _read_inspect,
    "ReturnToBase": lambda element: m.ReturnToBase(),
    "CancelMission": lambda element: m.CancelMission(),
    "GetMissionStatus": lambda element: m.GetMissionStatus(),
    "MissionStatus": _read_mission_status,
    "GetSensorInfo": _read_get_sensor_info,
    "SensorValue": _read_sensor_value,
    "GetDeviceList": lambda element: m.GetDeviceList(),
    "PermissionRequest": _read_permission_request,
    "PermissionGrant": _read_permission_grant,
    "PermissionRevocation": _read_permission_revocation,
    "HandoverRequest": lambda element: m.HandoverRequest(*map(_str, element)),
    "GetGrant": _read_get_grant,
    "EventReport": _read_event_report,
    "Order": _read_order,
    "OrderProgress": _read_order_progress,
    "TaskAnnouncement": _read_task_announcement,
    "TaskBid": _read_task_bid,
    "TaskAward": lambda element: m.TaskAward(_int(element[0])),
    "Relocation": lambda element: m.Relocation(_read_position(element[0])),
    **control_room.READERS,
}
_PAYLOAD_READERS: Final[dict[str, Callable[[_Element], m.Body]]] = {
    "RobotStatus": _read_status,
    "RobotHolder": _read_robot_holder,
    "PersonStatus": _read_person_status,
    "DevSub": _read_dev_sub,
    "reply": _read_reply,
}


def _read_simple(rest: list[_Element]) -> m.Body:
    payload = rest[0]
    read_payload = _PAYLOAD_READERS.get(payload.tag)
    if read_payload is not None:
        return read_payload(payload)
    command = payload[0]
    return _COMMAND_READERS[command.tag](command)


_KIND_READERS: Final[dict[str, Callable[[list[_Element]], m.Body]]] = {
    "EmergencyMsg": lambda rest: m.Emergency(),
    "HBMsg": lambda rest: m.Heartbeat(),
    "RegMsg": lambda rest: m.Registration(*map(_str, rest)),
    "SimpleMsg": _read_simple,
}


def read(root: _Element) -> m.Message:
    """The message in a validated tree."""
    kind = root[0]
    fields = _children(kind)
    return m.Message(
        _str(fields[0]),
        _int(fields[1]),
        _str(fields[2]),
        _str(fields[3]),
        _int(fields[4]) if len(fields) > 4 else None,
        _KIND_READERS[kind.tag](fields[5:]),
    )
