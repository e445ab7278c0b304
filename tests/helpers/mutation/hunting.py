"""Hunts: storms played with a planted bug until a safety rule breaks."""

import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial

from helpers.mutation.bugs import BUGS, planted
from helpers.mutation.planting import Bug
from helpers.mutation.regional_bugs import REGIONAL_BUGS
from helpers.mutation.scores import Trial

from dva_sim.storms.drawing import draw
from dva_sim.storms.regional_storm import draw_regions
from dva_sim.storms.storm import play


def hunt(name: str, storms: int) -> Trial:
    """Play the storms of the first seeds until one finds a bug, which the rules that break tell.

    A rule that breaks before the bug has acted does not count.

    Raises:
        RuntimeError: the program does not run with the bug, which so is none.
    """
    began, acts, first, found = time.monotonic(), 0, "", ""
    plan_of = draw_regions if BUGS[name] in REGIONAL_BUGS else draw
    for seed in range(1, storms + 1):
        with planted(name) as bug:
            outcome = play(plan_of(seed), enough=lambda bug=bug: bug.acts > 0)
        if outcome.error and not bug.acts:
            raise RuntimeError(f"{name}: {outcome.error}")
        acts, first = acts + bug.acts, first or bug.first
        if bug.acts and not outcome.is_clean:
            found = f"{', '.join(sorted(outcome.signature))} in storm {seed}"
            break
    acted = f"acted {acts} times ({first[:80]})" if acts else "did not act"
    return Trial(name, f"{BUGS[name].description}; {acted}", found, time.monotonic() - began)


def hunted(bugs: Iterable[Bug], jobs: int, storms: int) -> Iterator[Trial]:
    """Hunt bugs in processes; yield what came of each."""
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(partial(hunt, storms=storms), [bug.name for bug in bugs])
