"""What the command line says about the emulated link."""

from __future__ import annotations

from rich.console import Console

from dva_sim.kernel.errors import ExitCode
from dva_sim.validation.network.emulator.running import EmulatorError, why_no_packets
from dva_sim.validation.network.emulator.self_check import check_link

console = Console(highlight=False, soft_wrap=True)
OFFER = "a relay of TCP over the loopback can take its place for measurements without loss"
QUIET = "real-time priority, which root has, or a quiet machine helps"


def check() -> ExitCode:
    """Print what is found about the emulated link; how it ended.

    Raises:
        EmulatorError: there is none here: why, and what there is instead.
    """
    why = why_no_packets()
    if why:
        raise EmulatorError(f"{why}; {OFFER}")
    findings = check_link()
    for finding in findings:
        console.print(str(finding), markup=False)
    if all(finding.passed for finding in findings):
        return ExitCode.OK
    console.print(f"What is late only now and then waited for the processor: {QUIET}.")
    return ExitCode.DOES_NOT_HOLD
