"""Notices that the DVA has fallen silent, and that it is back.

The DVA publishes heartbeats as devices do. Anybody can forge one, so that a heartbeat may only mask
a silence: a request that was not answered counts until the DVA answers one.
"""

from __future__ import annotations

from dataclasses import dataclass

SILENT_AFTER = 10.0  # without a word, as the DVA waits for a device [s]


@dataclass(slots=True)
class DvaWatch:
    """What a device knows of whether the DVA is there.

    A DVA whose heartbeats never came (of an older make, or over a link that has not connected yet)
    is judged by requests alone.

    Attributes:
        heard: When its newest word came [s]; None: never.
        beats: Whether a heartbeat of it has ever come.
        unanswered: Whether the newest request has failed.
        silent: Whether it is taken to be silent, as of the last look.
    """

    heard: float | None = None
    beats: bool = False
    unanswered: bool = False
    silent: bool = False

    def beat(self, now: float) -> None:
        """A heartbeat has come."""
        self.heard, self.beats = now, True

    def answered(self, now: float) -> None:
        """It has answered a request."""
        self.heard, self.unanswered = now, False

    def failed(self) -> None:
        """A request was not answered, however often it was sent."""
        self.unanswered = True

    def look(self, now: float) -> bool:
        """Judge anew; whether that has changed."""
        before, late = self.silent, self.beats and self.silence(now) > SILENT_AFTER
        self.silent = late or self.unanswered
        return self.silent != before

    def silence(self, now: float) -> float:
        """For how long nothing has come [s]; from the start on if nothing ever has."""
        return now - (self.heard or 0.0)
