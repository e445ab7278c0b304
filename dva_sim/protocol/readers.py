"""XML to bodies: names, order, form and number of elements are validated before these run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from lxml import etree

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


def _read_go_to(element: _Element) -> m.GoTo:
    return m.GoTo(tuple(_read_position(waypoint) for waypoint in element))


def _read_dev_sub(element: _Element) -> m.DevSub:
    sensor, frequency = _children(element)
    return m.DevSub(_str(sensor), _float(frequency))


def _read_permission_request(element: _Element) -> m.PermissionRequest:
    device, level = _children(element)
    return m.PermissionRequest(_str(device), _str(level))


def _read_permission_grant(element: _Element) -> m.PermissionGrant:
    holder, level, session = _children(element)
    return m.PermissionGrant(_str(holder), _str(level), _int(session))


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
    number, kind, position, *device = _children(element)
    return m.Order(
        _int(number),
        _str(kind),
        _read_position(position),
        _str(device[0]) if device else None,
    )


def _read_order_progress(element: _Element) -> m.OrderProgress:
    number, state = _children(element)
    return m.OrderProgress(_int(number), _str(state))


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
    return m.SensorInfo(_str(element[0]))


def _read_permission(element: _Element) -> m.Permission:
    device, level, session = _children(element)
    return m.Permission(_str(device), _str(level), _int(session))


_CONTENT_READERS: Final[dict[str, Callable[[_Element], Any]]] = {
    "DeviceList": _read_device_list,
    "SensorInfo": _read_sensor_info,
    "Permission": _read_permission,
}
_COMMAND_READERS: Final[dict[str, Callable[[_Element], m.Body]]] = {
    "StartTeleOp": lambda element: m.StartTeleOp(),
    "SetTeleOp": _read_set_teleop,
    "StopTeleOp": lambda element: m.StopTeleOp(),
    "GoTo": _read_go_to,
    "CancelMission": lambda element: m.CancelMission(),
    "GetSensorInfo": lambda element: m.GetSensorInfo(),
    "GetDeviceList": lambda element: m.GetDeviceList(),
    "PermissionRequest": _read_permission_request,
    "PermissionGrant": _read_permission_grant,
    "EventReport": _read_event_report,
    "Order": _read_order,
    "OrderProgress": _read_order_progress,
}
_PAYLOAD_READERS: Final[dict[str, Callable[[_Element], m.Body]]] = {
    "RobotStatus": _read_status,
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
