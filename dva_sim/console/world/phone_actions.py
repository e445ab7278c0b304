"""Actions of people with phones: registration, a robot, calibration, and tilt samples.

A phone exists from the first message of its page until that has gone for good. One phone holds one
robot. What ends a drive ends it at once, and for good.
"""

from __future__ import annotations

import time
from functools import partial

from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.console.asking.dispatcher import does
from dva_sim.console.asking.refusal import NO_ANSWER, OnResult, Refused, unanswered
from dva_sim.console.driving.drive_actions import Driving
from dva_sim.console.events.decisions import place_of, report_of
from dva_sim.console.phones.phone_input import samples_of, settings_of
from dva_sim.console.phones.phone_seat import PhoneSeat
from dva_sim.console.wire.actions import Asked
from dva_sim.console.wire.arguments import (
    CalibrationAsked,
    PhoneIdentity,
    PhoneWish,
    ReportAsked,
    SampleBatch,
)
from dva_sim.console.wire.seats import DeviceShown
from dva_sim.console.world.world import ConsoleWorld
from dva_sim.protocol import messages as m
from dva_sim.protocol.errors import ProtocolError

LIFTED = "stopped: the thumb was lifted"
TURNED_TEXT = "stopped: the phone's screen has turned"


class PhoneActions:
    """Does what phones ask for.

    Args:
        driving: Seats, and drives from pages.
    """

    def __init__(self, world: ConsoleWorld, driving: Driving) -> None:
        self._world = world
        self._driving = driving
        self._seating = world.seating
        self._seats = world.seating.seats
        self._phones = world.phones

    def sits(self, client: str) -> bool:
        """Return True if a page has the seat of a phone, and none of the console."""
        phone = self._phones.by_client.get(client)
        return phone is not None and phone.person is not None

    def is_tilted(self, client: str) -> bool:
        """Return True for the page of a phone that is steered by tilt now."""
        phone = self._phones.by_client.get(client)
        return phone is not None and phone.tilts

    def let_go(self, client: str) -> None:
        """Let go of the stick on a phone's screen, if it is a phone."""
        phone = self._phones.by_client.get(client)
        if phone is not None:
            phone.tilt.let_go()

    def samples(self, client: str, line: SampleBatch) -> None:
        """Take samples of a phone."""
        batch = samples_of(line)
        phone = self._phones.seat(client)
        if phone is None:
            return
        if phone.person is None:
            phone.lend(self._seating.of_client(client))
        now = time.monotonic()
        if phone.driven is not None and not batch.hand:
            self._driving.stop_client(client, LIFTED)
        elif phone.driven is not None and batch.orientation != phone.orientation:
            self._driving.stop_client(client, TURNED_TEXT)
        phone.turn(batch.orientation)
        if phone.take(batch, now):  # a sensor that says the same again and again is silent
            self._seats.heard(client, now, batch.hand)

    def leaves(self, client: str) -> None:
        """Note that a page has left its seat: another one there steers as it likes."""
        phone = self._phones.by_client.get(client)
        if phone is not None:
            phone.lend(None)

    def forget(self, client: str) -> None:
        """Let the device of a page that has gone for good leave."""
        phone = self._phones.by_client.pop(client, None)
        if phone is not None:
            self._retire(client, phone)
            phone.keep(None)
            self._world.free_seat(client)

    # --- who it is -------------------------------------------------------------------------

    @does("phone_register")
    def _register(self, client: str, line: PhoneIdentity, on_result: OnResult) -> None:
        label = line["label"]
        kind = line["type"]
        address = f"{line['server'].strip()}:{line['port']}"
        seat = self._seats.taken.get(client)
        if seat is not None and not self.sits(client):
            raise Refused("This page is driving as a console operator. Release control first.")
        phone = self._phone(client)
        self._retire(client, phone)
        number = self._phones.new_person(phone, label, kind, address)
        if number is None:
            raise Refused("Too many phones have connected recently. Try again in two minutes.")
        person = phone.person
        assert person is not None
        self._seating.let_in(number, person)
        self._seats.sit_at(client, number)

        def answered(reply: m.Reply) -> None:
            if phone.person is not person:
                on_result(False, "another registration has taken its place")
            elif reply.code == m.OK:
                phone.registered = True
                self._seating.client_of[number] = client
                for robot in self._world.run.field.robots:
                    person.device.connect(robot)  # an emergency does not wait for a connection
                on_result(True, f"{label} is registered", phone=phone.identity())
            else:
                self._retire(client, phone)
                on_result(False, reply.reason)

        def unreachable() -> None:
            if phone.person is person:
                self._retire(client, phone)
            on_result(False, f"no DVA answers at {address}")

        try:
            person.device.register_once(answered, unreachable)
        except ProtocolError as error:
            self._retire(client, phone)
            raise Refused(error.reason) from None

    def _phone(self, client: str) -> PhoneSeat:
        phone = self._phones.seat(client)
        if phone is None:
            raise Refused("The limit of connected phones is reached.")
        return phone

    def _retire(self, client: str, phone: PhoneSeat) -> None:
        """Remove a phone's device, if it has one."""
        if phone.person is None:
            return
        phone.person = None
        phone.registered = False
        number = self._seats.stand_up(client)
        if number is not None:
            self._seating.client_of.pop(number, None)
            person = self._seating.persons.pop(number)
            person.release(lambda *_: None)  # its robots are given back first
            self._phones.retire(number, person.device)

    def _device(self, client: str) -> tuple[PhoneSeat, PersonAgent]:
        phone = self._phones.by_client.get(client)
        if phone is None or phone.person is None or not phone.registered:
            raise Refused("Register this phone first.")
        return phone, phone.person

    # --- what it asks of the DVA ---------------------------------------------------------------

    @does("phone_devices")
    def _devices(self, client: str, _: Asked, on_result: OnResult) -> None:
        device = self._device(client)[1].device

        def answered(reply: m.Reply) -> None:
            if not isinstance(reply.content, m.DeviceList):
                on_result(False, reply.reason)
                return
            known = self._world.system.state.devices.values()
            devices = [_shown(one) for one in reply.content.devices]
            devices += [_shown(entry.device) for entry in known if entry.dva != device.dva]
            on_result(True, f"{len(devices)} devices", devices=devices)

        device.ask(device.dva, m.GetDeviceList(), answered, lambda: on_result(False, NO_ANSWER))

    @does("phone_permission")
    def _permission(self, client: str, line: PhoneWish, on_result: OnResult) -> None:
        _, person = self._device(client)
        level = line["level"]
        robot = self._asked(line["device"])
        held = person.robots.get(robot)
        if held is not None and held.level == level:
            on_result(True, f"{held.label} is yours already")
            return
        for other in list(person.robots.values()):
            other.give_back()
        person.alert = ""

        def answered(ok: bool, text: str) -> None:
            self._driving.hold()
            on_result(ok, text)

        self._driving.turn(
            person, [robot], partial(person.take, [robot], answered, level), on_result
        )

    @does("phone_report")
    def _report(self, client: str, line: ReportAsked, on_result: OnResult) -> None:
        device = self._device(client)[1].device
        x, y = place_of(line, self._world.system.site)
        body, done = report_of(line, m.Position(*device.frame.to_latlon(x, y)))

        def answered(reply: m.Reply) -> None:
            if reply.code != m.OK:
                on_result(False, reply.reason)
            elif isinstance(reply.content, m.EventStatus):
                on_result(True, done, event=reply.content.event_id)
            else:
                on_result(True, done)

        device.ask(device.dva, body, answered, lambda: unanswered(on_result))

    def _asked(self, name: str) -> str:
        """Resolve the requested id; unknown ones pass, so that the DVA can refuse them.

        Raises:
            Refused: the device is unknown.
        """
        return name if name in self._world.run.stage.labels else self._driving.robot(name)

    @does("phone_calibrate")
    def _calibrate(self, client: str, line: CalibrationAsked, on_result: OnResult) -> None:
        phone = self._phone(client)
        settings = settings_of(line)
        motion_note = self._phones.keep_motion(phone, settings.keep)
        phone.calibrate(settings)
        later = " from the next drive on" if phone.driven is not None else ""
        on_result(True, f"calibrated{later}{motion_note}")


def _shown(device: m.Device) -> DeviceShown:
    return {
        "id": device.id_tag,
        "label": device.label,
        "type": device.device_type,
        "address": device.address,
    }
