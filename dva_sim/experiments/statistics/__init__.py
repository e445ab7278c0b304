"""Statistics in which the simulated person is the cluster.

Trials of one person are alike, so they never count as independent: every interval here rests
on persons, either through their means or by drawing persons with all their trials. Missing
runs are nan and are left out; with fewer than two persons an interval is nan, not an error.
All intervals are Monte Carlo intervals: they hold given the model.
"""

from dva_sim.experiments.statistics.bands import Band, band
from dva_sim.experiments.statistics.components import Components, components
from dva_sim.experiments.statistics.effect_sizes import EffectSize, effect_size
from dva_sim.experiments.statistics.equivalence import Equivalence, equivalence, one_sided_test
from dva_sim.experiments.statistics.factorial import Effect, factorial_effects
from dva_sim.experiments.statistics.families import holm
from dva_sim.experiments.statistics.incidence import Incidence, cumulative_incidence
from dva_sim.experiments.statistics.means import mean_interval, paired_difference
from dva_sim.experiments.statistics.pairing import (
    VarianceReduction,
    pair_correlation,
    variance_reduction,
)
from dva_sim.experiments.statistics.permutation import PermutationTest, permutation_test
from dva_sim.experiments.statistics.persons import LEVEL, Interval, person_means
from dva_sim.experiments.statistics.planning import needed_persons, power
from dva_sim.experiments.statistics.resampling import bootstrap_interval
from dva_sim.experiments.statistics.shares import quantile_interval, share_interval
from dva_sim.experiments.statistics.sobol import SobolIndex, sobol_indices

__all__ = [
    "LEVEL",
    "Band",
    "Components",
    "Effect",
    "EffectSize",
    "Equivalence",
    "Incidence",
    "Interval",
    "PermutationTest",
    "SobolIndex",
    "VarianceReduction",
    "band",
    "bootstrap_interval",
    "components",
    "cumulative_incidence",
    "effect_size",
    "equivalence",
    "factorial_effects",
    "holm",
    "mean_interval",
    "needed_persons",
    "one_sided_test",
    "pair_correlation",
    "paired_difference",
    "permutation_test",
    "person_means",
    "power",
    "quantile_interval",
    "share_interval",
    "sobol_indices",
    "variance_reduction",
]
