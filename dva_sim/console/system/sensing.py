"""Values of sensors of robots that somebody looks at: the DVA permits it, and the robot tells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from dva_sim.agents.device import AgentDevice, do_nothing
from dva_sim.agents.operator.steps import give_back, start
from dva_sim.agents.robot.sensors import sensor_topic
from dva_sim.console.system.system_state import DeviceState, SystemState
from dva_sim.network.messaging import Subscription
from dva_sim.protocol import messages as m

FREQUENCY: Final = 0.5  # of the values [Hz]
RENEW: Final = 20.0  # a third of what a subscription lasts for [s]
MAX_ROBOTS: Final = 8  # robots that are listened to at once
MAX_SENSORS: Final = 16  # of one robot


class SensorWatch:
    """One robot whose sensors are listened to, until nobody looks at it any more.

    Args:
        device: Device that subscribes.
        robot: Id of the robot.
        names: Names of the sensors.
        rate_hz: Desired rate of values [Hz].
        heard: Callback for each value.
        told: Callback for the DVA's first answer: whether it permits that, and why not.

    Attributes:
        names: Names of the sensors, of which those that are permitted are read.
    """

    def __init__(
        self,
        device: AgentDevice,
        robot: str,
        names: Sequence[str],
        rate_hz: float,
        *,
        heard: Callable[[m.SensorValue], object],
        told: Callable[[bool, str], object] | None = None,
    ) -> None:
        self._device = device
        self._robot = robot
        self.names = tuple(names[:MAX_SENSORS])
        self._rate_hz = rate_hz
        self._on_value = heard
        self._told = told or do_nothing
        self._session: int | None = None
        self._over = False
        self._subscriptions: dict[str, Subscription] = {}
        self._ask()

    def end(self) -> None:
        """Give the permission back, as nobody looks any more."""
        self._over = True
        for name, subscription in self._subscriptions.items():
            subscription.close()
            if self._session is not None:
                self._device.ask(self._robot, m.DevSub(name, 0.0), session=self._session)
        self._subscriptions.clear()
        if self._session is not None:
            give_back(self._device, self._robot, self._session)

    def _ask(self) -> None:
        """Ask for the permission; if there is none, again after a while."""
        if self._over:
            return
        wish = m.PermissionRequest(self._robot, "sensors", self.names)
        self._device.ask(self._device.dva, wish, self._answered, self._unanswered)

    def _unanswered(self) -> None:
        self._tell(False, "the DVA does not answer")
        self._ask_later()

    def _tell(self, ok: bool, text: str) -> None:
        told = self._told
        self._told = do_nothing
        told(ok, text)

    def _ask_later(self) -> None:
        self._device.clock.call_after(RENEW, self._ask)

    def _answered(self, reply: m.Reply) -> None:
        permission = reply.content
        if not isinstance(permission, m.Permission):
            self._tell(False, reply.text)
            self._ask_later()
            return
        self._session = permission.session
        if self._over:
            give_back(self._device, self._robot, self._session)
            return
        permitted = permission.sensors or self.names
        withheld = ", ".join(name for name in self.names if name not in permitted)
        self._tell(not withheld, f"you may not read {withheld}" if withheld else "")
        for name in permitted:
            self._listen(name)
            self._subscribe(name)
        self._ask_later()  # which renews all of it

    def _subscribe(self, name: str) -> None:
        """Subscribe again: the robot may not know of the permission yet."""
        start(
            *(self._device, self._robot, m.DevSub(name, self._rate_hz), lambda: self._session or 0),
            wanted=lambda: not self._over,
            begun=do_nothing,
            refused=do_nothing,
            lost=do_nothing,
        )

    def _listen(self, name: str) -> None:
        if name in self._subscriptions:
            return
        device = self._device
        topic = sensor_topic(name, device.id_tag)
        heard = device.network.subscribe(device.id_tag, self._robot, topic, self._heard)
        self._subscriptions[name] = heard

    def _heard(self, data: bytes) -> None:
        message = self._device.read(data, self._robot)
        if message is not None and isinstance(message.body, m.SensorValue):
            self._on_value(message.body)


class WatchedSensors:
    """All robots whose sensors are listened to.

    Args:
        device: Device that subscribes.
        state: State of the robots.
        id_of: The id of a device that pages know by a number; None: there is none.
    """

    def __init__(
        self, device: AgentDevice, state: SystemState, id_of: Callable[[int], str | None]
    ) -> None:
        self._device = device
        self._state = state
        self._id_of = id_of
        self._watches: dict[str, SensorWatch] = {}
        self._looked: list[int] = []

    def watch(self, numbers: list[int]) -> None:
        """Watch these robots, and no others."""
        self._looked = numbers[:MAX_ROBOTS]
        self.go_on()

    def go_on(self) -> None:
        """Begin where it has become known by now which sensors a robot has; end what is over."""
        devices = self._state.devices
        looked = [id_tag for id_tag in map(self._id_of, self._looked) if id_tag in devices]
        id_tags = [id_tag for id_tag in looked if id_tag and not self._state.is_own(id_tag)]
        for id_tag in [one for one in self._watches if one not in id_tags]:
            self._watches.pop(id_tag).end()
            if id_tag in devices:
                devices[id_tag].values.clear()
        for id_tag in id_tags:
            if id_tag not in self._watches and devices[id_tag].sensors:
                self._watches[id_tag] = self._watch(devices[id_tag])

    def _watch(self, device_state: DeviceState) -> SensorWatch:
        def heard(value: m.SensorValue) -> None:
            device_state.values[value.sensor] = value, self._device.clock.now

        names = [sensor.name for sensor in device_state.sensors]
        robot = device_state.device.id_tag
        return SensorWatch(self._device, robot, names, FREQUENCY, heard=heard)
