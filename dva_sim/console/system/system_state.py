"""State of a system as its messages tell it: devices, and what each published last."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from dva_sim.agents.device import EMERGENCY, HEARTBEAT, HOLDER, STATUS, AgentDevice
from dva_sim.kernel.labels import distinct
from dva_sim.kernel.rates import Rate
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import FORGET_AFTER, GUARD, ROBOT

TOPICS: Final = {ROBOT: (HEARTBEAT, STATUS, HOLDER, EMERGENCY), GUARD: (HEARTBEAT, STATUS)}


@dataclass
class DeviceState:
    """A device, as far as messages tell.

    Attributes:
        device: Device as in the list.
        listed: Time of the latest list that contains it [s].
        dva: Id of the DVA whose list that is.
        is_own: True if it belongs to the console's own run, so that nobody need listen to it.
        heard: Time of its latest publication; None: never [s].
        status: Latest status that it published.
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
    is_own: bool = False
    heard: float | None = None
    status: m.RobotStatus | m.PersonStatus | None = None
    holder: tuple[m.RobotHolder, float] | None = None
    emergency: tuple[m.RobotEmergency, float] | None = None
    beats: int = 0
    camera: str | None = None
    sensors: tuple[m.Sensor, ...] = ()
    values: dict[str, tuple[m.SensorValue, float]] = field(default_factory=dict)
    rate: Rate = field(default_factory=Rate)
    subscriptions: list[Subscription] = field(default_factory=list)


class SystemState:
    """All devices that the DVA lists, and what they publish.

    Args:
        device: Device that subscribes.
        labels: Labels of devices by id, which it keeps up to date.
        own: Function that returns the ids of the devices of the console's own run.
        on_news: Callback when a device appears or disappears.

    Attributes:
        devices: Devices by id.
    """

    def __init__(
        self,
        device: AgentDevice,
        labels: dict[str, str],
        own: Callable[[], Container[str]],
        on_news: Callable[[], object],
    ) -> None:
        self._device = device
        self._labels = labels
        self._own = own
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
            if device.id_tag in own:
                label = self._labels[device.id_tag]
                entry = DeviceState(replace(device, label=label), self._now, dva, is_own=True)
                self.devices[device.id_tag] = entry
            else:
                named = self._labels.items()
                others = [label for id_tag, label in named if id_tag != device.id_tag]
                label = distinct(device.label, device.id_tag, others)
                self._meet(replace(device, label=label), dva)
        late = [i for i, entry in self.devices.items() if self._now - entry.listed > FORGET_AFTER]
        for id_tag in late:
            self.forget(id_tag)
        if {(i, entry.device) for i, entry in self.devices.items()} != before:
            self._on_news()

    def forget(self, id_tag: str) -> None:
        """Listen to a device no longer, and know nothing of it."""
        state = self.devices.pop(id_tag, None)
        if state is not None and not state.is_own:
            self._leave(state)
            self._device.forget(id_tag)

    def sensors(self, sensor_list: m.SensorList) -> None:
        """Take the DVA's list of what the devices can show."""
        for one in sensor_list.devices:
            if (state := self.devices.get(one.device)) is not None:
                state.camera = one.camera_url
                state.sensors = one.sensors

    def _meet(self, device: m.Device, dva: str) -> None:
        """Subscribe to a device, again if its address has changed."""
        self._labels[device.id_tag] = device.label
        entry = self.devices.get(device.id_tag)
        if entry is not None and entry.device.address == device.address:
            entry.device = device
            entry.listed = self._now
            entry.dva = dva
            return
        if entry is not None:
            self._leave(entry)
        state = self.devices[device.id_tag] = entry or DeviceState(device, self._now, dva)
        state.device = device
        state.listed = self._now
        state.dva = dva
        network = self._device.network
        me = self._device.id_tag
        node = device.id_tag
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
                device_state.status = body
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
