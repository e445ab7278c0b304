"""Pages Main and Devices: what they show of the DVA, and their actions."""

from __future__ import annotations

from dva_sim.agents.device import AgentDevice
from dva_sim.console.bench import ServerActions
from dva_sim.console.dva.device_rows import DeviceRows
from dva_sim.console.dva.fake_devices import NOWHERE, FakeDevices
from dva_sim.console.dva.run_bench import RunBench
from dva_sim.console.wire.rows import DevicesLine
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import DVA, address_of, id_of
from dva_sim.simulation.scenario import request_timeout_s


class DvaPages(ServerActions):
    """The DVA of a run as people see and serve it.

    Args:
        run: The run.
        bench: Bench on which its DVA runs.

    Attributes:
        fakes: Devices that were added by hand, which hear nothing.
        looked: True while somebody looks at the table of devices.
    """

    def __init__(self, run: Run, bench: RunBench) -> None:
        super().__init__(bench)
        self.bench = bench
        self._run = run
        self.looked = False
        self._rows = DeviceRows(run, self.bench)
        self.fakes = FakeDevices(
            self._make,
            is_known=self.bench.is_registered,
            id_of=self._identity,
            dismiss=self._dismiss,
            removed="is removed",
        )

    def devices(self, now_ms: int) -> DevicesLine | None:
        """The table, once a second; None if nobody looks."""
        if not self.looked:
            return None
        rows = self._rows.rows(self.fakes.devices)
        return {"k": "devices", "t": now_ms, "devices": rows}

    # --- fake devices ----------------------------------------------------------------------

    def _make(self, id_tag: str, label: str, kind: str, address: str) -> AgentDevice:
        stage = self._run.stage
        device = AgentDevice(
            id_tag=id_tag,
            label=label,
            device_type=kind,
            address=address,
            dva=DVA,
            network=stage.network,
            recorder=stage.recorder,
            frame=stage.site.frame,
            timeout=request_timeout_s(stage.scenario),
            attempts=stage.scenario.request.attempts,
            labels=stage.labels,
            time_of_day=stage.time_of_day,
        )
        stage.devices.append(device)
        return device

    def _identity(self, number: int) -> tuple[str, str]:
        is_modelled = self.bench.is_modelled
        address = address_of("fake", number) if is_modelled else NOWHERE.format(number % 250 + 1)
        return id_of("fake", number), address

    def _dismiss(self, id_tag: str) -> None:
        stage = self._run.stage
        stage.devices[:] = [d for d in stage.devices if d.id_tag != id_tag]
        stage.labels.pop(id_tag, None)
        self.bench.forget(id_tag)
