"""Fake devices: registered by hand, on every list, and deaf to all messages.

They register as others do, by messages, and register again before the DVA could miss them; nothing
on the wire tells them from others. Nobody takes the requests to them, so that a request ends in
a time-out.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import OnResult, Refused, unanswered
from dva_sim.console.wire.arguments import FakeAsked, OfDevice
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError
from dva_sim.protocol.limits import pattern

RENEW: Final = 3.0  # from one registration to the next: a third of what the DVA bears [s]
MAX_FAKES: Final = 64
DOCUMENTATION_ADDRESS: Final = "192.0.2.{}"  # addresses that belong to nobody (RFC 5737)

MakeDevice = Callable[[str, str, str, str], AgentDevice]


class FakeDevices:
    """All that were added by hand.

    Args:
        make: Function that makes a device of an id, a label, a type and an address.
        is_known: Predicate: True if a device with this id exists.
        id_of: Function that returns the id of the n-th fake device, and an address at which nobody
            is, from 1.
        dismiss: Forgets a device, and makes the DVA forget it where it can be made to.
        removed: Predicate of a sentence about a device that was removed.

    Attributes:
        devices: By id.
    """

    def __init__(
        self,
        make: MakeDevice,
        is_known: Callable[[str], bool],
        id_of: Callable[[int], tuple[str, str]],
        dismiss: Callable[[str], object],
        removed: str,
    ) -> None:
        self._make = make
        self._removed_text = removed
        self._is_known = is_known
        self._id_of = id_of
        self._dismiss = dismiss
        self.devices: dict[str, AgentDevice] = {}

    @does("fake_add")
    def add(self, _: str, line: FakeAsked, on_result: OnResult) -> None:
        """Add one; `on_result` hears whether the DVA has taken it.

        Raises:
            Refused: it cannot be.
        """
        if len(self.devices) >= MAX_FAKES:
            raise Refused(f"There are already {MAX_FAKES} fake devices. Remove one first.")
        id_tag, address = self._identity(line)
        device = self._make(id_tag, line["label"], line["type"], address)
        self.devices[id_tag] = device

        def answered(reply: m.Reply) -> None:
            if reply.code == m.OK:
                device.clock.every(RENEW, lambda: self._renew(device))
                on_result(True, f"{device.label} is registered as {id_tag}", device=id_tag)
            else:
                self._drop(device)
                on_result(False, f"the DVA refuses it: {reply.reason}")

        def failed() -> None:
            self._drop(device)
            unanswered(on_result)

        try:
            device.ask(device.dva, _registration(device), answered, failed)
        except ProtocolError as error:
            self._drop(device)
            raise Refused(error.reason) from None

    @does("fake_remove")
    def remove(self, _: str, line: OfDevice, on_result: OnResult) -> None:
        """Remove one.

        Raises:
            Refused: there is none of that id.
        """
        device = self.devices.get(line["device"])
        if device is None:
            raise Refused(f"There is no fake device {line['device']}.")
        self._drop(device)
        on_result(True, f"{device.label} {self._removed_text}")

    def _drop(self, device: AgentDevice) -> None:
        self.devices.pop(device.id_tag, None)
        device.leave()
        self._dismiss(device.id_tag)

    def _renew(self, device: AgentDevice) -> bool:
        here = self.devices.get(device.id_tag) is device
        if here:
            device.ask(device.dva, _registration(device), lambda _: self._renewed(device))
        return here

    def _renewed(self, device: AgentDevice) -> None:
        """Dismiss a device that was removed while its registration was pending."""
        if device.id_tag not in self.devices:
            self._dismiss(device.id_tag)

    def _identity(self, line: FakeAsked) -> tuple[str, str]:
        """Return the id and address, made where they were not given.

        Raises:
            Refused: the id is taken, or is none.
        """
        id_tag = line.get("id_tag", "").strip().upper()
        number = next(n for n in range(1, 1 << 16) if not self._is_taken(self._id_of(n)[0]))
        own, address = self._id_of(number)
        if id_tag and not re.fullmatch(pattern("DeviceID"), id_tag):
            raise Refused(
                "id should be six pairs of digits 0 to 9 and letters A to F, as in " + own
            )
        if id_tag and self._is_taken(id_tag):
            raise Refused(f"id {id_tag} is taken")
        return id_tag or own, line.get("address", "").strip() or address

    def _is_taken(self, id_tag: str) -> bool:
        return id_tag in self.devices or self._is_known(id_tag)


def _registration(device: AgentDevice) -> m.Registration:
    return m.Registration(device.label, device.device_type, device.address)
