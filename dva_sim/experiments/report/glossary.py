"""The words of a report that not every reader knows, explained where they first stand.

A page links each word, where it is first said, to the list at its foot; paper marks it there with
a small ring. Only words that a report says are in its list.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from dva_sim.network.patterns import PATTERNS, Pattern, meaning_of

RING = "°"  # marks on paper what the list explains


@dataclass(frozen=True)
class Term:
    """A word or phrase.

    Attributes:
        name: As the list has it.
        means: In one sentence, without its full stop.
        said: Pattern of how it is said in a text, if otherwise than its name.
    """

    name: str
    means: str
    said: str = ""

    @property
    def key(self) -> str:
        """The name as an identifier."""
        return "word-" + re.sub(r"[^a-z0-9]+", "-", self.name.lower()).strip("-")

    @property
    def pattern(self) -> str:
        """As a regular expression."""
        return self.said or rf"\b{re.escape(self.name)}\b"


def _called(kind: type[Pattern]) -> str:
    """Either of a pattern's names, the longer one first."""
    return rf"\b(?:{re.escape(kind.title)}|{re.escape(kind.label)})"


TERMS = (
    *(Term(kind.title, meaning_of(kind), _called(kind)) for kind in PATTERNS.values()),
    Term(
        "phone default",
        "the app as mended here: a short filter (median of five), and commands at a steady rate",
        r"\bphone default\b|\bphone \(default\b",
    ),
    Term(
        "phone dissertation",
        "the app of the dissertation: a long filter (20 samples), and a command only on a change",
        r"\bphone dissertation\b",
    ),
    Term("direct control", "the operator steers by tilting the phone"),
    Term("coordinated control", "the operator steers, and the robot slows down near obstacles"),
    Term("supervisory control", "the robot drives by itself, and the operator judges the picture"),
    Term(
        "strategy adaptive",
        "persons steer without a break as long as they expect that to be quicker, else they move "
        "a little, wait and look",
    ),
    Term("strategy pursuit", "persons steer without a break towards a point ahead"),
    Term("moving and waiting", "making a short move, then waiting until its effect is seen"),
    Term("one-way delay", "the time from sender to receiver; commands and pictures each take it"),
    Term(
        "confirmed",
        "somebody, at the screen or on the spot, has seen that the event is real",
        r"\bconfirm(?:ed|s|ation)\b",
    ),
    Term("refuted", "somebody looked and did not see the event"),
    Term("escalated", "the surveillance system called for help from outside"),
    Term(
        "reference run",
        "the same person and trial, driven by an ideal operator who sees all at once",
    ),
    Term(
        "part",
        "one of the study's scenarios, run in all its configurations",
        r"(?<=[Ii]n )part\b|\bPart\b",
    ),
    Term(
        "configuration",
        "one combination of the levels that are varied",
        r"\bconfigurations?\b",
    ),
    Term(
        "trial",
        "one run of a person; it has the same start, event and random numbers in every "
        "configuration",
        r"\btrials?\b",
    ),
    Term("shift", "an independent period of work with its own alarms", r"\bshifts?\b"),
    Term(
        "95 % interval",
        "of 100 such studies about 95 would have the true value of the model within it",
    ),
    Term(
        "95 % band",
        "a 95 % interval for all levels at once, so wider than that of one level alone",
        r"95 % band",
    ),
    Term(
        "extrapolated",
        "the simulated persons are used at delays at which no published experiment watched people",
        r"\bextrapolated\b",
    ),
    Term("horizon", "the time after which a run ends in any case"),
    Term("safe stop", "the robot stands because no valid command reached it in time"),
    Term(
        "age of the command in force",
        "how old the command is that the robot obeys, on average over time",
    ),
    Term("power", "the chance that a study shows a difference that is really there"),
    Term("Holm", "a way to share the 5 % chance of a false alarm among several tests"),
    Term("restricted mean", "a mean in which no event counts with more than a fixed time"),
    Term("load", "the share of time in which the busiest kind of people is at work"),
    Term("exposure", "time that people spend near the danger"),
    Term("min_eta", "the oldest event first, to who of the free responders arrives earliest"),
    Term("hazard_team", "as min_eta, but a robot first where it is dangerous to look"),
    Term("nearest_idle", "the oldest event first, to the free responder with the shortest way"),
    Term("batch_optimal", "all open events and free responders are matched at once"),
    Term("coverage", "as min_eta, and guards without work move to where they are missed"),
    Term("priority_eta", "as min_eta, but the most urgent event first"),
)


def terms_in(texts: Iterable[str]) -> list[Term]:
    """Those that are said anywhere, in the order of their names."""
    marker = Marker(TERMS)
    found = {term for text in texts for _, term in marker.split(text) if term is not None}
    return sorted(found, key=lambda term: term.name.lower())


class Marker:
    """Finds each term where it is said for the first time.

    Args:
        terms: To be found.
    """

    def __init__(self, terms: Iterable[Term]) -> None:
        self._left = list(terms)

    def split(self, text: str) -> Iterator[tuple[str, Term | None]]:
        """A text in pieces, those that say a term for the first time with that term."""
        while self._left and (found := self._first(text)):
            match, term = found
            self._left.remove(term)
            if match.start():
                yield text[: match.start()], None
            yield match.group(), term
            text = text[match.end() :]
        if text:
            yield text, None

    def ringed(self, text: str) -> str:
        """A text with a ring behind each term that is said for the first time."""
        return "".join(f"{piece}{RING if term else ''}" for piece, term in self.split(text))

    def _first(self, text: str) -> tuple[re.Match[str], Term] | None:
        """The earliest term, and of those at one place the longest."""
        found = [(m, t) for t in self._left if (m := re.search(t.pattern, text))]
        return min(found, key=lambda pair: (pair[0].start(), -pair[0].end()), default=None)
