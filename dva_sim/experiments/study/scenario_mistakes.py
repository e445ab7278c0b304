"""Places of mistakes in a scenario that is played.

Looking for the place takes all kinds of files, which a scenario without a mistake never needs.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from dva_sim.kernel.errors import ConfigError


@contextmanager
def mistakes_of(name: str, pairs: Sequence[str], seed: int) -> Iterator[None]:
    """Tell a mistake in a scenario at its key or at the `--set` that makes it.

    Args:
        name: The scenario, by name or path.
        pairs: `key=value` for each key that is changed.

    Raises:
        ConfigError: what was raised inside, with its place.
    """
    try:
        yield
    except ConfigError as error:
        from dva_sim.experiments.study.mistake_places import placed_mistake  # late: start-up

        raise placed_mistake(error, name, pairs, seed) from None
