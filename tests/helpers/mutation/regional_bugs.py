"""Bugs of several DVAs, which storms of regions look for."""

from __future__ import annotations

from typing import Any, Final

from helpers.mutation.planting import RIGHT, Bug, Original, Planted, afterwards, instead, skipped

from dva_sim.core.regions.division import Claim
from dva_sim.core.sessions import DvaAnswer
from dva_sim.protocol import messages as m


def _lets_strays_go(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, now: float) -> Any:
        sends = original(self, now)
        if not sends:
            return sends
        bug.act(f"{len(sends)} events are let go of")
        return [send for stray in sends for send in self.taken(stray, now)]

    return wrong


def _keeps_the_epoch(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, region: str, claim: Claim) -> bool:
        if claim.dva != self.own or claim.epoch < 2:
            return original(self, region, claim)
        bug.act(f"{self.own} takes {region} over in its old epoch")
        self.claims[region] = Claim(claim.epoch - 1, self.own)
        return True

    return wrong


def _obeys_whoever_orders(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, message: m.Message, now: float) -> Any:
        if isinstance(message.body, m.Order) and message.source != self.dva:
            bug.act(f"obeys {message.source}")
            self.dva = message.source
        return original(self, message, now)

    return wrong


def _says_taken(original: Original, bug: Planted) -> Original:
    def wrong(self: Any, request: Any, message: m.Message, peer: str) -> None:
        bug.act(f"a report for {peer} is answered, and goes nowhere")
        self.device.conclude(request, message, lambda asked: m.Reply(asked.message_id, m.OK, ""))

    return wrong


_DEPUTY: Final = "dva_sim.core.regions.takeover:Deputy"
_DIVISION: Final = "dva_sim.core.regions.division:Division"
_HELP: Final = "dva_sim.core.regions.help:MutualHelp"
_STRAYS: Final = "dva_sim.core.regions.strays:Strays"
_AGENT: Final = "dva_sim.simulation.full.regional_agent:RegionalDvaAgent"

REGIONAL_BUGS: Final = (
    Bug(
        "copy-confirmed-unkept",
        "S13",
        "a deputy confirms copies and keeps none",
        f"{_DEPUTY}.keep",
        instead(lambda *_: DvaAnswer()),
    ),
    Bug(
        "copies-not-resumed",
        "S13",
        "a deputy takes a region over, and leaves its events alone",
        f"{_DEPUTY}.resume",
        skipped(lambda self, now: any(self.copies.get(region) for region in self.taken_over)),
    ),
    Bug(
        "strays-untold",
        "S13",
        "a DVA lets events of another go without telling it",
        f"{_STRAYS}.pass_on",
        _lets_strays_go,
    ),
    Bug(
        "strays-kept",
        "S14",
        "a DVA keeps events of another, which looks at them, too",
        f"{_STRAYS}.pass_on",
        afterwards(lambda self, sends, *_: [] if sends else None),
    ),
    Bug(
        "deaf-to-epochs",
        "S14",
        "a DVA believes no claim but its own",
        f"{_DIVISION}.learn",
        instead(lambda self, region, claim: RIGHT if claim.dva == self.own else False),
    ),
    Bug(
        "region-not-yielded",
        "S14",
        "a DVA that serves a region believes no higher claim to it",
        f"{_DIVISION}.learn",
        instead(
            lambda self, region, claim: (
                False
                if self.claims[region].dva == self.own != claim.dva
                and claim.epoch > self.claims[region].epoch
                else RIGHT
            )
        ),
    ),
    Bug(
        "epoch-not-raised",
        "S14",
        "a deputy takes a region over in its old epoch",
        f"{_DIVISION}.learn",
        _keeps_the_epoch,
    ),
    Bug(
        "forgetful-deputy-not-replaced",
        "S8",
        "a DVA that has forgotten what it had taken over is left alone",
        f"{_DEPUTY}.replace_restarted",
        skipped(
            lambda self, peer, now: any(
                claim.dva == peer != self.division.lines[region][0]
                for region, claim in self.division.claims.items()
            )
        ),
    ),
    Bug(
        "help-never-ends",
        "S15",
        "who was lent goes on looking when that is over",
        f"{_HELP}.end",
        instead(lambda *_: []),
    ),
    Bug(
        "help-only-promised",
        "S15",
        "a DVA promises help, and books nothing",
        f"{_HELP}.give",
        instead(
            lambda self, asker, order, now: (
                DvaAnswer() if self.copy_of(asker, order.event_id) is None else RIGHT
            )
        ),
    ),
    Bug(
        "two-masters",
        "S12",
        "a guard obeys whichever DVA sends him an order",
        "dva_sim.agents.people.guard_protocol:GuardProtocol.handle",
        _obeys_whoever_orders,
    ),
    Bug(
        "passed-on-into-nothing",
        "S6",
        "a report for another region is answered, and goes nowhere",
        f"{_AGENT}._pass_on",
        _says_taken,
    ),
    Bug(
        "given-back-to-nobody",
        "S8",
        "a DVA agrees to serve its region again, and does not",
        "dva_sim.core.regions.returns:Returns.take",
        instead(lambda *_: DvaAnswer()),
    ),
)
