"""The control room: the DVA, and the operators with their phones."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.agents.operator.agent import OperatorAgent
from dva_sim.agents.operator.drive import DriverSeat, OperatorSetup
from dva_sim.agents.operator.person import draw_person
from dva_sim.agents.operator.strategies import STRATEGIES, Oracle, Reach, Truth
from dva_sim.agents.tilt import Phone
from dva_sim.core.dispatch import POLICIES
from dva_sim.core.permissions import LOW_BITS, Permissions
from dva_sim.core.service import Desk, Pace
from dva_sim.core.sessions import Sessions
from dva_sim.errors import ConfigError
from dva_sim.protocol import messages as m
from dva_sim.scenario import guard_profile, phone_profile, population, robot_profile
from dva_sim.simulation.dva import DvaAgent
from dva_sim.simulation.stage import Stage

ROBOT_PACE = 0.35  # what the DVA expects of a teleoperated robot [m/s]
ROBOT_READY = 4.0  # and of its operator [s]


def add_dva(stage: Stage, permissions: Permissions | None = None) -> DvaAgent:
    """The DVA; sessions are drawn by the run's seed where no other `permissions` are given."""
    dispatch, guards = stage.scenario.dispatch, guard_profile(stage.scenario)
    draw = stage.streams["dva/sessions"]
    desk = Desk(
        policy=POLICIES[dispatch.policy](),
        distance=lambda start, goal: _distance(stage, start, goal),
        paces={
            "guard": Pace(guards.walking_mean_mps, guards.mobilisation_s.median),
            "robot": Pace(ROBOT_PACE, ROBOT_READY),
        },
        escalate_after=dispatch.escalate_after_s,
        rng=stage.streams["dva/policy"],
        sessions=Sessions(permissions or Permissions(lambda: int(draw.integers(2**LOW_BITS)))),
    )
    return DvaAgent(stage.device("dva", 1), desk)


def _distance(stage: Stage, start: m.Position, goal: m.Position) -> float:
    frame = stage.site.frame
    a = frame.to_xy(start.latitude, start.longitude)
    return stage.planner.distance(a, frame.to_xy(goal.latitude, goal.longitude))


def add_operator(
    stage: Stage, number: int, truth: Callable[[str], Truth] | None = None
) -> OperatorAgent:
    """The `number`-th operator.

    Args:
        stage: Where.
        number: From 1.
        truth: The true state of a robot by id, where somebody can tell.

    Raises:
        ConfigError: the strategy needs the truth, and nobody can tell.
    """
    scenario, config = stage.scenario, stage.scenario.operator
    device = stage.device("operator", number)
    person = draw_person(population(scenario), config.population_seed, config.person + number - 1)
    robot = robot_profile(scenario)
    reach = Reach(robot.max_speed_mps, robot.max_turn_rate_rad_s)
    strategy = STRATEGIES[config.strategy](person, reach)
    needs_truth = isinstance(strategy, Oracle)
    if needs_truth and truth is None:
        raise ConfigError("operator.strategy 'oracle' knows the truth: only in virtual time")
    command = scenario.command
    setup = OperatorSetup(
        scenario.window,
        command.rate_hz,
        command.timeout_s,
        command.attempts,
        truth=truth if needs_truth else None,
    )
    seat = DriverSeat(
        device,
        person,
        Phone(phone_profile(scenario), person.hand_lag, stage.streams[f"{device.label}/phone"]),
        strategy,
        stage.planner,
        setup,
        stage.streams[f"{device.label}/judgement"],
    )
    operator = OperatorAgent(seat)
    device.register()
    return operator
