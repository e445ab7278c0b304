"""Mutation test: plants faults, one at a time, and runs the tests of their room.

    make mutants                        60 faults: each room its share, at least one
    make mutants ROOM=agents/robot      50 faults of one folder of `dva_sim`
    make mutants ROOM=core DRAW=again   other faults, by the same rule

The files below `tests/helpers/mutation` say which faults there are, how some are drawn and when
one counts as noticed. Verdicts are kept in `results/mutants`: the same command resumes, and
`--again` tries those once more that no test noticed. Faults that change nothing are listed with the
reason in `tests/data/mutation/equivalent.csv`; `--note` appends the score to `scores.csv` there.
For another commit run this file in a work tree of that commit.
"""

import argparse
import sys
from collections.abc import Sequence

from helpers.mutation import scores
from helpers.mutation.faults import Mutant, drawn
from helpers.mutation.scores import Verdicts, score
from helpers.mutation.trials import tried
from helpers.paths import ROOT


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--room", default="", help="a folder below dva_sim, such as core")
    parser.add_argument("--number", type=int, help="of faults: 60, or 50 in one room")
    parser.add_argument("--draw", default="1", metavar="WORD", help="others, by the same rule")
    parser.add_argument("--only", default="", metavar="WORD", help="those with it in their line")
    parser.add_argument("--list", action="store_true", help="print the faults, plant none")
    parser.add_argument("--again", action="store_true", help="try unnoticed ones once more")
    parser.add_argument("--quick", action="store_true", help="start no whole programs")
    parser.add_argument("--note", action="store_true", help="append the score to scores.csv")
    parser.add_argument("-j", "--jobs", type=int, default=2, help="copies of the tree at work")
    wish = parser.parse_args()
    if not (ROOT / "dva_sim" / wish.room).is_dir():
        parser.error(f"dva_sim has no folder {wish.room}: name one, such as core or agents/robot")
    mutants = drawn(wish.draw, wish.number or (50 if wish.room else 60), wish.room)
    mutants = [mutant for mutant in mutants if wish.only in mutant.description]
    if wish.list:
        print(*(mutant.description for mutant in mutants), sep="\n")
        return 0
    room = wish.room or "all"
    name = f"{room.replace('/', '-')}-{wish.draw}.csv"
    verdicts = Verdicts(ROOT / "results" / "mutants" / name)
    try_out(mutants, verdicts, wish)
    report(mutants, verdicts)
    result = score(room, wish.draw, mutants, verdicts)
    print(result)
    if wish.note:
        scores.append(result)
    return 0


def try_out(mutants: Sequence[Mutant], verdicts: Verdicts, wish: argparse.Namespace) -> None:
    """Try the faults on which there is no verdict yet."""
    known = verdicts.tests
    if wish.again:
        known = {name: test for name, test in known.items() if test} | scores.equivalents()
    missing = [mutant for mutant in mutants if mutant.name not in known]
    for mutant, test, took in tried(missing, wish.jobs, wish.quick) if missing else ():
        verdicts.note(mutant, test)
        print("noticed " if test else "NOT SEEN", mutant.description, test, f"{took:.0f} s")
        sys.stdout.flush()


def report(mutants: Sequence[Mutant], verdicts: Verdicts) -> None:
    """Print the faults that no test noticed, with the reason where they change nothing."""
    reasons = scores.equivalents()
    for mutant in mutants:
        if not verdicts.tests.get(mutant.name):
            print(f"{mutant.description}  {reasons.get(mutant.name, '')}".rstrip())


if __name__ == "__main__":
    sys.exit(main())
