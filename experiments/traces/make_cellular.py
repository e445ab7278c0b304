"""The shipped cellular-like traces, made by chance; no real link was recorded for them.

    python experiments/traces/make_cellular.py

Packet opportunities are a Poisson process whose rate wanders: its logarithm is an
Ornstein-Uhlenbeck process, and now and then the link stands still for a while. The form of the
model follows Winstein et al.; every number below is assumed, for a phone in a moving car.

References:
    Winstein, Sivaraman, Balakrishnan: Stochastic forecasts achieve high throughput and low delay
    over cellular networks. NSDI 2013, section 3.1 (a Poisson process with a wandering rate).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

HERE = Path(__file__).parent

LASTS_MS = 60_000
MEAN_RATE = {"up": 0.12, "down": 0.35}  # packets of 1500 bytes a millisecond: 1.4 and 4.2 Mbit/s
WANDERS, FOR_MS = 0.8, 3_000.0  # sd of the logarithm of the rate, and how long it stays alike
STALLS_EVERY_MS, STALLS_FOR_MS = 15_000.0, 400.0  # on average, both exponential
SEED = 2013


def opportunities(mean_rate: float, rng: np.random.Generator) -> np.ndarray:
    """Milliseconds at which a packet may cross, ascending, `(n,)`."""
    share = np.exp(-1.0 / FOR_MS)
    steps = rng.normal(0.0, WANDERS * np.sqrt(1.0 - share**2), LASTS_MS)
    logarithm, at = np.empty(LASTS_MS), rng.normal(0.0, WANDERS)
    for n, step in enumerate(steps):
        logarithm[n] = at = share * at + step
    rate = mean_rate * np.exp(logarithm - WANDERS**2 / 2)
    start = rng.exponential(STALLS_EVERY_MS)
    while start < LASTS_MS:
        lasts = rng.exponential(STALLS_FOR_MS)
        rate[int(start) : int(start + lasts)] = 0.0
        start += lasts + rng.exponential(STALLS_EVERY_MS)
    return np.repeat(np.arange(1, LASTS_MS + 1), rng.poisson(rate))


def main() -> None:
    """Write one file for each direction."""
    for rng, (direction, rate) in zip(
        np.random.default_rng(SEED).spawn(len(MEAN_RATE)), MEAN_RATE.items(), strict=True
    ):
        lines = "\n".join(map(str, opportunities(rate, rng)))
        (HERE / f"cellular.{direction}").write_text(lines + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
