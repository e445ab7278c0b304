"""A pattern that is none: commands leave and arrive when they did over real middleware.

    pattern: measured.py:Measured
    pattern_options: {file: commands.csv, where: {middleware: mqtt-0, link: outage}}

The file is the table `commands` of a study with `model: middleware`:
`dva-sim export results/middleware --table commands -o commands.csv`. It may be compressed by gzip.
"""

import math
import random

from dva_sim.kernel.errors import ConfigError
from dva_sim.kernel.resources import find
from dva_sim.network.measured_commands import measured_runs
from dva_sim.network.patterns import Pattern


class Measured(Pattern):
    """Publish each command when one was sent over real middleware, to arrive when that one did.

    Whatever the middleware did is in the times: requests that waited for answers, packets that
    were repeated, queues, outages. The modelled link adds its own delay towards the robot, which
    should be zero. What was measured, run after run, is repeated for as long as the drive lasts.

    Args:
        file: Table of commands with the columns `made_s` and `arrived_s`, by name or path.
        where: Values of other columns, of the rows that count.
        window_s: Part of each run whose arrivals count [s], such as `[5, 13]`; all of it if None.
            Runs that found no connection are left out; if none found one, nothing ever arrives.
    """

    title, label = "measured arrivals", "measured"
    sockets, when_slow = "XPUB to SUB", "as measured"
    published = newest_wins = True

    def __init__(self, file, where=None, window_s=None):
        path = find(file, "experiments/traces", ".csv")
        runs = [run for run in measured_runs(path, where or {}) if run]
        events, self.length, are_sent = [], 0.0, False
        for run in runs:
            since, until = _whole(run) if window_s is None else window_s
            begin = self.length - since
            events += [(m + begin, a + begin) for m, a in run if since <= a < until]
            are_sent |= any(since <= m < until for m, _ in run)
            self.length += until - since
        if runs and not are_sent:
            raise ConfigError(f"no command was sent from {since} to {until} s of a run", path)
        self.schedule = _applied(events)
        self.waiting, self.last, self.is_over = None, -1, False

    def begin(self, line):
        """A drive begins, anywhere in what was measured: at the same place over each middleware."""
        super().begin(line)
        if self.schedule:
            place = random.Random(line.clock.now).uniform(0.0, self.length)
            self.start = line.clock.now - place
            first = next((n for n, (made, _) in enumerate(self.schedule) if made >= place), None)
            self._expect(len(self.schedule) if first is None else first)

    def offer(self, command):
        """Keep the newest for the next sending."""
        if self.waiting is not None:
            self.line.supersede(self.waiting)
        self.waiting = command

    def end(self):
        """The drive is over: what is still on its way is lost."""
        self.is_over = True

    def _expect(self, number):
        rounds, at = divmod(number, len(self.schedule))
        due = self.start + rounds * self.length + self.schedule[at][0]
        self.line.clock.call_at(max(due, self.line.clock.now), lambda: self._send(number))

    def _send(self, number):
        if self.is_over:
            return
        made, arrived = self.schedule[number % len(self.schedule)]
        if self.waiting is not None:
            command, self.waiting = self.line.newest(self.waiting), None
            then = self.line.clock.now + arrived - made
            self.line.clock.call_at(then, lambda: self._arrive(number, command))
        self._expect(number + 1)

    def _arrive(self, number, command):
        """Publish it, unless a newer one was there first, as where one round follows another."""
        if number > self.last and not self.is_over:
            self.last = number
            self.line.publish(command)


def _whole(run):
    """Return when a run began, and when the next may follow it [s]."""
    made, times = [m for m, _ in run], [t for pair in run for t in pair if math.isfinite(t)]
    gap = (max(made) - min(made)) / (len(made) - 1) if len(made) > 1 else 0.0
    return min(made), max(times) + gap


def _applied(pairs):
    """Return those of the commands that a robot would apply: a newer one had not arrived."""
    newest, kept = -math.inf, []
    for made, arrived in sorted(pairs, key=lambda pair: pair[1]):
        if made > newest and arrived >= made:
            newest = made
            kept.append((made, arrived))
    return kept
