"""Strategies by name: the shipped ones, a class in a file of the user, or a package's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

from dva_sim.agents.operator.strategies.adaptive import Adaptive
from dva_sim.agents.operator.strategies.base import GuardedStrategy, Strategy
from dva_sim.agents.operator.strategies.move_and_wait import MoveAndWait
from dva_sim.agents.operator.strategies.predictor import Oracle, Predictor
from dva_sim.agents.operator.strategies.pursuit import Pursuit, TwoPoint
from dva_sim.agents.population import Person, Population, median_person
from dva_sim.agents.route_following import Reach
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.plugins import Plugins, name_plugin

Driver = Strategy | Oracle

STRATEGIES: Final[dict[str, Callable[..., Driver]]] = {
    "adaptive": Adaptive,
    "move_and_wait": MoveAndWait,
    "oracle": Oracle,
    "predictor": Predictor,
    "pursuit": Pursuit,
    "two_point": TwoPoint,
}


def _guarded(made: Driver) -> Driver:
    """Return one of a user's, kept within the limits.

    Its class may make something else of itself.
    """
    if not isinstance(made, Strategy):
        raise ConfigError(f"returns {type(made).__name__}, not an operator")
    return GuardedStrategy(made)


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


known_strategies = PLUGINS.known


def load_strategy(
    name: str | Callable[..., Driver],
    options: Mapping[str, Any] | None = None,
    base: Path | None = None,
) -> Callable[[Person, Reach], Driver]:
    """Return a factory for the strategy of a name, for a person and what it steers.

    Those of users are kept within the limits, whatever they answer (`GuardedStrategy`).

    Args:
        name: A shipped one such as `pursuit`, a class in a file such as `mine.py:Mine`, or the
            name under which an installed package offers one (entry point, `dva_sim.operators`).
        options: Keyword arguments of its constructor, besides person and reach.
        base: Folder that a file is looked for in first; then the working folder, and
            `agents/operators`.

    Raises:
        ConfigError: there is none of that name, its file or package cannot be loaded, or it is
            not a strategy; a bad option is reported when it is made.
    """
    factory = PLUGINS.find(name, base)
    own_options = dict(options or {})
    word = name_plugin(name)

    def make(person: Person, reach: Reach) -> Driver:
        used: dict[str, Any] = {}
        option = getattr(factory, "uses", "")
        if option in own_options:
            load = partial(_load_used, option, own_options[option], person, reach)
            used[option] = PLUGINS.ask(word, load)
        made = PLUGINS.make(word, factory, own_options | used, person, reach)
        is_shipped = factory in STRATEGIES.values()
        return made if is_shipped else PLUGINS.ask(word, partial(_guarded, made))

    return make


def _load_used(option: str, name: object, person: Person, reach: Reach) -> Strategy:
    """Return the strategy that another one uses, by an option of that name.

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
