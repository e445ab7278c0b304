"""Which delays published data cover; beyond them, what operators do is an extrapolation."""

from __future__ import annotations

from dva_sim.errors import ConfigError
from dva_sim.experiments.validation.operators.targets import SupportConfig, load_targets


def support_of(strategy: str) -> SupportConfig | None:
    """What is known of a strategy; None if no published data speak of it."""
    found = (s for s in load_targets().support.values() if strategy in s.strategies)
    return next(found, None)


def delay_support(strategy: str = "adaptive") -> tuple[float, float]:
    """From which to which delay of the loop people were watched [s].

    The delay is that of everything but the person: filter, sampling, link, computers, frames.
    Pointing was watched at lags of up to 0.225 s (MacKenzie & Ware 1993), an excavator at 1.5 s.

    Args:
        strategy: Whose; `adaptive` covers both.

    Raises:
        ConfigError: no published data speak of that strategy.
    """
    found = support_of(strategy)
    if found is None:
        raise ConfigError(f"no published data are held that speak of strategy {strategy!r}")
    return found.low_s, found.high_s
