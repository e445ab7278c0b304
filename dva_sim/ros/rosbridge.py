"""The rosbridge protocol, version 2: one JSON object per message, with its operation as `op`.

References:
    https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import json
import math
from typing import Any, Final

MAX_NAME: Final = 256  # maximum characters of the name of a topic, a service or a type


class BadOperation(Exception):
    """A message that is not an operation of the protocol, with the reason."""


def encode(operation: dict[str, Any]) -> bytes:
    """Return an operation as JSON.

    Raises:
        ValueError: a number in it is not finite.
    """
    return json.dumps(operation, separators=(",", ":"), allow_nan=False).encode()


def decode(data: bytes) -> dict[str, Any]:
    """Return the operation in a message.

    Raises:
        BadOperation: the message is not an operation.
    """
    try:
        operation = json.loads(data)
    except (ValueError, RecursionError):
        raise BadOperation("a message is not JSON") from None
    if not isinstance(operation, dict) or not isinstance(operation.get("op"), str):
        raise BadOperation("a message has no op")
    return operation


def is_finite(value: Any) -> bool:
    """Return True for a number that is finite as a float; Booleans are not numbers."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False


def name_in(operation: dict[str, Any], key: str) -> str:
    """Return the name of a topic, a service or a type.

    Raises:
        BadOperation: it is missing, or too long.
    """
    name = operation.get(key)
    if not isinstance(name, str) or not 0 < len(name) <= MAX_NAME:
        raise BadOperation(f"{operation['op']} has no {key}, or a longer one than {MAX_NAME}")
    return name


def number_in(operation: dict[str, Any], key: str, maximum: float) -> float:
    """Return a number from 0 to `maximum`; 0 if it is missing.

    Raises:
        BadOperation: it is not a number in this range.
    """
    value = operation.get(key, 0)
    if not is_finite(value) or not 0 <= value <= maximum:
        raise BadOperation(f"{operation['op']} has {key} {str(value)[:40]!r}: 0 to {maximum:g}")
    return float(value)


def plain_type(name: str) -> str:
    """Return a type as ROS 1 writes it: `geometry_msgs/msg/Twist` is `geometry_msgs/Twist`."""
    package, _, type_name = name.partition("/")
    return f"{package}/{type_name.removeprefix('msg/').removeprefix('srv/')}"
