"""Notices that the DVA has fallen silent, and that it is back.

The DVA publishes heartbeats as devices do. Anybody can forge one, so that a heartbeat may only mask
a silence: a request that was not answered counts until the DVA answers one.
"""

from __future__ import annotations

from dataclasses import dataclass

SILENT_AFTER = 10.0  # design: silence after which the DVA counts as absent, as for devices [s]


@dataclass(slots=True)
class DvaWatch:
    """Record of the words of the DVA at a device.

    A DVA whose heartbeats never came (of an older make, or over a link that has not connected yet)
    is judged by requests alone.

    Attributes:
        heard: Time of the DVA's latest message [s]; None: never.
        beats: True once a heartbeat of the DVA has arrived.
        number: Number of the latest heartbeat.
        unanswered: True while the newest request has failed.
        silent: True if it was silent at the last look.
    """

    heard: float | None = None
    beats: bool = False
    number: int = 0
    unanswered: bool = False
    silent: bool = False

    def beat(self, now: float, number: int) -> bool:
        """Note a heartbeat; return True if its number is below the last: the DVA has restarted."""
        is_restarted = number < self.number
        self.heard = now
        self.beats = True
        self.number = number
        return is_restarted

    def answered(self, now: float) -> None:
        """Note an answer to a request."""
        self.heard = now
        self.unanswered = False

    def failed(self) -> None:
        """Note that a request was not answered after all attempts."""
        self.unanswered = True

    def look(self, now: float) -> bool:
        """Update `silent`; return True if it has changed."""
        before = self.silent
        late = self.beats and self.silence(now) > SILENT_AFTER
        self.silent = late or self.unanswered
        return self.silent != before

    def silence(self, now: float) -> float:
        """Return the time since the latest message [s], or since the start without any."""
        return now - (self.heard or 0.0)
