"""Links as they were before laws of delay and bursts came: their numbers stay the same, bit by bit.

The digests were recorded with the link of version 0.5.0.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.radio import make_link
from dva_sim.streams import Streams

CROWDED = {"loss": 0.1, "delay_s": 0.1, "jitter_s": 0.1, "rate_bps": 3e5, "queue_bytes": 9000}
RECORDED = {
    "plain up": "9fb83e5281113764",
    "plain down": "9fb83e5281113764",
    "delay up": "65540d5fbaa48c74",
    "delay down": "65540d5fbaa48c74",
    "jitter up": "1669af41db029686",
    "jitter down": "f78e9b042a78fbe2",
    "loss up": "006cafd34dc844fa",
    "loss down": "4395d7cee76ae2ba",
    "rate up": "6814121540fdbf29",
    "rate down": "6814121540fdbf29",
    "crowded up": "8242734dec2b6d5a",
    "crowded down": "847239ad18369016",
    "jitter radio": "07b3380412932fa2",
    "crowded radio": "99933c26a2146e7e",
    "trace up": "852f58b05b4c691f",
    "by hand": "ed590e1db5734e91",
}


class Poor(NamedTuple):
    """Reception that costs a little of everything."""

    loss: float = 0.1
    rate_bps: float = 2e5
    extra_delay_s: float = 0.01


def packets() -> Iterator[tuple[float, int]]:
    """Single ones and trains of fifteen, with pauses."""
    now = 0.0
    for number in range(4000):
        for part in range(15 if number % 9 == 0 else 1):
            yield now, 60 + (number * 7919 + part * 677) % 1440
        now += 1.7 if number % 50 == 0 else 0.0003 + (number * 613 % 41) / 1000


def digest(link: Link) -> str:
    """Of all that the link answers."""
    answers: list[float | None] = []
    for number, (now, size) in enumerate(packets()):
        train = link.carry_train(now, 2, size) if number % 3 == 0 else None
        answers += [train, None if train else link.carry(now, size), link.backlog_bytes(now)]
    answers += [link.offered, link.lost, link.dropped, link.bytes]
    text = repr([None if a is None else float(a) for a in answers])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


CASES: dict[str, dict[str, float]] = {
    "plain": {},
    "delay": {"delay_s": 0.1},
    "jitter": {"delay_s": 0.1, "jitter_s": 0.05},
    "loss": {"delay_s": 0.02, "loss": 0.07},
    "rate": {"rate_bps": 2e5, "queue_bytes": 5000},
    "crowded": CROWDED,
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_link_answers_as_it_did(case: str, direction: str) -> None:
    settings = LinkConfig(**CASES[case])  # type: ignore[arg-type]
    link = make_link(settings, direction, Streams(7), "robot-1/link")  # type: ignore[arg-type]
    assert digest(link) == RECORDED[f"{case} {direction}"]


@pytest.mark.parametrize("case", ["jitter", "crowded"])
def test_a_radio_link_answers_as_it_did(case: str) -> None:
    settings = LinkConfig(**CASES[case])  # type: ignore[arg-type]
    link = make_link(settings, "up", Streams(7), "robot-1/link", Poor)
    assert digest(link) == RECORDED[f"{case} radio"]


def test_a_recorded_link_answers_as_it_did(tmp_path: Path) -> None:
    trace = tmp_path / "seven.up"
    trace.write_text("".join(f"{ms}\n" for ms in range(3, 2001, 7)))
    settings = LinkConfig(trace_up=str(trace), loss=0.02, queue_bytes=6000)
    assert digest(make_link(settings, "up", Streams(7), "robot-1/link")) == RECORDED["trace up"]


def test_a_link_made_by_hand_answers_as_it_did() -> None:
    settings = LinkConfig(delay_s=0.2, jitter_s=0.1, loss=0.2)
    link = Link(settings, ConstantRate(1e6), Streams(3), "line")
    assert digest(link) == RECORDED["by hand"]
