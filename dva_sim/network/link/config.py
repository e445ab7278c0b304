"""Configuration of a link."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from dva_sim.kernel.config import AlsoCalled, Config, Key
from dva_sim.network.link.delay_logs import read_delay_log
from dva_sim.network.link.delays import ConstantDelay, DelayLaw
from dva_sim.network.link.losses import Bursts
from dva_sim.network.link.outages import Outage, Partition
from dva_sim.network.link.replay import compute_moments

Direction = Literal["up", "down"]
Seconds = Annotated[float, Field(ge=0, le=30)]
Loss = Annotated[float, Field(ge=0, le=0.9)]
Rate = Annotated[float, Field(ge=1e3)]
Room = Annotated[int, Field(ge=3_000)]
Packets = Annotated[int, Field(ge=1)]
Share = Annotated[float, Field(gt=0, le=1)]


class Way(Config):
    """Keys that differ in one direction; each as in the link, and as there if left out."""

    delay_s: Seconds | None = None
    jitter_s: Seconds | None = None
    delay_law: DelayLaw | None = None
    delay_log: str | None = None
    delay_log_share: Share | None = None
    reorder: bool | None = None
    loss: Loss | None = None
    bursts: Bursts | None = None
    rate_bps: Rate | None = None
    queue_bytes: Room | None = None
    queue_packets: Packets | None = None


class LinkConfig(Config):
    """Link between a robot and everybody else; `up` and `down` hold what differs by direction.

    Attributes:
        delay_s: One-way propagation delay; the mean, where a law spreads it.
        jitter_s: Half-width of a uniform law around the delay.
        delay_law: Another law: `constant`, `normal`, `gamma`, `shifted_exponential` or
            `empirical`, each with its own keys; with `correlation_s` it is correlated in time.
        delay_log: File of delays over time, in two columns or as printed by `ping -D`; they
            come on top of `delay_s`. Its lost probes are losses.
        delay_log_share: Share of each logged round trip that one direction takes; 0.5 is half.
        reorder: True if packets may overtake each other; otherwise a later one waits.
        loss: Probability that a packet is lost, each way.
        bursts: Model of bursts of losses; by default each loss is independent.
        rate_bps: Serialisation rate; without effect where a trace gives it.
        queue_bytes: Room in the drop-tail queue before the link.
        queue_packets: Room in packets, the one being sent among them, in place of bytes.
        trace_up: Recorded packet opportunities towards the robot (Mahimahi form).
        trace_down: Recorded packet opportunities from the robot (Mahimahi form).
        outages: Times at which what would cross the link is lost.
        partitions: Times at which some nodes do not hear others.
        up: Settings that differ towards the robot.
        down: Settings that differ from the robot.
    """

    delay_s: Annotated[
        Seconds, AlsoCalled("delay", "latency", "latency_s"), Key("one-way delay")
    ] = 0.0
    jitter_s: Annotated[Seconds, Key("jitter", stated="jitter (half-width)")] = 0.0
    delay_law: Annotated[DelayLaw | None, Key("law of the delay")] = None
    delay_log: Annotated[str | None, AlsoCalled("recorded", "ping_log"), Key("recorded delays")] = (
        None
    )
    delay_log_share: Share = 0.5
    reorder: Annotated[bool, Key("packets may overtake")] = False
    loss: Annotated[
        Loss,
        AlsoCalled("packet_loss", "loss_rate", "loss_share"),
        Key("packet loss", stated="packet loss, each way"),
    ] = 0.0
    bursts: Annotated[Bursts | None, Key("bursts of losses")] = None
    rate_bps: Annotated[
        Rate, AlsoCalled("bandwidth", "bandwidth_bps", "bitrate"), Key("link rate")
    ] = 20e6
    queue_bytes: Annotated[Room, Key("queue before the link")] = 150_000
    queue_packets: Annotated[Packets | None, Key("queue before the link, in packets")] = None
    trace_up: Annotated[str | None, Key("recorded link, towards the robot")] = None
    trace_down: Annotated[str | None, Key("recorded link, from the robot")] = None
    outages: Annotated[tuple[Outage, ...], Key("outages")] = ()
    partitions: Annotated[tuple[Partition, ...], Key("partitions")] = ()
    up: Annotated[
        Way | None,
        Key(
            "otherwise towards the robot",
            inner={"delay_s": Key("delay of commands")},
        ),
    ] = None
    down: Annotated[
        Way | None,
        Key(
            "otherwise from the robot",
            inner={"delay_s": Key("delay of frames")},
        ),
    ] = None

    @model_validator(mode="after")
    def _causal(self) -> LinkConfig:
        for link in (self.toward("up"), self.toward("down")) if self.up or self.down else (self,):
            if link.jitter_s > link.delay_s:
                raise ValueError(f"jitter_s {link.jitter_s:g} is above delay_s {link.delay_s:g}")
            spread = {
                "jitter_s": link.jitter_s > 0,
                "delay_law": link.law is not None,
                "delay_log": link.delay_log is not None,
            }
            keys = [key for key, is_given in spread.items() if is_given]
            if len(keys) > 1:
                raise ValueError(f"{keys[0]} and {keys[1]} exclude each other")
            if link.law is not None:
                link.law.check(link.delay_s)
            if link.bursts is not None:
                link.bursts.check(link.loss)
        return self

    @property
    def law(self) -> DelayLaw | None:
        """The law that spreads the delay, if one does."""
        return None if isinstance(self.delay_law, ConstantDelay) else self.delay_law

    def toward(self, direction: Direction) -> LinkConfig:
        """Return the link with the keys of one direction applied."""
        way = self.up if direction == "up" else self.down
        changes: dict[str, Any] = {"up": None, "down": None}
        for key in Way.model_fields if way else ():
            value = getattr(way, key)
            if value is not None:
                changes[key] = value
        changes["outages"] = tuple(o for o in self.outages if o.direction in (direction, "both"))
        return self.model_copy(update=changes)

    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation of the one-way delay [s], of a link of one direction.

        Raises:
            ConfigError: a file cannot be read.
        """
        if self.delay_log is not None:
            mean, sd = compute_moments(read_delay_log(self.delay_log))
            return self.delay_s + self.delay_log_share * mean, self.delay_log_share * sd
        if self.law is not None:
            return self.law.moments(self.delay_s)
        return self.delay_s, self.jitter_s / 3.0**0.5
