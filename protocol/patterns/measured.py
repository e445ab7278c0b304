"""A pattern that is none: commands leave and arrive when they did over real middleware.

    pattern: measured.py:Measured
    pattern_options: {file: commands.csv, where: {middleware: mqtt-0, link: outage}}

The file is the table `commands` of a study with `model: middleware`:
`dva-sim export results/middleware --table commands -o commands.csv`.
"""

import csv
import math
from collections import defaultdict

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.resources import find
from dva_sim.network.patterns import Pattern

_OF_RUN = "cell", "person", "trial"  # columns that tell the runs of a study apart


class Measured(Pattern):
    """Publish each command when one was sent over real middleware, to arrive when that one did.

    Whatever the middleware did is in the times: requests that waited for answers, packets that
    were repeated, queues, outages. The modelled link adds its own delay towards the robot, which
    should be zero. What was measured, run after run, is repeated for as long as the drive lasts.

    Args:
        file: Table of commands with the columns `made_s` and `arrived_s`, by name or path.
        where: Values of other columns, of the rows that count.
    """

    title, label = "measured arrivals", "measured"
    sockets, when_slow = "XPUB to SUB", "as measured"
    published = newest_wins = True

    def __init__(self, file, where=None):
        self.schedule, self.length = [], 0.0
        for run in _runs(file, where or {}):
            first, last = run[0][0], run[-1][0]
            begin = self.length - first
            self.schedule += [(made + begin, arrived + begin) for made, arrived in run]
            self.length += (last - first) * len(run) / (len(run) - 1)
        self.waiting, self.last, self.is_over = None, -1, False

    def begin(self, line):
        """A drive begins: the first sending is now."""
        super().begin(line)
        self.start = line.clock.now
        self._send(0)

    def offer(self, command):
        """Keep the newest for the next sending."""
        if self.waiting is not None:
            self.line.supersede(self.waiting)
        self.waiting = command

    def end(self):
        """The drive is over: what is still on its way is lost."""
        self.is_over = True

    def _send(self, number):
        if self.is_over:
            return
        rounds, at = divmod(number, len(self.schedule))
        made, arrived = self.schedule[at]
        if self.waiting is not None:
            command, self.waiting = self.line.newest(self.waiting), None
            then = self.line.clock.now + arrived - made
            self.line.clock.call_at(then, lambda: self._arrive(number, command))
        rounds, at = divmod(number + 1, len(self.schedule))
        due = self.start + rounds * self.length + self.schedule[at][0]
        self.line.clock.call_at(due, lambda: self._send(number + 1))

    def _arrive(self, number, command):
        """Publish it, unless a newer one was there first, as where one round follows another."""
        if number > self.last and not self.is_over:
            self.last = number
            self.line.publish(command)


def _runs(file, where):
    """Return the pairs of times, sent and applied [s], of each run that has any two."""
    path = find(file, "experiments/traces", ".csv")
    with path.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    missing = {"made_s", "arrived_s", *where} - set(rows[0] if rows else ())
    if missing:
        raise ConfigError(f"has no column {', '.join(sorted(missing))}", path)
    runs = defaultdict(list)
    try:
        for row in rows:
            if all(row[key] == str(value) for key, value in where.items()):
                times = float(row["made_s"]), float(row["arrived_s"] or "nan")
                runs[tuple(row.get(key) for key in _OF_RUN)].append(times)
    except ValueError as error:
        raise ConfigError(f"times should be numbers: {error}", path) from None
    found = [run for run in map(_applied, runs.values()) if len(run) > 1]
    if not found:
        place = ", ".join(f"{key} {value}" for key, value in where.items()) or "the file"
        raise ConfigError(f"of {place}, fewer than two commands arrived", path)
    return found


def _applied(pairs):
    """Return those of the commands that a robot would apply: a newer one had not arrived."""
    newest, kept = -math.inf, []
    arrivals = (pair for pair in pairs if math.isfinite(pair[1]))
    for made, arrived in sorted(arrivals, key=lambda pair: pair[1]):
        if made > newest and arrived >= made:
            newest = made
            kept.append((made, arrived))
    return kept
