"""Robots that go their rounds while nothing happens, sent by the DVA itself."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from dva_sim.core.engaged import Engaged
from dva_sim.core.registry import ROBOT, Entry, Registry
from dva_sim.core.send import Send
from dva_sim.core.sessions import Sessions
from dva_sim.protocol import messages as m

REST = 10.0  # a robot has stood idle for so long before it sets out [s]


@dataclass
class Patrols:
    """Sends idle robots round their beats.

    The DVA holds such a robot itself. Its hold yields: whoever asks for the robot gets it, and
    the higher session ends the patrol. A robot that comes to stand on its round, for whatever
    reason, is sent home, where it is charged; and when it has rested, on its round again.

    Attributes:
        beats: The places of each robot's round, by its label.
    """

    beats: Mapping[str, tuple[m.Position, ...]] = field(default_factory=dict)
    _idle_since: dict[str, float] = field(default_factory=dict)
    _on_round: set[str] = field(default_factory=set)

    def set_out(
        self, registry: Registry, sessions: Sessions, engaged: Engaged, now: float
    ) -> list[Send]:
        """What to tell the robots that have rested long enough."""
        sends: list[Send] = []
        for entry in self._with_a_beat(registry):
            robot = entry.device.id_tag
            if entry.mode != "Idle" or robot in engaged or sessions.is_held(robot):
                self._idle_since.pop(robot, None)
            elif now - self._idle_since.setdefault(robot, now) >= REST:
                self._idle_since[robot] = now
                session, told = sessions.hold(robot)
                if told is not None:
                    sends.append(told)
                elif robot in self._on_round:
                    self._on_round.remove(robot)
                    sends.append(Send(robot, m.ReturnToBase(), session))
                else:
                    sends.append(self._round(entry, session))
        return sends

    def held(self, send: Send, registry: Registry, sessions: Sessions) -> list[Send]:
        """A robot has heard who holds it: if that is the DVA, it can be sent now."""
        entry, body = registry.entries.get(send.to), send.body
        own = sessions.permissions.own
        if entry is None or not isinstance(body, m.PermissionGrant) or body.holder != own:
            return []
        return [self._round(entry, body.session)]

    def _with_a_beat(self, registry: Registry) -> Iterator[Entry]:
        if self.beats:
            yield from (e for e in registry.of_type(ROBOT) if e.device.label in self.beats)

    def _round(self, entry: Entry, session: int) -> Send:
        """Round after round, until somebody else takes the robot."""
        self._on_round.add(entry.device.id_tag)
        return Send(entry.device.id_tag, m.Patrol(self.beats[entry.device.label], 0), session)
