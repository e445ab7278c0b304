"""Coverage of 95 % intervals where few persons or a stopping rule decide, as reported to users.

Differences are drawn of known mean: of skewness 2 (exponential) and of about 6 (log-normal).
"""

import math
import re

import numpy as np
import pytest
from helpers.paths import ROOT

from dva_sim.experiments.study.answerable import OF_BANDS, OF_STOPPING
from dva_sim.statistics import LEVEL, band

STUDIES, AT_ONCE, LEVELS = 2000, 250, 6
HALF_WIDTH = 0.3  # standard deviations of a person's difference
FIRST, MOST = 12, 240


def exponential(size, rng):
    return rng.exponential(size=size) - 1


def log_normal(size, rng):
    """Draw values of skewness 6.2, mean 0 and variance 1."""
    spread = math.sqrt((math.e - 1) * math.e)
    return (rng.lognormal(0, 1, size) - math.exp(0.5)) / spread


LAWS = (exponential, log_normal)


def share_held(law, looks, level):
    """Share of studies whose interval holds the mean when they end at the first narrow one."""
    rng, held = np.random.default_rng(2026), 0
    for _ in range(STUDIES // AT_ONCE):
        values, is_open = law((MOST, AT_ONCE), rng), np.ones(AT_ONCE, dtype=bool)
        for persons in looks:
            found = band(values[:persons], level)
            low, high = found.pointwise_low, found.pointwise_high
            ends = is_open & ((high - low <= 2 * HALF_WIDTH) | (persons == looks[-1]))
            held += int((ends & (low <= 0) & (high >= 0)).sum())
            is_open &= ~ends
    return held / STUDIES


@pytest.mark.soak
@pytest.mark.parametrize("which", [0, 1])
def test_a_stop_by_width_covers_what_is_told(which):
    looks = range(FIRST, MOST + 1, FIRST)
    assert share_held(LAWS[which], looks, LEVEL) == pytest.approx(OF_STOPPING[which], abs=0.015)


@pytest.mark.soak
@pytest.mark.parametrize("law", LAWS)
def test_a_stop_on_a_schedule_covers_95_percent(law):
    looks = (24, 48, 96, 192, MOST)
    assert share_held(law, looks, 1 - (1 - LEVEL) / len(looks)) >= 0.945


@pytest.mark.soak
@pytest.mark.parametrize("law", LAWS)
def test_48_persons_fixed_beforehand_cover_95_percent(law):
    assert share_held(law, (48,), LEVEL) >= 0.94


@pytest.mark.soak
@pytest.mark.parametrize("persons", OF_BANDS)
@pytest.mark.parametrize("which", [0, 1])
def test_a_band_of_few_persons_covers_what_is_told(persons, which):
    """Six levels whose differences do not depend on each other: the hardest case."""
    rng, held = np.random.default_rng(2027), 0
    for _ in range(STUDIES):
        found = band(LAWS[which]((persons, LEVELS), rng))
        held += bool(((found.low <= 0) & (found.high >= 0)).all())
    assert held / STUDIES == pytest.approx(OF_BANDS[persons][which], abs=0.015)


def test_the_page_and_the_program_say_the_same():
    page = (ROOT / "docs/explanation/statistics.md").read_text(encoding="utf-8")
    for persons, shares in OF_BANDS.items():
        cells = " | ".join(f"{100 * share:.0f}" for share in shares)
        assert re.search(rf"\b{persons} persons \| {re.escape(cells)} \|", page)
    cells = " | ".join(f"{100 * share:.0f}" for share in OF_STOPPING)
    assert f"`batch_persons: {FIRST}` | {cells} |" in page
