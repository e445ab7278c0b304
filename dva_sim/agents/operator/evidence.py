"""How a person becomes sure that something is there: evidence builds up, look by look.

Each look at a picture says a little for or against, with noise. What speaks for it adds up; what
speaks against it takes that away again, but not below nothing: who has long seen nothing is not
harder to convince. From a level on, the criterion, the person is sure. It may be wrong: noise
alone gets there too, the rarer the higher the criterion and the clearer the pictures.

References:
    R. Ratcliff, G. McKoon: The diffusion decision model: theory and data for two-choice decision
    tasks. Neural Computation 20 (2008) 873-922.
    E. S. Page: Continuous inspection schemes. Biometrika 41 (1954) 100-115 (a sum that is never
    below nothing).
    D. M. Green, J. A. Swets: Signal Detection Theory and Psychophysics. Wiley, 1966.
    A. Nuthmann: Fixation durations in scene viewing. Psychonomic Bulletin & Review 24 (2017)
    370-392 (the eyes move about three times a second).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

STILL = 1.0 / 3.0  # a picture that does not change tells something for one fixation [s]
HALF_SEEN = 0.03  # what fills this angle looks half like what it is [rad]; assumed


def clearness(angle: float) -> float:
    """How much something looks like what it is, from 0 to 1, by the angle that it fills [rad]."""
    return float(1.0 - 2.0 ** (-angle / HALF_SEEN))


def worth(gap: float) -> float:
    """What the pictures of the last `gap` [s] are worth, in time looked at a moving one [s].

    So evidence comes as fast as fresh pictures do, up to three a second.
    """
    return min(gap, STILL)


class Evidence:
    """What speaks for an event, as one person weighs it.

    In a clear picture the level drifts by `sensitivity / 2` a second towards the criterion if the
    event fills the picture, and away from it if it is not there; the noise has a variance of 1 a
    second. In a picture of contrast `c` the drift is `c^1.5` of that and the variance `c`: a
    person discounts what is unclear, but less than would keep the errors as rare (assumed).

    Args:
        sensitivity: Of the person: how well a second in plain view tells an event from none, in
            standard deviations [1/sqrt(s)].
        look: How long an event in plain view is looked at until the person is sure [s]; the
            criterion is what that adds up to.
        luck: Standard normal numbers, one for each look.

    Attributes:
        level: Of the evidence.
        criterion: From this level on, the person is sure.
    """

    def __init__(self, sensitivity: float, look: float, luck: Iterator[float]) -> None:
        self._sensitivity, self._luck = sensitivity, luck
        self.criterion = 0.5 * sensitivity * look
        self.level = 0.0

    @property
    def sure(self) -> bool:
        """Whether the person says that it is there."""
        return self.level >= self.criterion

    @property
    def leans(self) -> bool:
        """Whether the person is more than half convinced."""
        return self.level >= 0.5 * self.criterion

    def weigh(self, duration: float, clear: float, contrast: float) -> None:
        """Look for some time [s].

        Args:
            duration: What the look is worth.
            clear: How much what is seen looks like the event, from 0 (not at all) to 1.
            contrast: Share of the contrast that smoke leaves.
        """
        weight = math.sqrt(contrast)
        drift = weight * contrast * self._sensitivity * (clear - 0.5)
        noise = weight * math.sqrt(duration) * next(self._luck)
        self.level = max(0.0, self.level + drift * duration + noise)
