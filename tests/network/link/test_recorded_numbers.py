"""Links without laws of delay and bursts: their numbers stay the same, bit by bit.

The digests were recorded with the link of version 0.5.0 where nothing is left to chance; with
loss or jitter they are of version 0.6.0, which gave packets of one millisecond random numbers of
their own.
"""

import hashlib
from collections.abc import Iterator
from typing import NamedTuple

import pytest

from dva_sim.kernel.streams import Streams
from dva_sim.network.link import ConstantRate, Link, LinkConfig
from dva_sim.network.link.link import make_link

CROWDED = {"loss": 0.1, "delay_s": 0.1, "jitter_s": 0.1, "rate_bps": 3e5, "queue_bytes": 9000}
RECORDED = {
    "plain up": "9fb83e5281113764",
    "plain down": "9fb83e5281113764",
    "delay up": "65540d5fbaa48c74",
    "delay down": "65540d5fbaa48c74",
    "jitter up": "181ccfa74cb49ce7",
    "jitter down": "66af29c36c9faa20",
    "loss up": "6cd1674fe92c2a39",
    "loss down": "d91a41406c7e70a5",
    "rate up": "6814121540fdbf29",
    "rate down": "6814121540fdbf29",
    "crowded up": "dd63ae2c66c8e1cd",
    "crowded down": "54bce153c366aa11",
    "jitter radio": "7147856f9cf7e4d1",
    "crowded radio": "d0c695d6b79f63c0",
    "trace up": "41a1322baad7544b",
    "by hand": "9c02377e390c671b",
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
    """Hash of all answers of the link."""
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
def test_a_link_answers_as_it_did(case, direction):
    settings = LinkConfig(**CASES[case])  # type: ignore[arg-type]
    link = make_link(settings, direction, Streams(7), "robot-1/link")  # type: ignore[arg-type]
    assert digest(link) == RECORDED[f"{case} {direction}"]


@pytest.mark.parametrize("case", ["jitter", "crowded"])
def test_a_radio_link_answers_as_it_did(case):
    settings = LinkConfig(**CASES[case])  # type: ignore[arg-type]
    link = make_link(settings, "up", Streams(7), "robot-1/link", Poor)
    assert digest(link) == RECORDED[f"{case} radio"]


def test_a_recorded_link_answers_as_it_did(tmp_path):
    trace = tmp_path / "seven.up"
    trace.write_text("".join(f"{ms}\n" for ms in range(3, 2001, 7)))
    settings = LinkConfig(trace_up=str(trace), loss=0.02, queue_bytes=6000)
    assert digest(make_link(settings, "up", Streams(7), "robot-1/link")) == RECORDED["trace up"]


def test_a_link_made_by_hand_answers_as_it_did():
    settings = LinkConfig(delay_s=0.2, jitter_s=0.1, loss=0.2)
    link = Link(settings, ConstantRate(1e6), Streams(3), "line")
    assert digest(link) == RECORDED["by hand"]
