"""The console as its users start it."""

import re
from pathlib import Path
from typing import NamedTuple

from helpers.paths import TESTS
from helpers.processes.programs import Program, Programs

OFFICE = TESTS / "data" / "office.yaml"
"""A scenario that begins within seconds, and has something for each page."""

PHONES = ("--phones", "--phones-host", "127.0.0.1", "--phones-port", "0")


class Addresses(NamedTuple):
    """Addresses of a running console.

    Attributes:
        drive: Address with the token for driving.
        look: Address for looking only.
        phones: Address for phones, by https; empty without one.
    """

    drive: str
    look: str
    phones: str = ""

    @property
    def phone(self) -> str:
        """The phone's page at the console's own address, as by `adb reverse`."""
        return f"{self.base}phone?{self.phones.partition('?')[2]}"

    @property
    def guard(self) -> str:
        """The guard's page there."""
        return self.phone.replace("/phone?", "/guard?")

    @property
    def base(self) -> str:
        """Without a token."""
        return self.drive.partition("?")[0]


def started(programs: Programs, *words: str | Path) -> tuple[Program, str]:
    """A console that opens no browser, and its address."""
    console = programs.start("console", "--no-open", "--port", "0", *words)
    console.wait_to_say("Console:")
    return console, re.findall(r"^Console: +(\S+)$", console.output, re.MULTILINE)[0]


def addresses_of(programs: Programs, *words: str | Path) -> Addresses:
    """A console of the small office starts; return its addresses."""
    console, drive = started(programs, OFFICE, *words)
    if "--phones" in words:
        console.wait_to_say("trust this computer")
    console.wait_to_say("Look only:")
    found = dict(re.findall(r"^(Look only|Phone): +(\S+)$", console.output, re.MULTILINE))
    return Addresses(drive, found["Look only"], found.get("Phone", ""))
