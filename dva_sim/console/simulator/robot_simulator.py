"""One simulated robot as a program of its own: what it is asked for, its start and its end."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.console.asking.dispatcher import ActionDispatcher, does
from dva_sim.console.asking.refusal import OnResult, Refused
from dva_sim.console.audit.audit_keeper import auditing
from dva_sim.console.pages.addresses import own_address
from dva_sim.console.pages.processes import ConsoleProcesses
from dva_sim.console.robots.robot_actions import RobotActions
from dva_sim.console.simulator.robot_world import RobotWorld
from dva_sim.console.wire.actions import ActionPlace, Asked
from dva_sim.console.wire.arguments import (
    LogsLooked,
    Nothing,
    OfRobot,
    OfSome,
    RegistrationAsked,
    RobotsWatched,
)
from dva_sim.console.wire.seats import DoneLine
from dva_sim.live.process import ending_when_asked
from dva_sim.live.ros_robot import OTHER_NUMBER
from dva_sim.network.addresses import check_address
from dva_sim.network.keys import KeyRing
from dva_sim.options.runs import RobotOptions
from dva_sim.protocol import messages as m
from dva_sim.serving.processes import ChildFailed
from dva_sim.simulation.full.verdicts import (
    EVENTS_UNKNOWN,
    OF_THE_DVA,
    refuse_unheld,
    verdicts,
)
from dva_sim.simulation.scenario import Scenario
from dva_sim.simulation.scenario.lone_robot import lone_robot

LOOK = 0.05  # from one look at who has fallen silent to the next, real time [s]


class LoneRobotActions:
    """Does what lines of the web process ask for.

    Args:
        world: The robot.

    Attributes:
        take: Does what a line asks for.
    """

    def __init__(self, world: RobotWorld) -> None:
        self._world = world
        self._hands = RobotActions(
            world.windows,
            lambda _: world.robot.device.id_tag,
            why_not=lambda: "held: this machine cannot keep up" if world.lag.held else "",
            labels=world.stage.labels,
            deaf=world.deafen,
            slow=world.slowed,
        )
        self.take = ActionDispatcher(
            ActionPlace.ROBOT,
            holders=(self, self._hands),
            tell=self._tell,
            elsewhere="a robot that runs alone does not know {what!r}",
            audited=lambda: world.audited,
        ).take
        world.hold = lambda _: self._hands.stop(world.field.robots)
        world.clock.pulse(LOOK, self._hands.look_for_the_silent)

    def _tell(self, answer: DoneLine) -> None:
        self._world.tell({**answer, "t": self._world.feed.now_ms})
        self._world.tell_now()

    @does("emergency")
    def _emergency(self, _: str, line: OfSome, on_result: OnResult) -> None:
        self._hands.stop(self._world.field.robots)
        self._hands.press_emergency(self._world.robot.device.id_tag)
        on_result(True, f"{self._world.robot.device.label} has stopped")

    @does("robot_release")
    def _release_emergency(self, client: str, line: OfRobot, on_result: OnResult) -> None:
        robot = self._world.robot
        decision = self._hands.release_emergency(robot.device.id_tag, client)
        on_result(decision.code == m.OK, decision.text)

    @does("robot_register")
    def _register(self, _: str, line: RegistrationAsked, on_result: OnResult) -> None:
        dva = line["dva"].strip()
        check_address(dva)
        self._world.station.register(dva, on_result)

    @does("robot_listen")
    def _listen(self, _: str, line: OfRobot, on_result: OnResult) -> None:
        self._world.station.listen()
        on_result(True, f"listens on {self._world.robot.device.address}")

    @does("robot_off")
    def _off(self, _: str, line: OfRobot, on_result: OnResult) -> None:
        self._world.station.switch_off()
        on_result(True, "it is off")

    @does("release")
    def _release(self, _: str, line: Nothing, on_result: OnResult) -> None:
        """Release what `manual_take` has in hand, and nothing else."""
        on_result(True, "released")

    @does("gone")
    def _gone(self, client: str, _: Asked) -> None:
        self._hands.gone(client)

    @does("watch")
    def _watch(self, _: str, line: RobotsWatched) -> None:
        own = {self._world.robot.device.id_tag}
        self._world.screens.watch(own if line["robots"] else set())

    @does("look")
    def _look(self, _: str, line: LogsLooked) -> None:
        self._world.logs.look(line["logs"])


LAST_WORDS = 0.2  # for what was said last [s]
EVERYWHERE = "0.0.0.0", "::"

Say = Callable[[str], object]


def scenario_of(options: RobotOptions) -> Scenario:
    """Return the robot's world: a site in which nothing else happens.

    Raises:
        ConfigError: there is no such profile or site, or the address of the DVA is none.
    """
    if options.dva is not None:
        check_address(options.dva, "--dva ")
    robot = {"profile": options.profile or "servrobot", "count": options.number}
    return lone_robot({"robot": robot}, options.set)


class RobotSimulator:
    """One robot with its windows.

    Args:
        options: Robot and addresses.
        say: Prints a line.
    """

    def __init__(self, options: RobotOptions, say: Say) -> None:
        self._options = options
        self._say = say
        self._processes = ConsoleProcesses(options, say)

    def run(self) -> None:
        """Run until Ctrl-C, SIGTERM, SIGHUP, or the end of the web process.

        Raises:
            ConfigError: there is no such robot, or no key of it.
            ChildFailed: the web process could not begin, or has ended by itself.
            NetworkError: the host is not this machine.
            RulesBroken: a safety rule was broken.
        """
        options = self._options
        scenario = scenario_of(options)
        ring = None if options.keys is None else KeyRing(options.keys)
        host = own_address(options.host) if options.host in EVERYWHERE else options.host
        world = RobotWorld(
            scenario,
            number=options.number,
            seed=options.seed,
            ring=ring,
            host=host,
            port=options.listen,
        )
        world.robot.device.other_id = OTHER_NUMBER
        try:
            self._run(world)
        finally:
            self._processes.end()
            world.close()
        judged = verdicts(world.recorder, dict.fromkeys(OF_THE_DVA, EVENTS_UNKNOWN))
        for verdict in judged:
            self._say(str(verdict))
        if self._processes.failed:
            raise ChildFailed(self._processes.failed)
        refuse_unheld(judged)

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
