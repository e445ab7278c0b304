"""Mutation test: plants faults, one at a time, and says which of them nobody notices.

    make mutants                        60 faults: each room its share, at least one
    make mutants ROOM=agents/robot      50 faults of one folder of `dva_sim`
    make mutants ROOM=core DRAW=again   other faults, by the same rule
    make mutants PLANTED=all STORMS=8   all bugs with a name, in at most 8 storms each
    make mutants PLANTED=two-holders    one of them, in at most 32 storms

Of the first kind are changes of one operator, number or call; the tests of their room should notice
them. Of the second kind are functions that do the wrong thing; a safety rule should break in a
storm. The files below `tests/helpers/mutation` say which faults there are, how some are drawn and
when one counts as noticed. Verdicts are kept in `results/mutants`: the same command resumes, and
`--again` tries those once more that nobody noticed. Faults that change nothing are listed with the
reason in `tests/data/mutation/equivalent.csv`; `--note` appends the score to `scores.csv` there.
For another commit run this file in a work tree of that commit. In `network`, faults in middleware
are noticed only after `make extras`, with the program mosquitto installed.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from helpers.mutation import scores
from helpers.mutation.bugs import named
from helpers.mutation.faults import Mutant, drawn
from helpers.mutation.hunting import hunted
from helpers.mutation.planting import Bug
from helpers.mutation.scores import Trial, Verdicts, score
from helpers.mutation.trials import tried
from helpers.paths import ROOT

from dva_sim.kernel.errors import ConfigError

Faults = Sequence[Mutant] | Sequence[Bug]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--room", default="", help="a folder below dva_sim, such as core")
    parser.add_argument("--number", type=int, help="of faults: 60, or 50 in one room")
    parser.add_argument("--draw", default="1", metavar="WORD", help="others, by the same rule")
    parser.add_argument(
        "--planted", default="", metavar="NAME", help="all bugs with a name, or one"
    )
    parser.add_argument("--storms", type=int, default=32, help="at most, for each of those")
    parser.add_argument("--only", default="", metavar="WORD", help="those with it in their line")
    parser.add_argument("--list", action="store_true", help="print the faults, plant none")
    parser.add_argument("--again", action="store_true", help="try unnoticed ones once more")
    parser.add_argument("--quick", action="store_true", help="start no whole programs")
    parser.add_argument("--note", action="store_true", help="append the score to scores.csv")
    parser.add_argument("-j", "--jobs", type=int, default=2, help="trials at a time")
    wish = parser.parse_args()
    faults: Faults
    trials: Callable[[Faults, int], Iterator[Trial]]
    if wish.planted:
        try:
            faults = named(wish.planted)
        except ConfigError as error:
            parser.error(str(error))
        room, draw, trials = "storms", str(wish.storms), partial(hunted, storms=wish.storms)
    else:
        if not (ROOT / "dva_sim" / wish.room).is_dir():
            parser.error(f"dva_sim has no folder {wish.room}: name one, as core or agents/robot")
        faults = drawn(wish.draw, wish.number or (50 if wish.room else 60), wish.room)
        room, draw, trials = wish.room or "all", wish.draw, partial(tried, only_quick=wish.quick)
    faults = [fault for fault in faults if wish.only in fault.description]
    if wish.list:
        print(*(fault.description for fault in faults), sep="\n")
        return 0
    name = f"{room.replace('/', '-')}-{draw}.csv"
    verdicts = Verdicts(ROOT / "results" / "mutants" / name)
    known = verdicts.noticed_by
    if wish.again:
        known = {name: by for name, by in known.items() if by} | scores.equivalents()
    missing = [fault for fault in faults if fault.name not in known]
    for trial in trials(missing, wish.jobs) if missing else ():
        verdicts.note(trial.name, trial.noticed_by)
        print(trial, flush=True)
    report(faults, verdicts)
    result = score(room, draw, [fault.name for fault in faults], verdicts)
    print(result)
    if wish.note:
        scores.append(result)
    return int(bool(wish.planted) and result.noticed < len(faults))


def report(faults: Faults, verdicts: Verdicts) -> None:
    """Print the faults that nobody noticed, with the reason where they change nothing."""
    reasons = scores.equivalents()
    for fault in faults:
        if not verdicts.noticed_by.get(fault.name):
            print(f"{fault.description}  {reasons.get(fault.name, '')}".rstrip())


if __name__ == "__main__":
    sys.exit(main())
