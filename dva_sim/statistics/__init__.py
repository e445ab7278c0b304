"""Statistics in which the simulated person is the cluster.

Trials of one person are alike, so they never count as independent: every interval here is based
on persons, either through their means or by resampling persons with all their trials. Missing
runs are nan and are left out; with fewer than two persons an interval is nan, not an error.
All intervals are Monte Carlo intervals: they are conditional on the model.

Coverage of 95 % intervals, in % of studies with 5 trials of each of 24, 12 and 6 persons; in
brackets, the share of the variance that lies between persons. Skewed is log-normal, of skewness
1.75 or 6.2; heavy tails are Student's with 5 degrees of freedom; incomplete is a fifth of the runs
and one person in twelve missing at random; studies are 10,000 (seed 2014) unless stated.

============================================================  ====  ====  ====
means and paired differences, and levels of a band alone        24    12     6
============================================================  ====  ====  ====
normal (0.3)                                                  95.8  96.2  97.3
skewness 1.75 (0)                                             95.7  96.2  97.0
skewness 1.75 (0.3)                                           95.7  95.7  96.4
skewness 1.75 (0.7)                                           95.6  95.0  95.6
skewness 1.75 (0.3), incomplete                               95.8  95.8  95.2
skewness 6.2 (0.3)                                            94.5  93.5  93.7
skewness 6.2 (0.7), incomplete                                93.3  92.4  89.7
heavy tails (0.3), incomplete                                 95.5  97.1  96.7
four fifths of runs zero (0.3), 2000 studies, seed 7          95.9  95.2  92.3
four fifths of persons and runs zero (0.7), 2000, seed 7      94.1  88.8  85.9
four fifths of persons zero, trials alike (1)                 94.0  82.7  64.5
normal (0), slow runs missing more often                      74.3  87.3  95.2
normal (0.3), the same, 4000, seed 7                          89.9  94.0  96.1
normal (0.7), the same, 4000, seed 7                          95.0  96.0  97.1
------------------------------------------------------------  ----  ----  ----
band over 6 skewed levels at once, 3000, seed 2015            94.2  95.7  95.7
paired size, skewed times, 2000, seed 2016                    96.0  96.8  98.6
average size, the same                                        95.9  96.0  97.6
correlation of pairs, the same                                94.4  94.8  96.9
ratio of variances, the same                                  93.0  93.2  97.6
share of 0.5 (0.3), seed 2017                                 96.8  97.1  97.9
share of 0.2 (0.3)                                            96.2  96.5  99.5
share of 0.2 (0.7)                                            96.9  95.2  99.8
share of 0.05 (0.3)                                           93.2  99.4  99.8
median, normal (0.3), 3000, seed 2018                         96.7  97.3  98.0
95th percentile, normal (0.3), the same                       97.1  98.7  99.3
95th percentile, normal (0.7), the same                       95.6  97.6  98.0
============================================================  ====  ====  ====

The percentile's upper end is infinite in 32 and 82 % of the studies of 24 persons, and in all of
fewer.

Limits: no interval is valid where slow runs are missing more often (here a third of those above the
median, a twentieth of those below), as the remaining runs are not representative. One-sided tests
at 5 % err too often towards the long tail: in 5 to 8 % of studies of skewness 1.75 and in 8 to 15 %
of skewness 6.2, and less often to the other side. The same holds for tests of equivalence. With 12
persons or fewer, most of them zero, intervals are too short.
"""

from dva_sim.statistics.bands import Band, band
from dva_sim.statistics.control_variates import adjusted, off_zero
from dva_sim.statistics.effect_sizes import (
    Components,
    EffectSize,
    VarianceReduction,
    components,
    effect_size,
    pair_correlation,
    variance_reduction,
)
from dva_sim.statistics.incidence import CUT, Incidence, cumulative_incidence, first_of, incidence
from dva_sim.statistics.paired_differences import (
    equivalence,
    holm,
    holm_levels,
    mean_interval,
    one_sided_test,
    paired_difference,
    permutation_test,
)
from dva_sim.statistics.persons import LEVEL, Floats, Interval, person_means, students_t
from dva_sim.statistics.proportions import quantile_interval, share_interval

__all__ = [
    "CUT",
    "LEVEL",
    "Band",
    "Components",
    "EffectSize",
    "Floats",
    "Incidence",
    "Interval",
    "VarianceReduction",
    "adjusted",
    "band",
    "components",
    "cumulative_incidence",
    "effect_size",
    "equivalence",
    "first_of",
    "holm",
    "holm_levels",
    "incidence",
    "mean_interval",
    "off_zero",
    "one_sided_test",
    "pair_correlation",
    "paired_difference",
    "permutation_test",
    "person_means",
    "quantile_interval",
    "share_interval",
    "students_t",
    "variance_reduction",
]
