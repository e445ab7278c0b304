"""Campaigns of storms, run by processes of this machine; saved as they end, and resumable."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from scipy.stats import chi2

from dva_sim.experiments.execution.executors import Workers
from dva_sim.experiments.study.hashing import fingerprint_of_storms
from dva_sim.kernel.errors import ConfigError, DvaSimError
from dva_sim.kernel.recorder import Breach
from dva_sim.storms.drawing import draw
from dva_sim.storms.outcome import StormOutcome
from dva_sim.storms.plan import StormPlan
from dva_sim.storms.regional_storm import draw_regions
from dva_sim.storms.storm import play

HOUR = 3600.0
REGIONS: Final = "regions"
"""Name, used like a profile, for storms of several DVAs."""
CONFIDENCE: Final = 0.95
LOOK_EVERY = 1.0  # interval of checks of the processes [s]


@dataclass
class StormTally:
    """Totals of many storms.

    Attributes:
        storms: Number of storms.
        hours: Simulated time of one team each [h].
        cpu_s: CPU time [s].
        faults: Number of faults by kind.
        messages: Number of messages that faults have touched, by kind.
        failures: Seeds of the storms that broke a rule, with the rules.
    """

    storms: int = 0
    hours: float = 0.0
    cpu_s: float = 0.0
    faults: Counter[str] = field(default_factory=Counter)
    messages: Counter[str] = field(default_factory=Counter)
    failures: dict[int, list[str]] = field(default_factory=dict)

    def add(self, outcome: StormOutcome) -> None:
        """Count one more storm."""
        self.storms += 1
        self.hours += outcome.simulated_s / HOUR
        self.cpu_s += outcome.cpu_s
        self.faults += outcome.faults
        self.messages += outcome.messages
        if not outcome.is_clean:
            self.failures[outcome.seed] = sorted(outcome.signature)

    def most_per_hour(self) -> float:
        """Return the exact upper limit of failed storms per hour of one team (Garwood 1936)."""
        if not self.hours:
            return float("inf")
        return float(chi2.ppf(CONFIDENCE, 2 * (len(self.failures) + 1)) / 2 / self.hours)


def play_seed(seed: int, profile: str) -> StormOutcome:
    """Play the storm of a seed."""
    return play(drawn(seed, profile))


def drawn(seed: int, profile: str) -> StormPlan:
    """Draw the storm of a seed: by a profile of faults, or of several DVAs.

    Raises:
        ConfigError: there is no such profile.
    """
    return draw_regions(seed) if profile == REGIONS else draw(seed, profile)


class Journal:
    """Outcomes of storms in a file, one line each, so that a campaign can be resumed.

    Those that another version of the program has played do not count, and stay in the file.

    Args:
        file: File; created if missing.

    Raises:
        ConfigError: it is something else.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._code = fingerprint_of_storms()
        self.outcomes: dict[tuple[str, int], StormOutcome] = {}
        if not file.exists():
            return
        whole = file.read_bytes()
        lines, _, rest = whole.rpartition(b"\n")
        try:
            for line in lines.splitlines():
                row = json.loads(line)
                code = row.pop("code", "")
                outcome = outcome_of(row)
                if code == self._code:
                    self.outcomes[row["profile"], outcome.seed] = outcome
        except (ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"is no journal of storms: {error}", file) from None
        if rest:  # part of a line: a process was killed while it wrote
            os.truncate(file, len(whole) - len(rest))

    def keep(self, profile: str, outcome: StormOutcome) -> None:
        """Write down the outcome of a storm.

        Raises:
            DvaSimError: the disk is full, or refuses to be written.
        """
        self.outcomes[profile, outcome.seed] = outcome
        line = json.dumps({"code": self._code, "profile": profile, **plain(outcome)})
        try:
            with self._file.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise DvaSimError(
                f"{self._file} cannot be written: {error.strerror}; finished storms are kept: "
                "mend that, then run the same command again"
            ) from None


def plain(outcome: StormOutcome) -> dict[str, Any]:
    """Return an outcome as a JSON object."""
    return {
        **{key: value for key, value in vars(outcome).items() if key != "breaches"},
        "breaches": [vars(breach) for breach in outcome.breaches],
    }


def outcome_of(row: dict[str, Any]) -> StormOutcome:
    """Return an outcome from JSON."""
    fields = {key: value for key, value in row.items() if key not in ("profile", "breaches")}
    for counted in ("faults", "messages"):
        fields[counted] = Counter(fields[counted])
    return StormOutcome(**fields, breaches=[Breach(**each) for each in row["breaches"]])


def outcomes(
    seeds: Iterable[int], profile: str, journal: Journal, workers: Workers
) -> Iterator[tuple[StormOutcome, bool]]:
    """Yield the outcomes of storms as they end, and whether each was in the journal before.

    Args:
        seeds: Seeds of the storms.
        profile: Profile of fault kinds.
        journal: Journal of outcomes.
        workers: Workers that run the storms.
    """
    waiting = set[Future[StormOutcome]]()
    task = workers.guarded(play_seed)
    with workers.executor(workers.width, play_seed) as executor:
        for seed in seeds:
            outcome = journal.outcomes.get((profile, seed))
            if outcome is not None:
                yield outcome, True
                continue
            waiting.add(executor.submit(task, seed, profile))
            while len(waiting) >= 2 * workers.width:
                yield from _ended(waiting, profile, journal, workers)
        while waiting:
            yield from _ended(waiting, profile, journal, workers)


def _ended(
    waiting: set[Future[StormOutcome]], profile: str, journal: Journal, workers: Workers
) -> Iterator[tuple[StormOutcome, bool]]:
    """Yield the outcomes of storms that have ended, and wait for them no longer."""
    done, _ = wait(waiting, LOOK_EVERY, FIRST_COMPLETED)
    workers.look_after(not done)
    waiting -= done
    for outcome in sorted((future.result() for future in done), key=lambda each: each.seed):
        journal.keep(profile, outcome)
        yield outcome, False
