"""Coverage of a study's 95 % intervals where differences between persons are skewed.

Measured with differences of known mean, of skewness 2 (exponential) and 6 (log-normal), in 2,000
studies each. With more persons, or a normal law, the intervals cover what they promise.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from dva_sim.experiments.study.study import Study

Coverage = tuple[float, float]
"""Share of studies in which everything is covered, at skewness 2 and at 6."""

OF_BANDS: Final[dict[int, Coverage]] = {
    4: (0.772, 0.644),
    8: (0.889, 0.753),
    12: (0.905, 0.804),
    24: (0.932, 0.859),
    48: (0.949, 0.889),
}
"""Coverage of a band over six independent levels, by number of persons."""
OF_STOPPING: Final[Coverage] = (0.932, 0.893)
"""Coverage of an interval that ends a study by its width, with looks every 12 persons to 240."""
ENOUGH: Final = 24  # persons, from which on the loss of a band is not mentioned


def remarks(study: Study) -> Iterator[str]:
    """Yield where a study's intervals cover less than 95 %, and what to choose instead."""
    stop = study.stop
    if stop is not None and not stop.is_scheduled:
        yield (
            f"a 95 % interval that ends a study by its width holds {in_words(OF_STOPPING)}; "
            "with 48 persons or more, fixed beforehand, or batch_persons: double, in 95 %"
        )
    few = of_few_persons(study.most_persons)
    if few and study.most_persons > 1:
        yield few


def of_few_persons(persons: int) -> str:
    """Describe the coverage of a band of a few persons; empty with enough."""
    if persons >= ENOUGH:
        return ""
    known = max((count for count in OF_BANDS if count <= persons), default=min(OF_BANDS))
    beyond = min(count for count in OF_BANDS if count > known)
    return (
        f"with {known} to {beyond - 1} persons a 95 % band over six levels holds "
        f"{in_words(OF_BANDS[known])}"
    )


def in_words(coverage: Coverage) -> str:
    """`in 93 % of studies if differences have skewness 2, and in 89 % at skewness 6`."""
    mild, strong = (f"{100 * share:.0f} %" for share in coverage)
    return f"in {mild} of studies if differences have skewness 2, and in {strong} at skewness 6"
