"""Devices added by hand beside a run: they register with its DVA as any other does."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.device import AgentDevice
from dva_sim.console.dva.fake_devices import DOCUMENTATION_ADDRESS, FakeDevices
from dva_sim.console.dva.run_bench import RunBench
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import address_of, id_of


def fakes_of(run: Run, bench: RunBench, dismissed: Callable[[str], object]) -> FakeDevices:
    """Make room for devices beside a run.

    Args:
        run: The run.
        bench: Bench on which its DVA runs.
        dismissed: Callback for a device that the DVA has been made to forget, by id.
    """
    stage = run.stage

    def make(id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
        return stage.take_in(id_tag, label=label, device_type=kind, address=address)

    def identity(number: int) -> tuple[str, str]:
        is_modelled = bench.is_modelled
        address = (
            address_of("fake", number)
            if is_modelled
            else DOCUMENTATION_ADDRESS.format(number % 250 + 1)
        )
        return id_of("fake", number), address

    def dismiss(id_tag: str) -> None:
        stage.devices[:] = [d for d in stage.devices if d.id_tag != id_tag]
        stage.labels.pop(id_tag, None)
        bench.forget(id_tag)
        dismissed(id_tag)

    return FakeDevices(
        make, is_known=bench.is_registered, id_of=identity, dismiss=dismiss, removed="is removed"
    )
