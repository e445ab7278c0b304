"""Verdicts on planted faults, kept so that a search can be resumed, and the scores of rooms."""

import csv
import subprocess
from collections.abc import Collection
from datetime import date
from pathlib import Path
from typing import NamedTuple

from helpers.paths import ROOT, TESTS

SCORES = TESTS / "data" / "mutation" / "scores.csv"
EQUIVALENT = TESTS / "data" / "mutation" / "equivalent.csv"


def equivalents() -> dict[str, str]:
    """Return, by its name, why a fault changes nothing that anybody could rely on."""
    with EQUIVALENT.open(encoding="utf-8", newline="") as file:
        return {row["fault"]: row["reason"] for row in csv.DictReader(file)}


class Trial(NamedTuple):
    """Result of planting a fault."""

    name: str
    description: str
    noticed_by: str  # a test, or the rules that broke; empty: nothing
    took_s: float

    def __str__(self) -> str:
        seen = "noticed " if self.noticed_by else "NOT SEEN"
        return f"{seen} {self.description} {self.noticed_by} {self.took_s:.0f} s"


class Verdicts:
    """Verdicts on faults in a file: by the name of each who noticed it, empty if nobody did."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self.noticed_by: dict[str, str] = {}
        if file.exists():
            with file.open(encoding="utf-8", newline="") as lines:
                self.noticed_by = dict(csv.reader(lines))

    def note(self, name: str, noticed_by: str) -> None:
        """Append a verdict; a later one on the same fault counts."""
        self.noticed_by[name] = noticed_by
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a", encoding="utf-8", newline="") as file:
            csv.writer(file).writerow((name, noticed_by))


class Score(NamedTuple):
    """Score of the tests of a room; columns of `SCORES`."""

    room: str
    draw: str
    mutants: int
    noticed: int
    equivalent: int
    share: float
    date: str
    commit: str

    def __str__(self) -> str:
        real = self.mutants - self.equivalent
        alike = f", {self.equivalent} more change nothing" if self.equivalent else ""
        return f"{self.room}: {self.noticed} of {real} faults noticed, {self.share:.0%}{alike}"


def score(room: str, draw: str, names: Collection[str], verdicts: Verdicts) -> Score:
    """Return the share of noticed faults among those that change something."""
    same = equivalents()
    noticed = sum(bool(verdicts.noticed_by.get(name)) for name in names)
    equivalent = sum(name in same and not verdicts.noticed_by.get(name) for name in names)
    share = noticed / max(1, len(names) - equivalent)
    words = ["git", "-C", str(ROOT), "rev-parse", "--short=8", "HEAD"]
    commit = subprocess.check_output(words, text=True).strip()
    today = date.today().isoformat()
    return Score(room, draw, len(names), noticed, equivalent, round(share, 3), today, commit)


def append(new: Score) -> None:
    """Append a score to the file of all scores."""
    with SCORES.open("a", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerow(new)
