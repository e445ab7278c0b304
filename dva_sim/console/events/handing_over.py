"""Work that people hand over to each other: offers, and who answers for an event since. Pure."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Final

from dva_sim.console.asking.refusal import Refused
from dva_sim.console.events.decisions import moment_ms
from dva_sim.console.wire.events import OfferShown, OwnerShown

MAX_OFFERS: Final = 50  # at once; of more the oldest are withdrawn
MAX_OWNERS: Final = 1000  # events that were handed over; of more the oldest are forgotten


@dataclass(frozen=True, kw_only=True)
class Offer:
    """Work that one person offers to another.

    Attributes:
        sender: Name of the person who offers it.
        sender_client: Page of that person.
        to: Name of the colleague.
        client: Page of the colleague.
        events: Numbers of the events.
        robots: Labels of the robots.
        note: Words for the colleague.
        whole: True if it is all that the person had in hand.
        at: Time of the offer [s].
        accepted: Answer of the colleague; None until there is one.
    """

    sender: str
    sender_client: str
    to: str
    client: str
    events: tuple[int, ...]
    robots: tuple[str, ...]
    note: str
    whole: bool
    at: float
    accepted: bool | None = None

    @property
    def awaited_by(self) -> str:
        """Page for which it is: of the colleague, and once answered of the sender."""
        return self.client if self.accepted is None else self.sender_client

    def described(self) -> str:
        """Describe the work in words."""
        parts = [f"event {number}" for number in self.events] + list(self.robots)
        return ", ".join(parts) or "no event and no robot"


class HandingOver:
    """Offers, and the persons who answer for events that were handed over.

    Attributes:
        owners: Name of the person by event.
    """

    def __init__(self) -> None:
        self.owners: dict[int, str] = {}
        self._offers: dict[int, Offer] = {}
        self._count = 0

    def offer(self, offer: Offer) -> None:
        """Offer work; it replaces an older offer between the same two, and answered ones."""
        pair = offer.sender_client, offer.client
        for number, old in list(self._offers.items()):
            is_alike = old.whole or old.events == offer.events or old.accepted is not None
            if (old.sender_client, old.client) == pair and is_alike:
                del self._offers[number]
        self._count += 1
        self._offers[self._count] = offer
        if len(self._offers) > MAX_OFFERS:
            del self._offers[next(iter(self._offers))]

    def answer(self, number: int, client: str, accepted: bool) -> Offer:
        """Note the answer of a page to an offer, which its sender sees until the next one.

        Raises:
            Refused: there is none for this page.
        """
        offer = self._offers.get(number)
        if offer is None or offer.client != client or offer.accepted is not None:
            raise Refused("that offer is over")
        self._offers[number] = replace(offer, accepted=accepted)
        return offer

    def give(self, event: int, to: str) -> None:
        """Let somebody answer for an event from now on."""
        self.owners[event] = to
        if len(self.owners) > MAX_OWNERS:
            del self.owners[next(iter(self.owners))]

    def shown(self, present: Collection[str]) -> list[OfferShown]:
        """Return the offers but those to, or once answered those of, pages that are gone."""
        self._offers = {n: o for n, o in self._offers.items() if o.awaited_by in present}
        return [_shown(number, offer) for number, offer in self._offers.items()]

    def owners_shown(self) -> list[OwnerShown]:
        """Return who answers for which event."""
        return [{"event": event, "label": label} for event, label in self.owners.items()]


def _shown(number: int, offer: Offer) -> OfferShown:
    return {
        "number": number,
        "sender": offer.sender,
        "to": offer.to,
        "client": offer.client,
        "events": list(offer.events),
        "robots": list(offer.robots),
        "note": offer.note,
        "whole": offer.whole,
        "at_ms": moment_ms(offer.at),
        "accepted": offer.accepted,
    }


def client_named(name: str, people: Mapping[str, str]) -> str:
    """Return the page of a person.

    Raises:
        Refused: nobody of that name is there.
    """
    for client, label in people.items():
        if label == name:
            return client
    names = ", ".join(sorted(set(people.values()))) or "nobody"
    raise Refused(f"{name!r} is not there; there: {names}")
