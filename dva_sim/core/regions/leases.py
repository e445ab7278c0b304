"""Leases: permissions of a dead DVA, which stay valid at the DVA that takes over its robots."""

from __future__ import annotations

from dataclasses import dataclass, field

from dva_sim.core.registry import Registry
from dva_sim.core.sessions import Grant, Sessions
from dva_sim.protocol import messages as m
from dva_sim.protocol.exchange import LOW_BITS, is_absurd


@dataclass
class Leases:
    """Permissions that robots bring with them, valid if their holders register here, too.

    A robot can bring only permissions on itself, so it takes nothing from others.

    Attributes:
        registry: Devices that are registered here.
        sessions: Permissions of devices.
    """

    registry: Registry
    sessions: Sessions
    _brought: dict[int, float] = field(default_factory=dict)  # time of arrival by session [s]

    def bring(self, robot: str, body: m.GetGrant, session: int, now: float) -> None:
        """Accept a permission that another DVA has given; later sessions are above it."""
        permissions = self.sessions.permissions
        if body.holder is None or body.level in (None, "sensors") or robot in permissions.grants:
            return
        is_over = self.sessions.has_unacknowledged(robot)
        if is_over or not session or is_absurd(session, permissions.count << LOW_BITS):
            return
        permissions.count = max(permissions.count, session >> LOW_BITS)
        permissions.restore(Grant(robot, body.holder, body.level, session))
        self._brought[session] = now

    def lapse(self, now: float) -> None:
        """End the permissions whose holders have not come within the time of a silence."""
        grants = {grant.session: grant for grant in self.sessions.permissions.grants.values()}
        for session, since in list(self._brought.items()):
            grant = grants.get(session)
            holder = None if grant is None else self.registry.entries.get(grant.holder)
            if grant is None or (holder is not None and not holder.silent):
                del self._brought[session]
            elif now - since > self.registry.silent_after:
                del self._brought[session]
                self.sessions.revoke(grant)
