"""One simulated robot as a program of its own: what it is asked for, its start and its end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dva_sim.cameras.children import ChildFailed
from dva_sim.console.asking.refusal import Refused
from dva_sim.console.audit.audit_keeper import auditing
from dva_sim.console.pages.addresses import own_address
from dva_sim.console.pages.page_options import PageOptions
from dva_sim.console.pages.processes import ConsoleProcesses
from dva_sim.console.simulator.lone_robot_actions import LoneRobotActions
from dva_sim.console.simulator.robot_world import RobotWorld
from dva_sim.live.process import ending_when_asked
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import KeyRing
from dva_sim.simulation.full.verdicts import (
    EVENTS_UNKNOWN,
    OF_THE_DVA,
    refuse_unheld,
    verdicts,
)
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.scenario.lone_robot import lone_robot

LAST_WORDS = 0.2  # for what was said last [s]
EVERYWHERE = "0.0.0.0", "::"

Say = Callable[[str], object]


@dataclass(frozen=True, kw_only=True)
class RobotOptions(PageOptions):
    """Options of a single robot: its profile, its port, and its DVA.

    Attributes:
        profile: Name or path.
        number: Number of the robot, from 1: its id and its label follow from that.
        dva: Address for registering at once, `HOST:PORT`; None: from its page.
        listen: Port of its requests; its publications have the next one. 0: any two that are free.
        keys: Folder with the keys of the devices; None to run without.
        seed: Random seed.
        changes: Changes of the scenario that it stands in, `KEY=VALUE`.
    """

    profile: str = "servrobot"
    number: int = 1
    dva: str | None = None
    listen: int = 0
    keys: Path | None = None
    seed: int = 1
    changes: tuple[str, ...] = ()

    def read(self) -> Scenario:
        """Return the robot's world: a site in which nothing else happens.

        Raises:
            ConfigError: there is no such profile or site, or the address of the DVA is none.
        """
        if self.dva is not None:
            check_address(self.dva, "--dva ")
        return lone_robot({"robot": {"profile": self.profile, "count": self.number}}, self.changes)


class RobotSimulator:
    """One robot with its windows.

    Args:
        options: Robot and addresses.
        say: Prints a line.
    """

    def __init__(self, options: RobotOptions, say: Say) -> None:
        self._options, self._say = options, say
        self._processes = ConsoleProcesses(options, say)

    def run(self) -> None:
        """Run until Ctrl-C, SIGTERM, or the end of the web process.

        Raises:
            ConfigError: there is no such robot, or no key of it.
            ChildFailed: the web process could not begin, or has ended by itself.
            NetworkError: the host is not this machine.
            RulesBroken: a safety rule was broken.
        """
        options = self._options
        scenario = options.read()
        ring = None if options.keys is None else KeyRing(options.keys)
        host = own_address(options.host) if options.host in EVERYWHERE else options.host
        world = RobotWorld(
            *(scenario, options.number, options.seed), ring=ring, host=host, port=options.listen
        )
        try:
            self._run(world)
        finally:
            self._processes.end()
            world.close()
        found = verdicts(world.recorder, dict.fromkeys(OF_THE_DVA, EVENTS_UNKNOWN))
        for verdict in found:
            self._say(str(verdict))
        if self._processes.failed:
            raise ChildFailed(self._processes.failed)
        refuse_unheld(found)

    def _run(self, world: RobotWorld) -> None:
        about = {"robot": world.robot.device.label}
        with (
            auditing(None, world.clock, about, self._say) as audit,
            ending_when_asked(world.clock, supervised=False) as ending,
        ):
            world.keep_audit(audit)
            self._processes.start(world, LoneRobotActions(world).take, audit=audit.path)
            self._say(f"Robot: {world.robot.device.address}")
            if self._options.dva is not None:
                self._begin(world, self._options.dva)
            if not ending.is_asked:
                world.clock.go()
                world.clock.run()
            world.station.switch_off()
            world.clock.run(world.clock.now + LAST_WORDS)
            world.tell({"k": "bye", "t": world.feed.now_ms, "why": "the robot was ended"})

    def _begin(self, world: RobotWorld, dva: str) -> None:
        """Register, then open the port; a failure is reported and can be retried."""

        def registered(ok: bool, text: str) -> None:
            self._say(text)
            if not ok:
                return
            try:
                world.station.listen()
            except Refused as refused:
                self._say(str(refused))
            else:
                self._say(f"listening on {world.robot.device.address}")

        world.station.register(dva, registered)
