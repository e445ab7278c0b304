"""The scenario that an environment plays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from dva_sim.kernel.errors import ConfigError
from dva_sim.simulation.models import model_of
from dva_sim.simulation.scenario import load

S = TypeVar("S")


def scenario_of(name: str, changes: Mapping[str, Any] | None, kind: type[S], model: str) -> S:
    """Return a scenario by name or path, with some keys changed.

    Args:
        name: Name or path.
        changes: New values by dotted key.
        kind: Class of the scenarios of that model.
        model: Name of the required model, for the error.

    Raises:
        ConfigError: there is no such scenario, it is of another model, or not valid.
    """
    document = load(name)
    built = model_of(document).build(document, changes or {})
    if not isinstance(built, kind):
        raise ConfigError(f"{name!r} is not of the {model} model, which this environment plays")
    return built
