"""The phones of a console: who registers gets a device of the modelled network, for as long as
its page is there.

Numbers, and with them ids, are given out again only when the DVA has forgotten who had them.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Final

from dva_sim.agents.device import AgentDevice
from dva_sim.agents.operator.handheld import Console
from dva_sim.agents.operator.person_at_console import PersonAgent
from dva_sim.agents.tilt import PhoneProfile, known_filters, known_mappings
from dva_sim.console.asking.seats import FIRST_OF_PHONES
from dva_sim.console.phones.phone_input import PIPELINES, PhoneSettings
from dva_sim.console.phones.phone_seat import PhoneSeat
from dva_sim.console.wire.arguments import DELAYS, STEPS
from dva_sim.console.wire.scenes import PhoneOffer
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.realtime import PacedClock
from dva_sim.protocol.devices import FORGET_AFTER, OPERATOR, REMOTE, ROBOT
from dva_sim.recordings.motion import MotionWriter
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import address_of
from dva_sim.simulation.scenario import PhoneConfig, phone_profile

DVA_PORT: Final = 5555  # at which the modelled DVA is said to listen
NOBODY: Final = "02:00:00:00:FF:FF"  # who listens at any other address
MAX_PHONES: Final = 64
MAX_IDS: Final = 250
RESTS: Final = FORGET_AFTER + 60.0  # from the end of a phone until its id is given out again [s]
TYPES: Final = {"Robot": ROBOT, "Remote Control": REMOTE, "Teleoperation": OPERATOR}
"""Device types on the wire, by the word on the screen."""


class Phones:
    """All phones of a console.

    Args:
        clock: Its own.
        console: Current equipment of persons.
        address: Address of the DVA, if the links are real; a modelled one has no real address.

    Attributes:
        address: Address of the DVA.
        by_client: The phones by their pages.
        motion_folder: Folder for the motion of persons who agree; None: not kept.
    """

    def __init__(
        self, run: Run, clock: PacedClock, console: Callable[[], Console], address: str | None
    ) -> None:
        self._run = run
        self._clock = clock
        self._console = console
        self.address = address or f"{address_of('dva', 1)}:{DVA_PORT}"
        self.by_client: dict[str, PhoneSeat] = {}
        self.motion_folder: Path | None = None
        self._used: set[int] = set()
        named = run.scenario.phone.profile
        self._pipeline = named if named in PIPELINES else PhoneSettings.pipeline

    def seat(self, client: str) -> PhoneSeat | None:
        """Return the phone of a page, from its first word on; None: there are too many."""
        if client not in self.by_client:
            if len(self.by_client) >= MAX_PHONES:
                return None
            setup = self._console().setup
            hz = self._console().phone.sample_rate_hz
            seat = PhoneSeat(self._clock, self.profile, hz, setup.attempts)
            seat.calibrate(PhoneSettings(pipeline=self._pipeline))
            self.by_client[client] = seat
        return self.by_client[client]

    def profile(self, settings: PhoneSettings) -> PhoneProfile:
        """Return the profile of a phone with this calibration.

        Raises:
            ConfigError: no phone could work so.
        """
        phone = PhoneConfig(profile=settings.pipeline, **settings.changes)
        return phone_profile(self._run.scenario.model_copy(update={"phone": phone}))

    def pattern_of(self, robot: str) -> str | None:
        """Return the pattern of the phone that holds a robot, by its id; None: any will do."""
        held = (seat for seat in self.by_client.values() if seat.holds(robot))
        return next((PIPELINES[seat.settings.pipeline] for seat in held), None)

    def offer(self) -> PhoneOffer:
        """Return the choices of a phone's page."""
        default = self.profile(PhoneSettings())
        return {
            "pipelines": {
                name: self.profile(PhoneSettings(pipeline=name)).model_dump(mode="json")
                for name in PIPELINES
            },
            "pipeline": self._pipeline,
            "filters": known_filters(),
            "mappings": known_mappings(),
            "speed_step_mps2": default.speed_step_mps2,
            "turn_step_mps2": default.turn_step_mps2,
            "max_delay_s": default.max_delay_s,
            "limits": {"step_mps2": list(STEPS), "max_delay_s": list(DELAYS)},
        }

    def keep_motion(self, seat: PhoneSeat, agreed: bool) -> str:
        """Begin or end to write a phone's motion down; what there is to say of it.

        Raises:
            ConfigError: the file cannot be written.
        """
        if not agreed or self.motion_folder is None:
            seat.keep(None)
            return "; this console keeps no motion" if agreed else ""
        if seat.motion is not None:
            return f"; its motion is kept in {seat.motion.name}"
        names = (self.motion_folder / f"motion-{n}.csv" for n in count(1))
        try:
            seat.keep(MotionWriter(next(name for name in names if not name.exists())))
        except OSError as error:
            problem = f"its motion cannot be kept: {error.strerror}"
            raise ConfigError(problem, self.motion_folder) from None
        return f"; its motion is kept in {seat.motion.name}" if seat.motion is not None else ""

    def close(self) -> None:
        """Complete the files of motion at the end of the run."""
        for seat in self.by_client.values():
            seat.keep(None)

    # --- devices -----------------------------------------------------------------------------

    def new_person(self, seat: PhoneSeat, label: str, kind: str, address: str) -> int | None:
        """Return a device for a phone, that knows a DVA at an address; the number of its seat.

        None: too many have come and gone lately.
        """
        number = next((n for n in range(1, MAX_IDS + 1) if n not in self._used), None)
        if number is None:
            return None
        self._used.add(number)
        device = self._run.stage.device("phone", number)
        device.call(label)
        device.device_type = TYPES[kind]
        device.dvas = device.dvas if address == self.address else (NOBODY,)
        device.dva = device.dvas[0]
        seat.person = PersonAgent(device, self._console(), seat.new_tilt)
        seat.person.sit_down()
        return FIRST_OF_PHONES + number

    def retire(self, number: int, device: AgentDevice) -> None:
        """Retire a phone that has gone; what it said last still goes out."""
        device.leave()
        self._clock.call_after(RESTS, self._forget, number - FIRST_OF_PHONES, device)

    def _forget(self, number: int, device: AgentDevice) -> None:
        for peer in (*device.dvas, *self._run.field.robots):
            device.forget(peer)
        self._run.stage.dismiss(device)
        self._used.discard(number)
