"""Fast construction of the named tuples made for every message, picture and tick."""

from __future__ import annotations

from collections.abc import Callable
from types import MethodType
from typing import Any, ParamSpec, TypeVar, cast

P = ParamSpec("P")
T = TypeVar("T")


def maker(kind: Callable[P, T]) -> Callable[P, T]:
    """Return a fast constructor of named tuples that bypasses `type.__call__`."""
    new: Any = kind.__new__
    return cast("Callable[P, T]", MethodType(new, kind))
