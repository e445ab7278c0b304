"""The models of persons under which a study's contrast is repeated.

Each strategy is tried with the usual parameters (set 0) and with sets drawn from the bands
within which calibration leaves them open. Runs share persons and luck with the study's own, so
that nothing but the model differs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from dva_sim.agents.population import Population
from dva_sim.experiments.study.parts import REPEATS, STRATEGY, Level, Range, RobustnessRule
from dva_sim.experiments.study.study import Study
from dva_sim.kernel import resources
from dva_sim.kernel.config import Config, load_yaml, validate
from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.streams import Streams

PEOPLE = "agents/people"
PARAMETERS = "parameters"  # factor: which set of parameters
TRAITS = "operator.traits"
_DIGITS = 4  # significant ones of a drawn parameter

Floats = NDArray[np.float64]
Traits = dict[str, float]


class Bands(Config):
    """How far calibration leaves each parameter open.

    Attributes:
        bands: `[low, high]` of the median of each trait, under the trait's key.
    """

    description: str = ""
    bands: Annotated[dict[str, Range], Field(min_length=1)]

    @field_validator("bands")
    @classmethod
    def _are_of_traits(cls, value: dict[str, Range]) -> dict[str, Range]:
        known = Population.model_fields.keys() - {"description"}
        for name, (low, _) in value.items():
            if name not in known:
                traits = ", ".join(t for t in Population.model_fields if t in known)
                raise ValueError(f"no trait {name!r}; traits: {traits}")
            if low <= 0:
                raise ValueError(f"band of {name!r} should be above zero, not from {low:g}")
        return value


def factors_of_repeats(study: Study) -> dict[str, tuple[Level, ...]]:
    """What varies between and within repeats, in order; nothing where none are declared."""
    robustness, answer = study.robustness, study.answer
    if robustness is None or answer is None or answer.over is None:
        return {}
    strategies = {STRATEGY: robustness.strategies} if robustness.strategies else {}
    at = robustness.at or study.factors[answer.over][-1:]
    sets = tuple(range(robustness.sets + 1))
    return {**strategies, PARAMETERS: sets, answer.factor: answer.contrast, answer.over: at}


def settings_of_repeats(study: Study) -> dict[str, Level]:
    """Levels of the factors that do not vary between repeats: those of the answer's panel."""
    assert study.answer is not None
    answer = study.answer
    fixed = {
        f: levels for f, levels in study.factors.items() if f not in (answer.factor, answer.over)
    }
    return {f: answer.within.get(f, levels[0]) for f, levels in fixed.items()}


def parameter_sets(study: Study) -> list[Traits]:
    """The traits of each set; of set 0, the usual one, none.

    Raises:
        ConfigError: the bands cannot be read.
    """
    robustness = study.robustness
    if robustness is None or not robustness.sets:
        return [{}]
    bands = _bands_of(study, robustness)
    rng = Streams(study.seed).fresh("robustness")
    places = latin_hypercube(robustness.sets, len(bands), rng)
    return [
        {},
        *(
            {n: _between(b, u) for (n, b), u in zip(bands.items(), row, strict=True)}
            for row in places
        ),
    ]


def latin_hypercube(points: int, axes: int, rng: np.random.Generator) -> Floats:
    """Points in the unit cube `(points, axes)`: along each axis one in each of equal slices.

    References:
        McKay, Beckman & Conover, Technometrics 21 (1979), 239-245.
    """
    slices = np.array([rng.permutation(points) for _ in range(axes)]).T.reshape(points, axes)
    return np.asarray((slices + rng.random((points, axes))) / points)


def _between(band: Range, share: float) -> float:
    """Geometrically between the ends, since traits are log-normal."""
    low, high = band
    value = low * (high / low) ** share
    return float(f"{value:.{_DIGITS}g}")


def _bands_of(study: Study, robustness: RobustnessRule) -> Mapping[str, Range]:
    try:
        document = load_yaml(resources.find(robustness.bands, PEOPLE, base=study.folder))
    except ConfigError as error:
        here = study.error(error.problem, (REPEATS, "bands"))
        raise here if error.file is None else error from None
    return validate(Bands, document.data, document.error).bands
