"""Which delays published data cover; beyond them, what operators do is an extrapolation."""

from __future__ import annotations

from functools import cache

from dva_sim.experiments.validation.operators.targets import SupportConfig, load_targets


@cache
def supports_of(strategy: str) -> tuple[SupportConfig, ...]:
    """What is known of a strategy, from short delays on; nothing if no published data speak of it.

    The delay is that of everything but the person: filter, sampling, link, computers, frames.
    Pointing was watched at lags of up to 0.225 s (MacKenzie & Ware 1993), an excavator at 1.5 s;
    nobody was watched in between.
    """
    found = [s for s in load_targets().support.values() if strategy in s.strategies]
    return tuple(sorted(found, key=lambda support: support.low_s))


def ranges(strategy: str) -> tuple[tuple[float, float], ...]:
    """From which to which delays of the loop people were watched [s]."""
    return tuple((support.low_s, support.high_s) for support in supports_of(strategy))
