"""Clock and transport of a console at a remote DVA, and the devices with which it takes part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from dva_sim.agents.device import AgentDevice, do_nothing
from dva_sim.console.remote.options import own_ids, seat_ids
from dva_sim.console.run.real_links import start_of_day
from dva_sim.kernel.recorder import Recorder
from dva_sim.live.options import addresses_of
from dva_sim.network.addresses import address_towards
from dva_sim.network.keys import KeyRing
from dva_sim.network.messaging import Transport
from dva_sim.network.realtime import PacedClock
from dva_sim.network.sockets import SocketNetwork
from dva_sim.options.runs import ConsoleOptions
from dva_sim.simulation.full.stage import DVA, id_of
from dva_sim.worlds.geo import GeoFrame

TIMEOUT, ATTEMPTS = 1.0, 2  # of what is asked [s]


@dataclass(frozen=True, kw_only=True)
class RemoteLinks:
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
        dvas: Ids of the DVAs, that of the first region first.
        others: Ids of the console's devices at the other DVAs, in their order.
        labels: Labels of all devices ever known, by id.
    """

    clock: PacedClock
    recorder: Recorder
    network: Transport
    own: str
    address: str
    seat_id: Callable[[int], str]
    join: Callable[[str], str]
    close: Callable[[], object] = do_nothing
    labels: dict[str, str] = field(default_factory=dict)
    dvas: tuple[str, ...] = (DVA,)
    others: tuple[str, ...] = ()

    def device(
        self,
        id_tag: str,
        label: str,
        kind: str,
        *,
        address: str,
        frame: GeoFrame,
        dvas: tuple[str, ...] = (),
    ) -> AgentDevice:
        """Make a device that takes part.

        Args:
            id_tag: Its id.
            label: Its name for people.
            kind: Type in its registration.
            address: Address in its registration.
            frame: Origin of the map.
            dvas: DVAs that it knows, its own first; default: all.
        """
        return AgentDevice(
            id_tag=id_tag,
            label=label,
            device_type=kind,
            address=address,
            dva=(dvas or self.dvas)[0],
            dvas=dvas or self.dvas,
            network=self.network,
            recorder=self.recorder,
            frame=frame,
            labels=self.labels,
            timeout=TIMEOUT,
            attempts=ATTEMPTS,
            time_of_day=start_of_day(self.clock),
        )


def over_sockets(options: ConsoleOptions, own: str | None = None) -> RemoteLinks:
    """Open a place by ZeroMQ, with keys if there are any.

    Args:
        options: Addresses of the DVAs, and keys.
        own: Id of the console's own device; default: that of a key, or a random one.

    Raises:
        ConfigError: keys cannot be read.
        NetworkError: no port can be had.
    """
    ring = None if options.keys is None else KeyRing(options.keys)
    dvas = {id_of("dva", number): at for number, at in enumerate(addresses_of(options), 1)}
    first, *others = own_ids(ring, len(dvas)) if own is None else [own]
    clock = PacedClock()
    recorder = Recorder()

    def note(text: str) -> None:
        recorder.tell(clock.now, "console", text, "link")

    network = SocketNetwork(clock, ring, note)
    for dva, at in dvas.items():
        network.introduce(dva, at)
    host = address_towards(dvas[DVA])
    address = network.join(first, host)
    return RemoteLinks(
        clock=clock,
        recorder=recorder,
        network=network,
        own=first,
        address=address,
        seat_id=seat_ids(ring),
        join=lambda device: network.join(device, host),
        close=network.close,
        dvas=tuple(dvas),
        others=tuple(others),
    )
