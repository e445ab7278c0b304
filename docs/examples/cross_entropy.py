"""An example of learning: weights for `linear.py` beside it, by the cross-entropy method.

```
python docs/examples/cross_entropy.py                  # some minutes on two cores
python docs/examples/cross_entropy.py --rounds 2       # a taste
```

Each round draws weights about a mean, lets each of them decide a few shifts through
`dva_sim/Dispatch-v0`, and moves mean and spread to the best quarter. In the end the weights are
compared with `min_eta` on seeds that no round has seen.

References:
    R. Y. Rubinstein, D. P. Kroese: The Cross-Entropy Method. Springer, 2004. Noise that keeps the
    spread from vanishing: I. Szita, A. Loerincz, Neural Computation 18 (2006).
"""

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from linear import FEATURES, FIRST, Linear

from dva_sim.core.dispatch import MinEta, Policy

SHIFT, CHANGES = "busy-shift", {"intensity": 6.9}
POPULATION, BEST, SHIFTS = 24, 6, 6  # of a round
LEARNT, TESTED = 10_000, 20_000  # the first seeds of shifts to learn on, and to test on
NOISE = 0.5  # added to the spread, less each round


def returns(policy: Policy, seeds: Sequence[int]) -> list[float]:
    """The return of each shift: minus all minutes that events waited for somebody."""
    from dva_sim.envs import DispatchEnv, play

    env = DispatchEnv(SHIFT, changes=CHANGES)
    return [play(env, policy, seed)["return"] for seed in seeds]


def _value(work: tuple[Sequence[float], Sequence[int]]) -> float:
    weights, seeds = work
    return float(np.mean(returns(Linear(weights), seeds)))


def learn(pool: ProcessPoolExecutor, rounds: int, seed: int = 1) -> list[float]:
    """Weights after so many rounds; they begin with `FIRST` of `linear.py`."""
    rng = np.random.default_rng(seed)
    mean, spread = np.array(FIRST), np.full(len(FEATURES), 1.0)
    for number in range(rounds):
        drawn = mean + spread * rng.normal(size=(POPULATION, len(FEATURES)))
        drawn[0] = mean
        seeds = range(LEARNT + number * SHIFTS, LEARNT + (number + 1) * SHIFTS)
        values = list(pool.map(_value, [(weights.tolist(), seeds) for weights in drawn]))
        best = drawn[np.argsort(values)[-BEST:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + NOISE * (1.0 - number / rounds)
        print(f"round {number + 1}: mean {np.mean(values):.1f}, best {max(values):.1f} min")
    return [round(float(w), 3) for w in mean]


def compare(
    pool: ProcessPoolExecutor, weights: Sequence[float], shifts: int
) -> tuple[float, float, float]:
    """Mean difference of the return to `min_eta` [min], and its 95 % interval, on new seeds."""
    seeds = range(TESTED, TESTED + shifts)
    ours = list(pool.map(_value, [(weights, [seed]) for seed in seeds]))
    theirs = list(pool.map(_min_eta, seeds))
    gain = np.array(ours) - np.array(theirs)
    half = 1.96 * gain.std(ddof=1) / np.sqrt(len(gain))
    return float(gain.mean()), float(gain.mean() - half), float(gain.mean() + half)


def _min_eta(seed: int) -> float:
    return returns(MinEta(), [seed])[0]


def main() -> None:
    """Learn, and compare."""
    asked = argparse.ArgumentParser(description="learn a linear dispatch policy")
    asked.add_argument("--rounds", type=int, default=15)
    asked.add_argument("--shifts", type=int, default=200, help="to compare on")
    asked.add_argument("--jobs", type=int, default=2)
    wanted = asked.parse_args()
    with ProcessPoolExecutor(wanted.jobs) as pool:
        weights = learn(pool, wanted.rounds)
        gain, low, high = compare(pool, weights, wanted.shifts)
    print("weights:", dict(zip(FEATURES, weights, strict=True)))
    print(f"less waiting than min_eta: {gain:.1f} min per shift ({low:.1f} to {high:.1f})")


if __name__ == "__main__":
    main()
