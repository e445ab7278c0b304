"""Clock and transport of an attached console."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dva_sim.agents.device import do_nothing
from dva_sim.console.attached.options import listening_address, own_id, seat_ids
from dva_sim.kernel.recorder import Recorder
from dva_sim.network.keys import KeyRing
from dva_sim.network.messaging import Transport
from dva_sim.network.realtime import PacedClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import ConsoleOptions
from dva_sim.simulation.full.stage import DVA


@dataclass(frozen=True, kw_only=True)
class AttachedLinks:
    """A place among the devices of a DVA.

    Attributes:
        clock: Real time.
        recorder: Keeps the story.
        network: Carries messages to the DVA, and to whom it lists.
        own: Id of the console's own device.
        address: Address of the console's own device.
        seat_id: Function that returns the id of the device of the n-th seat, from 1.
        join: Function that lets a device take part, by its id, and returns its address.
        close: Ends what was opened.
    """

    clock: PacedClock
    recorder: Recorder
    network: Transport
    own: str
    address: str
    seat_id: Callable[[int], str]
    join: Callable[[str], str]
    close: Callable[[], object] = do_nothing

    def note(self, text: str) -> None:
        """Something has gone wrong that people should know of."""
        self.recorder.tell(self.clock.now, "console", text, "link")


def over_sockets(options: ConsoleOptions, own: str | None = None) -> AttachedLinks:
    """Open a place by ZeroMQ, with keys if there are any.

    Args:
        options: Address of the DVA, and keys.
        own: Id of the console's own device; default: that of a key, or a random one.

    Raises:
        ConfigError: keys cannot be read.
        NetworkError: no port can be had.
    """
    ring = None if options.keys is None else KeyRing(options.keys)
    dva = str(options.dva)
    own = own or own_id(ring)
    clock = PacedClock()
    recorder = Recorder()

    def note(text: str) -> None:
        recorder.tell(clock.now, "console", text, "link")

    network = SocketNetwork(clock, ring, note)
    network.introduce(DVA, dva)
    host = listening_address(dva)
    address = network.join(own, host)
    return AttachedLinks(
        clock=clock,
        recorder=recorder,
        network=network,
        own=own,
        address=address,
        seat_id=seat_ids(ring),
        join=lambda device: network.join(device, host),
        close=network.close,
    )
