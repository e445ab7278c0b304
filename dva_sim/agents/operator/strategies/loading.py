"""Strategies by name: the shipped ones, a class in a file of the user, or a package's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from dva_sim.agents.operator.person import Person, Population, median_person
from dva_sim.agents.operator.strategies.adaptive import Adaptive
from dva_sim.agents.operator.strategies.base import Guarded, Reach, Strategy
from dva_sim.agents.operator.strategies.move_and_wait import MoveAndWait
from dva_sim.agents.operator.strategies.predictor import Oracle, Predictor
from dva_sim.agents.operator.strategies.pursuit import Pursuit
from dva_sim.agents.operator.strategies.two_point import TwoPoint
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import Plugins

Driver = Strategy | Oracle

STRATEGIES: Final[dict[str, Callable[..., Driver]]] = {
    "adaptive": Adaptive,
    "move_and_wait": MoveAndWait,
    "oracle": Oracle,
    "predictor": Predictor,
    "pursuit": Pursuit,
    "two_point": TwoPoint,
}

PLUGINS: Final = Plugins[Driver](
    "operator",
    Strategy,
    STRATEGIES,
    folder="agents/operators",
    group="dva_sim.operators",
    key="operator.strategy",
    needs="drive(route, view, stop_before)",
    public="dva_sim.agents.operator.strategies.Strategy",
)


def known_strategies() -> list[str]:
    """Names that a configuration can use: shipped and installed ones; files come on top."""
    return PLUGINS.known()


def load_strategy(
    name: str, options: Mapping[str, Any] | None = None, base: Path | None = None
) -> Callable[[Person, Reach], Driver]:
    """What makes the strategy that `name` means, for a person and what it steers.

    Those of users are kept within the limits, whatever they answer (`Guarded`).

    Args:
        name: A shipped one such as `pursuit`, a class in a file such as `mine.py:Mine`, or the
            name under which an installed package offers one (entry point, `dva_sim.operators`).
        options: Keyword arguments of its constructor, besides person and reach.
        base: Folder that a file is looked for in first; then the working folder, and
            `agents/operators`.

    Raises:
        ConfigError: there is none of that name, its file or package cannot be loaded, or it is
            not a strategy; a bad option is told when it is made.
    """
    factory, given = PLUGINS.find(name, base), dict(options or {})

    def make(person: Person, reach: Reach) -> Driver:
        made = PLUGINS.make(name, factory, given, person, reach)
        if name in STRATEGIES:
            return made
        if not isinstance(made, Strategy):  # its class may make something else of itself
            raise ConfigError(f"operator {name!r} makes no operator, but {type(made).__name__}")
        return Guarded(made)

    return make


def load_inner(option: str, name: object, person: Person, reach: Reach) -> Strategy:
    """The strategy that another one is told to use, by an option of that name.

    Raises:
        ConfigError: it is none, or it sees nothing.
    """
    if not isinstance(name, str):
        raise ConfigError(f"option {option!r} is {name!r}; should be the name of an operator")
    made = load_strategy(name)(person, reach)
    if not isinstance(made, Strategy):
        raise ConfigError(f"option {option!r} is {name!r}, which sees nothing")
    return made


def try_strategy(name: str, options: Mapping[str, Any] | None = None) -> None:
    """See whether one can be loaded, and knows its options.

    Raises:
        ConfigError: it cannot, or does not; the line says what would be right.
    """
    load_strategy(name, options)(median_person(Population()), Reach(0.5, 0.5))
