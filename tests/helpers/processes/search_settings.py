"""Search effort for rule-breaking cases: short and deterministic, or long and random.

`make test-soak` sets DVA_SIM_SEARCH to how many times as many cases it tries, new ones each time.
"""

import os

from hypothesis import HealthCheck, settings

LONGER = int(os.environ.get("DVA_SIM_SEARCH", "1"))


def search(cases: int = 100) -> settings:
    """For a test with `given`: so many cases in a run of all tests. None fails by its time."""
    return settings(
        max_examples=cases * LONGER,
        derandomize=LONGER == 1,
        deadline=None,
        suppress_health_check=[HealthCheck.too_slow],
    )
