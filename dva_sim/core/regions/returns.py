"""Returns: a supervisor gives a region back to its own DVA, which is there again."""

from __future__ import annotations

from dataclasses import dataclass

from dva_sim.core.events import State
from dva_sim.core.orders import Orders
from dva_sim.core.regions.borders import Borders
from dva_sim.core.regions.division import Claim, Division
from dva_sim.core.regions.takeover import Deputy
from dva_sim.core.sessions import DvaAnswer, Send
from dva_sim.protocol import messages as m


@dataclass
class Returns:
    """Gives regions back, and takes the own one back.

    Attributes:
        division: Division of the site, with the service of each region.
        orders: Current orders.
        borders: Hands the devices over that came as their DVA had died.
        deputy: Knows who came, and has copies that count no longer.
    """

    division: Division
    orders: Orders
    borders: Borders
    deputy: Deputy

    def ask(self, region: str) -> DvaAnswer:
        """Answer a supervisor; the own DVA of the region is asked if nobody acts there."""
        claim = self.division.claims.get(region)
        if claim is None:
            return DvaAnswer(m.NOT_SUPPORTED, f"no region {region!r} is known here")
        home = self.division.lines[region][0]
        if claim.dva != self.division.own or home == claim.dva:
            text = f"{region} is served by {self.orders.label_of(claim.dva)}"
            return DvaAnswer(m.OK if home == claim.dva else m.NOT_PERMITTED, text)
        if not self.division.is_there(home, self.orders.registry):
            return DvaAnswer(m.BUSY, f"{self.orders.label_of(home)} is not there")
        if (what := self._goes_on(region)) is not None:
            return DvaAnswer(m.BUSY, what)
        return DvaAnswer(sends=[Send(home, m.GiveBack(region, claim.epoch + 1))])

    def _goes_on(self, region: str) -> str | None:
        """Return what would be torn apart, or None."""
        for event in self.orders.events.open.values():
            is_there = self.division.region_at(event.position) == region
            if is_there and event.state is not State.PENDING:
                return f"event {event.number} is {event.state}"
        permissions = self.orders.sessions.permissions
        for grant in permissions.grants.values():
            place = self.orders.registry.entries[grant.robot].position
            is_there = place is not None and self.division.region_at(place) == region
            if is_there and grant.holder != permissions.own:
                return f"{self.orders.label_of(grant.robot)} is driven"
        return None

    def take(self, body: m.GiveBack) -> DvaAnswer:
        """Serve the own region again, as the DVA that has served it wants."""
        dva = self.division.own
        claim = self.division.claims.get(body.region)
        if claim is None or body.epoch is None or self.division.lines[body.region][0] != dva:
            return DvaAnswer(m.NOT_SUPPORTED, f"{body.region!r} is not the region of this DVA")
        if body.epoch <= claim.epoch and claim != Claim(body.epoch, dva):
            return DvaAnswer(m.STALE, f"the epoch of {body.region} is {claim.epoch}")
        self.division.claims[body.region] = Claim(body.epoch, dva)
        if claim.dva != dva:
            self.deputy.copies.pop(body.region, None)  # what is open is passed on
            self.orders.counters["region taken back"] += 1
        return DvaAnswer()

    def yielded(self, regions: list[str]) -> None:
        """Let those go who have come for regions that are another's again."""
        for region in regions:
            guests = self.deputy.yielded(region)
            if self.division.claims[region].dva == self.division.lines[region][0]:
                self.borders.returning |= dict.fromkeys(guests, region)
