"""Robots per operator, beside what theory makes of one robot alone.

    python experiments/fan_out.py results/robots-per-operator

prints for each kind of control what one robot needs, and for each number of robots the alarms
cleared per minute with their standard error: as seen, by the fan-out formula, and by a queue with a
finite source.
"""

import sys

from dva_sim.experiments.analysis.fan_out import need_of, settled_per_person
from dva_sim.experiments.results.results import Results

WARM_UP_S = 100.0


def main(folder: str) -> None:
    """Print the comparison for a results folder."""
    results = Results.load(folder)
    (part,) = results.study["parts"]
    for control in results.factors["control"]:
        need = need_of(results, part, {"control": control, "robot.count": 1}, WARM_UP_S)
        times = f"neglect {need.neglect:.1f} s, interaction {need.interaction:.1f} s"
        print(f"{control}: {times}, fan-out {need.fan_out:.1f}")
        print("robots  seen (s.e.)    fan-out  queue   [per min]")
        for robots in results.factors["robot.count"]:
            where = {"control": control, "robot.count": robots}
            seen = 60.0 * settled_per_person(results, part, where, WARM_UP_S)
            error = seen.std(ddof=1) / len(seen) ** 0.5
            bound, queue = need.rate_without_waiting(robots), need.rate_with_waiting(robots)
            row = f"{robots:6d} {seen.mean():5.2f} ({error:.2f})"
            print(f"{row} {60.0 * bound:10.2f} {60.0 * queue:6.2f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
