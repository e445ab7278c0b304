"""A console from its start to its end: the world here, the web and the pictures beside it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from dva_sim.console.audit.audit_keeper import auditing
from dva_sim.console.driving.seating import leave_seats
from dva_sim.console.options import kept_results, motion_folder, scenario_of, sockets
from dva_sim.console.pages.processes import ConsoleProcesses
from dva_sim.console.world.kept_results import KeptResults
from dva_sim.console.world.run_actions import RunActions
from dva_sim.console.world.world import ConsoleWorld
from dva_sim.kernel.errors import DvaSimError
from dva_sim.live.kept_facts import keep_run
from dva_sim.live.pipes import Inlets
from dva_sim.live.process import ending_when_asked
from dva_sim.live.recording import Keeper, LiveRecorder
from dva_sim.network.emulator.report import LinkReport
from dva_sim.options.runs import LOCALHOST, ConsoleOptions
from dva_sim.ros.gateway import RosGateway
from dva_sim.ros.server import RosbridgeServer
from dva_sim.serving.open_port import OpenPort, open_port
from dva_sim.serving.pipes import PipeEnd
from dva_sim.serving.processes import ChildFailed
from dva_sim.simulation.full.verdicts import refuse_unheld, verdicts
from dva_sim.simulation.scenario import Scenario

if TYPE_CHECKING:
    from dva_sim.live.foxglove_server import FoxgloveServer

Say = Callable[[str], object]


class ConsoleSupervisor:
    """One console.

    Args:
        options: Scenario and addresses.
        say: Prints a line.

    Attributes:
        packets: Report on the packets of the emulated link, once it has ended.
    """

    def __init__(self, options: ConsoleOptions, say: Say) -> None:
        self._options = options
        self._say = say
        phones = (options.phones_host, options.phones_port) if options.phones else None
        self._processes = ConsoleProcesses(options, say, phones)
        self.packets: LinkReport | None = None
        self._rosbridge: OpenPort | None = None
        self._foxglove: OpenPort | None = None
        self._viewer: FoxgloveServer | None = None

    def run(self) -> None:
        """Run until Ctrl-C, SIGTERM, SIGHUP, or the end of the web process.

        Raises:
            ConfigError: the scenario cannot be run, or not recorded as wanted.
            ChildFailed: the web process could not begin, or has ended by itself.
            DvaSimError: what was to be recorded is not, or not all of it.
            RunsFailed: some tables of the results could not be made.
            RulesBroken: a safety rule was broken.
        """
        options = self._options
        scenario = scenario_of(self._options)
        results = kept_results(options)
        if results is None:
            self._play(scenario, options.seed, None)
        else:
            with closing(results):
                self._play(results.scenario, results.seed, results)

    def _play(self, scenario: Scenario, seed: int, results: KeptResults | None) -> None:
        """Run it, and write all that is wanted of it, whatever else goes wrong."""
        options = self._options
        # All ports are open before the world begins, and before any address is printed.
        self._rosbridge = self._open("--rosbridge", options.host, options.rosbridge)
        self._foxglove = self._open("--foxglove", LOCALHOST, options.foxglove)
        world = ConsoleWorld(
            scenario,
            name=options.played,
            seed=seed,
            sockets=sockets(options),
            measured=results is not None,
        )
        world.phones.motion_folder = motion_folder(options)
        if results is not None:
            results.follow(world)
        try:
            with self._recorded(world):
                self._run(world)
        finally:
            try:
                if results is not None:
                    self._write(results)
            finally:
                judged = verdicts(world.recorder)
                for verdict in judged:
                    self._say(str(verdict))
        if self._processes.failed:
            raise ChildFailed(self._processes.failed)
        if options.record is not None:
            self._say(f"{options.record} written")
        refuse_unheld(judged)

    def _write(self, results: KeptResults) -> None:
        """Write the results even after an earlier error, and report both errors."""
        before = sys.exc_info()[1]
        try:
            results.write()
        except DvaSimError as error:
            if isinstance(before, DvaSimError):
                raise type(before)(f"{before}; {error}") from None
            raise
        self._say(f"{self._options.out} written")

    @contextmanager
    def _recorded(self, world: ConsoleWorld) -> Iterator[None]:
        """Keep a recording of what happens, if one is wanted; in the end all is closed."""
        options = self._options
        keeper = None
        outlet = None
        inlets = None
        viewer = self._viewer = self._show_to_foxglove(world)
        also = None if viewer is None else viewer.keep
        if options.record is not None:
            keeper = Keeper(options.record, world.scenario, world.seed, also=also)
            inlets = keeper.inlets
        elif also is not None:
            inlets = Inlets(also=also)
        if inlets is not None:
            outlet = PipeEnd(inlets.inlet())
            world.recorder.kept = recorder = LiveRecorder(world.clock, outlet)
            recorder.is_own = world.is_ours
            keep_facts = keep_run(world.run, recorder)
        try:
            with auditing(options.audit, world.clock, self._about(world), self._say) as audit:
                world.keep_audit(audit)
                yield
        finally:
            self._processes.end()
            world.phones.close()
            if world.sockets is not None:
                world.sockets.close()
                self.packets = world.sockets.packets
            if outlet is not None:
                keep_facts()
                world.recorder.tidy()
                outlet.close()
            if viewer is not None:
                viewer.close()
            lost = None if keeper is None else keeper.finish()
            if lost is not None and sys.exc_info()[0] is None:
                raise DvaSimError(lost)

    def _open(self, option: str, host: str, port: int | None) -> OpenPort | None:
        """Open a port for programs of other makes, if it is wanted."""
        return None if port is None else open_port(host, port, option, not self._options.no_token)

    def _show_to_foxglove(self, world: ConsoleWorld) -> FoxgloveServer | None:
        if self._foxglove is None:
            return None
        from dva_sim.live.foxglove_server import FoxgloveServer  # late: start-up

        return FoxgloveServer(world.scenario, world.seed, self._foxglove)

    def _about(self, world: ConsoleWorld) -> dict[str, Any]:
        options = self._options
        return {"scenario": options.played, "seed": world.seed, "links": options.links}

    def _run(self, world: ConsoleWorld) -> None:
        with ending_when_asked(world.clock, supervised=False) as ending:
            actions = RunActions(world)
            path = None if world.audited is None else world.audited.keeper.path
            self._processes.start(world, actions.take, audit=path)
            if world.sockets is not None:
                self._say(f"DVA: {world.sockets.dva}")
            port = self._rosbridge
            rosbridge = None if port is None else self._serve_ros(world, port)
            if self._viewer is not None:
                self._say(self._viewer.where)
                self._viewer.camera_base = str(self._processes.serving["base"])
                self._viewer.camera_token = self._look_token
            if not ending.is_asked:
                if world.sockets is not None:
                    world.sockets.begin()
                world.clock.go()
                world.clock.run()
            if world.sockets is not None:
                world.sockets.refuse_lost_link()
            if rosbridge is not None:
                rosbridge.close()
            self._leave(world)

    def _serve_ros(self, world: ConsoleWorld, port: OpenPort) -> RosbridgeServer:
        """Serve the robots to clients of ROS."""
        stage = world.run.stage
        gateway = RosGateway(stage, lambda: world.seating.console)
        gateway.camera_base = str(self._processes.serving["base"])
        gateway.camera_token = self._look_token
        self._say(f"rosbridge: {port.url}")
        return RosbridgeServer(world.clock, port, gateway, stage.site, world.note)

    @property
    def _look_token(self) -> str:
        """Return the token that opens pictures."""
        look = urlsplit(str(self._processes.serving.get("look", "")))
        return parse_qs(look.query).get("token", [""])[0]

    def _leave(self, world: ConsoleWorld) -> None:
        """Stop everybody who drives, and leave a moment for the word of it."""
        leave_seats(world.seating, world.clock)
        world.tell({"k": "bye", "t": world.feed.now_ms, "why": "the console was ended"})
