"""Planted bugs by name."""

import importlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import wraps
from typing import Any

from helpers.mutation.device_bugs import DEVICE_BUGS
from helpers.mutation.dva_bugs import DVA_BUGS
from helpers.mutation.planting import Bug, Planted
from helpers.mutation.regional_bugs import REGIONAL_BUGS
from helpers.mutation.robot_bugs import ROBOT_BUGS

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.suggestions import unknown

BUGS = {bug.name: bug for bug in (*ROBOT_BUGS, *DVA_BUGS, *DEVICE_BUGS, *REGIONAL_BUGS)}


def named(name: str) -> list[Bug]:
    """Return the bugs that are meant: one, or all.

    Raises:
        ConfigError: there is none of that name.
    """
    if name == "all":
        return list(BUGS.values())
    if name not in BUGS:
        raise ConfigError(unknown("bug", name, BUGS))
    return [BUGS[name]]


@contextmanager
def planted(name: str) -> Iterator[Planted]:
    """Plant a bug while the block lasts.

    Raises:
        AttributeError: its function is gone.
    """
    bug, acts = BUGS[name], Planted()
    module, _, path = bug.place.partition(":")
    owner: Any = importlib.import_module(module)
    *way, attribute = path.split(".")
    for step in way:
        owner = getattr(owner, step)
    original = vars(owner).get(attribute)
    if not callable(original):
        raise AttributeError(f"{bug.place} is no function")
    setattr(owner, attribute, wraps(original)(bug.make(original, acts)))
    try:
        yield acts
    finally:
        setattr(owner, attribute, original)
