"""State of a system as its messages tell it: devices, and what each published last."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

from dva_sim.agents.device import EMERGENCY, HEARTBEAT, HOLDER, STATUS, AgentDevice
from dva_sim.console.bench import BenchView, Status
from dva_sim.kernel.labels import distinct
from dva_sim.kernel.rates import Rate
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import FORGET_AFTER, GUARD, ROBOT

MAX_LOST: Final = 100  # devices with a position that are kept though no DVA lists them any more
TOPICS: Final = {ROBOT: (HEARTBEAT, STATUS, HOLDER, EMERGENCY), GUARD: (HEARTBEAT, STATUS)}


@dataclass
class DeviceState:
    """A device, as far as messages tell.

    Attributes:
        device: Device as in the list.
        listed: Time of the latest list that contains it [s].
        dva: Id of the DVA whose list that is.
        heard: Time of its latest publication; None: never [s].
        published: Latest status that it published.
        look: Function that returns its status of now if the device can be seen; see `BenchView`.
        holder: Holder that it reported, and time of the report [s].
        emergency: Emergency that it reported, and time of the report [s].
        beats: Heartbeats heard.
        camera: URL of its pictures.
        sensors: Sensors that it offers.
        values: Latest value of each sensor, and its arrival time [s]; by name.
    """

    device: m.Device
    listed: float
    dva: str
    heard: float | None = None
    published: Status | None = None
    look: Callable[[], Status | None] = lambda: None
    holder: tuple[m.RobotHolder, float] | None = None
    emergency: tuple[m.RobotEmergency, float] | None = None
    beats: int = 0
    camera: str | None = None
    sensors: tuple[m.Sensor, ...] = ()
    values: dict[str, tuple[m.SensorValue, float]] = field(default_factory=dict)
    rate: Rate = field(default_factory=Rate)
    subscriptions: list[Subscription] = field(default_factory=list)

    @property
    def status(self) -> Status | None:
        """Newest status."""
        return self.look() or self.published


class SystemState:
    """All devices that the DVA lists, and what they publish.

    Args:
        device: Device that subscribes.
        labels: Labels of devices by id, which it keeps up to date.
        own: Function that returns the ids of the devices of the console's own run.
        view: View of the devices on the bench.
        on_news: Callback when a device appears or disappears.

    Attributes:
        devices: Devices by id.
    """

    def __init__(
        self,
        device: AgentDevice,
        labels: dict[str, str],
        own: Callable[[], Container[str]],
        view: BenchView,
        on_news: Callable[[], object],
    ) -> None:
        self._device = device
        self._labels = labels
        self._own = own
        self._look = view.status
        self._on_news = on_news
        self.devices: dict[str, DeviceState] = {}

    @property
    def _now(self) -> float:
        return self._device.clock.now

    def list(self, devices: Sequence[m.Device], dva: str) -> None:
        """Take the list of who is registered with a DVA."""
        before = {(i, entry.device) for i, entry in self.devices.items()}
        own = self._own()
        for device in devices:
            others = [label for id_tag, label in self._labels.items() if id_tag != device.id_tag]
            label = distinct(device.label, device.id_tag, others)
            if device.id_tag in own:
                label = self._labels[device.id_tag]  # its person may have given it another one
            self.meet(replace(device, label=label), dva, self._now)
        late = [i for i, entry in self.devices.items() if self._now - entry.listed > FORGET_AFTER]
        lost = [id_tag for id_tag in late if self.devices[id_tag].status is not None][-MAX_LOST:]
        for id_tag in late:
            if id_tag not in lost:  # which stands where it was last, and may need help
                self.forget(id_tag)
        if {(i, entry.device) for i, entry in self.devices.items()} != before:
            self._on_news()

    def forget(self, id_tag: str) -> None:
        """Listen to a device no longer, and know nothing of it."""
        state = self.devices.pop(id_tag, None)
        if state is not None:
            self._leave(state)
            if not self.is_own(id_tag):
                self._device.forget(id_tag)

    def is_own(self, id_tag: str) -> bool:
        """Return True for a device of the console's own run."""
        return id_tag in self._own()

    def sensors(self, sensor_list: m.SensorList) -> None:
        """Take the DVA's list of what the devices can show."""
        for one in sensor_list.devices:
            if (state := self.devices.get(one.device)) is not None:
                state.camera = one.camera_url
                state.sensors = one.sensors

    def meet(self, device: m.Device, dva: str, listed: float) -> None:
        """Subscribe to a device that a DVA lists, again if its address has changed."""
        self._labels[device.id_tag] = device.label
        entry = self.devices.get(device.id_tag)
        if entry is not None and entry.device.address == device.address:
            entry.device = device
            entry.listed = listed
            entry.dva = dva
            return
        if entry is not None:
            self._leave(entry)
        look = partial(self._look, device.id_tag)
        state = entry or DeviceState(device, listed, dva, look=look)
        self.devices[device.id_tag] = state
        state.device = device
        state.listed = listed
        state.dva = dva
        network = self._device.network
        me = self._device.id_tag
        node = device.id_tag
        if not self.is_own(node):
            network.introduce(node, device.address)
        for topic in TOPICS.get(device.device_type, (HEARTBEAT,)):
            heard = self._hearing(state)
            state.subscriptions.append(network.subscribe(me, node, topic, heard))

    def _hearing(self, device_state: DeviceState) -> Callable[[bytes], object]:
        def heard(data: bytes) -> None:
            message = self._device.read(data, device_state.device.id_tag)
            if message is None:
                return
            device_state.heard = self._now
            body = message.body
            if isinstance(body, m.RobotStatus | m.PersonStatus):
                device_state.published = body
            elif isinstance(body, m.RobotHolder):
                device_state.holder = body, self._now
            elif isinstance(body, m.RobotEmergency):
                device_state.emergency = body, self._now
            elif isinstance(body, m.Heartbeat):
                device_state.beats += 1

        return heard

    @staticmethod
    def _leave(device_state: DeviceState) -> None:
        for subscription in device_state.subscriptions:
            subscription.close()
        device_state.subscriptions.clear()
