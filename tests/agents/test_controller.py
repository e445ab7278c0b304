"""Commands that a robot obeys, and commands that it refuses."""

import pytest
from helpers.dva.permissions import confirmation, hear
from helpers.paths import ROOT

from dva_sim.agents.robot.controller import (
    LEASE_S,
    STANDSTILL,
    Decision,
    Limits,
    Mode,
    RobotController,
)
from dva_sim.protocol import messages as m

SPECIFICATION = ROOT / "protocol" / "README.md"
DVA, ROBOT, ANA, RUI = (f"02:00:00:00:00:0{i}" for i in range(1, 5))


class Bench:
    """A controller, and messages that arrive when they are decided on.

    Attributes:
        confirms: True if messages in the DVA's name are the DVA's, which confirms them on request.
    """

    def __init__(self) -> None:
        self.robot = RobotController(ROBOT, DVA, Limits(watchdog=3.0, max_age=6.0))
        self.number = 0
        self.confirms = True

    def say(
        self,
        source: str,
        body: m.Body,
        now: float = 0.0,
        session: int = 7,
        arrived: float | None = None,
        number: int | None = None,
        moving: bool = False,
    ) -> Decision:
        self.number += 1
        number = self.number if number is None else number
        message = m.Message(ROBOT, number, source, "12:00:00", session, body)
        decision = self.robot.handle(message, now if arrived is None else arrived, now, moving)
        if source == DVA and isinstance(body, m.PermissionGrant) and self.confirms:
            return self.confirm(body, now) or decision
        return decision

    def release(self, now: float) -> None:
        """Let the DVA tell the robot that Rui has released it from its newest emergency."""
        answer = m.EmergencyRelease(self.robot.latch.tick, "person", m.ByWhom(RUI, "Rui", 0.0))
        hear(self.robot, m.Reply(1, m.OK, "", answer), now)

    def confirm(self, grant: m.PermissionGrant, now: float) -> Decision | None:
        """The DVA is asked, and says that it has given that permission; None: it is not asked."""
        if grant.level == "sensors":
            self.robot.inquiry.about_reader(grant.holder)
        asked = self.robot.inquiry.next(now)
        return None if asked is None else hear(self.robot, confirmation(grant), now)


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def driven(bench: Bench) -> Bench:
    """Ana holds session 7 and has started at time 0."""
    bench.say(DVA, m.PermissionGrant(ANA, "teleoperation", 7))
    assert bench.say(ANA, m.StartTeleOp()).code == m.OK
    return bench


def test_only_the_dva_grants(bench):
    assert bench.say(RUI, m.PermissionGrant(RUI, "both", 9)).code == m.NOT_PERMITTED
    assert bench.robot.grant is None


@pytest.mark.invariant("S1")
def test_a_command_is_in_force_until_the_watchdog_counted_from_its_arrival(driven):
    decision = driven.say(ANA, m.SetTeleOp(0.4, 0.1), now=2.0, arrived=1.5)
    assert decision.set_point is not None
    assert decision.set_point.until == 4.5


@pytest.mark.invariant("S1")
def test_the_seen_tick_bounds_the_age_without_a_shared_clock(driven):
    driven.robot.clock_offset = 5000.0
    seen = driven.robot.tick(1.0)
    decision = driven.say(ANA, m.SetTeleOp(0.4, 0.1, seen), now=6.5)
    assert decision.set_point is not None
    assert decision.set_point.until == pytest.approx(7.0)
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.1, seen), now=7.1).code == m.STALE


def test_a_command_without_a_tick_is_counted(driven):
    driven.say(ANA, m.SetTeleOp(0.4, 0.1), now=1.0)
    assert driven.robot.without_tick == 1


def test_a_command_that_waited_longer_than_the_watchdog_is_stale(driven):
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.1), now=5.0, arrived=1.9).code == m.STALE


def test_an_older_command_never_follows_a_newer_one(driven):
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.0), number=50).code == m.OK
    assert driven.say(ANA, m.SetTeleOp(0.1, 0.0), number=49).code == m.OUT_OF_ORDER
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.0), number=50).code == m.OUT_OF_ORDER


DRIVES = m.SetTeleOp(0.4, 0.0)
MISSION = m.GoTo((m.Position(38.66, -9.2),))
REFUSALS = [
    ("a command of a device that never held it", RUI, 7, DRIVES, m.NOT_PERMITTED),
    (
        "a command of the last holder, whose session was revoked",
        *(ANA, 7, DRIVES, m.NOT_PERMITTED, m.PermissionRevocation(ROBOT, ANA, 7)),
    ),
    (
        "a command of the last holder, while somebody else holds it",
        *(ANA, 7, DRIVES, m.NOT_PERMITTED, m.PermissionGrant(RUI, "both", 8)),
    ),
    (
        "a command of its holder in an earlier session of that holder",
        *(ANA, 7, DRIVES, m.BAD_SESSION, m.PermissionGrant(ANA, "both", 8)),
    ),
    (
        "a command of its holder in a session that nobody was granted, or in 0",
        *(ANA, 0, DRIVES, m.BAD_SESSION),
    ),
    (
        "a mission of a holder who may only drive, in its session",
        *(ANA, 7, MISSION, m.NOT_PERMITTED),
    ),
    (
        "`DevSub` to a sensor that is not in the permission of its sender, in any session",
        *(ANA, 6, m.DevSub("smoke", 1.0), m.NOT_PERMITTED),
    ),
    (
        "`DevSub` to a sensor that is, in another session",
        *(RUI, 6, m.DevSub("smoke", 1.0), m.BAD_SESSION),
        m.PermissionGrant(RUI, "sensors", 9, None, ("smoke",)),
    ),
    (
        "a grant or revocation of anybody but the DVA",
        *(RUI, 0, m.PermissionRevocation(ROBOT, ANA, 7), m.NOT_PERMITTED),
    ),
]


@pytest.mark.invariant("S2")
@pytest.mark.parametrize("row", REFUSALS, ids=lambda row: row[0])
def test_which_refusal_is_as_the_specification_says(driven, row):
    text, who, session, body, code, *before = row
    driven.robot.sensors = (m.Sensor("smoke", "1/m"),)
    for grant in before:
        assert driven.say(DVA, grant).code == m.OK
    assert driven.say(who, body, session=session).code == code
    name = "NOT_PERMITTED" if code == m.NOT_PERMITTED else "BAD_SESSION"
    assert f"| {text} | `{name}` |" in SPECIFICATION.read_text()


def test_no_row_on_refusals_goes_untested():
    _, _, rows = SPECIFICATION.read_text().partition("| what comes to a robot | answer |\n")
    assert rows.partition("\n\n")[0].count("\n") == len(REFUSALS)


@pytest.mark.invariant("S2")
def test_a_new_grant_stops_the_robot_and_fences_the_old_holder(driven):
    assert driven.say(DVA, m.PermissionGrant(RUI, "teleoperation", 8)).set_point == STANDSTILL
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.0)).code == m.NOT_PERMITTED
    assert driven.say(RUI, m.StartTeleOp(), session=8, moving=True).code == m.BUSY
    assert driven.say(RUI, m.StartTeleOp(), session=8).code == m.OK


@pytest.mark.parametrize("session", [5, 8])
def test_a_grant_that_the_dva_does_not_confirm_changes_nothing(driven, session):
    """An old one that comes late, a replayed or a forged one."""
    driven.confirms = False
    assert driven.say(DVA, m.PermissionGrant(RUI, "both", session)).code == m.OK
    assert driven.robot.inquiry.next(0.0) == m.GetGrant()
    hear(driven.robot, confirmation(m.PermissionGrant(ANA, "teleoperation", 7)))
    assert driven.robot.owner == ANA
    assert driven.say(RUI, m.StartTeleOp(), session=session).code == m.NOT_PERMITTED
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.0)).code == m.OK


@pytest.mark.invariant("S1")
def test_a_robot_whose_computer_hung_is_stopped_by_its_driver(driven):
    """Its motors may still have the last command, until the watchdog ends that."""
    driven.robot.hang()
    assert driven.say(ANA, m.StopTeleOp()).set_point == STANDSTILL


@pytest.mark.invariant("S3")
def test_a_command_queued_before_an_emergency_does_not_move_a_drive_started_after_it(driven):
    """A start that is overtaken by the commands behind it makes their numbers no older."""
    driven.say(ANA, m.Emergency(), now=2.0)
    driven.release(2.1)
    assert driven.say(ANA, m.StartTeleOp(), now=2.2, number=10).code == m.OK
    late = driven.say(ANA, m.SetTeleOp(0.4, 0.0), now=2.3, arrived=1.9, number=11)
    assert late.code == m.STALE
    assert late.set_point is None
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.0), now=2.4, number=12).code == m.OK


@pytest.mark.invariant("S3")
@pytest.mark.parametrize("source", [ANA, RUI, DVA])
def test_an_emergency_stops_whoever_sends_it_and_nothing_earlier_moves_it(driven, source):
    driven.say(ANA, m.SetTeleOp(0.5, 0.0), now=1.0)
    stop = driven.say(source, m.Emergency(), now=2.0, session=0)
    assert (stop.code, stop.set_point) == (m.OK, STANDSTILL)
    assert driven.say(ANA, m.SetTeleOp(0.5, 0.0), now=2.1).code == m.WRONG_MODE
    driven.release(2.15)
    assert driven.say(ANA, m.StartTeleOp(), now=2.2, arrived=1.9).code == m.STALE
    assert driven.say(ANA, m.StartTeleOp(), now=2.4, arrived=2.3).code == m.OK


def test_teleoperation_ends_by_itself_when_the_operator_is_gone(driven):
    driven.say(ANA, m.SetTeleOp(0.5, 0.0), now=1.0)
    assert not driven.robot.expire(1.0 + LEASE_S)
    assert driven.robot.expire(1.1 + LEASE_S)
    assert driven.robot.mode is Mode.IDLE


@pytest.mark.parametrize(
    "refused",
    [
        lambda b: b.say(ANA, m.SetTeleOp(0.5, 0.0), session=6),
        lambda b: b.say(RUI, m.StartTeleOp()),
        lambda b: b.say(RUI, m.StopTeleOp()),
        lambda b: b.say(ANA, m.GetDeviceList()),
    ],
)
def test_a_refused_message_changes_nothing(driven, refused):
    before = {name: known for name, known in vars(driven.robot).items() if name != "inquiry"}
    decision = refused(driven)
    assert decision.code != m.OK
    assert decision.text
    assert vars(driven.robot).items() >= before.items()


def test_a_revocation_stops_the_robot_and_its_session_comes_back_only_by_the_dva(driven):
    over = m.PermissionRevocation(ROBOT, ANA, 7)
    assert driven.say(ANA, over).code == m.NOT_PERMITTED
    assert driven.robot.owner == ANA
    assert driven.say(DVA, over).set_point == STANDSTILL
    assert driven.robot.mode is Mode.IDLE
    assert driven.say(ANA, m.StartTeleOp()).code == m.NOT_PERMITTED
    driven.confirms = False
    assert driven.say(DVA, m.PermissionGrant(ANA, "teleoperation", 7)).code == m.OK
    assert driven.robot.inquiry.next(0.0) == m.GetGrant()
    hear(driven.robot, confirmation(None))
    assert driven.say(ANA, m.StartTeleOp()).code == m.NOT_PERMITTED
    assert driven.say(DVA, over).code == m.OK  # once more: it is over all the same


def test_a_revocation_of_an_older_session_changes_nothing(driven):
    assert driven.say(DVA, m.PermissionRevocation(ROBOT, ANA, 6)).set_point is None
    assert driven.robot.owner == ANA


def test_a_copy_of_an_old_order_that_comes_late_does_nothing(driven):
    """Its reply may have been forgotten by then, so the number has to tell."""
    driven.say(ANA, m.StopTeleOp(), number=50)
    driven.say(ANA, m.StartTeleOp(), number=60)
    assert driven.say(ANA, m.StopTeleOp(), number=50).code == m.OUT_OF_ORDER
    assert driven.robot.mode is Mode.TELEOPERATION
    driven.say(ANA, m.StopTeleOp(), number=70)
    assert driven.say(ANA, m.StartTeleOp(), number=60).code == m.OUT_OF_ORDER
    assert driven.robot.mode is Mode.IDLE


@pytest.fixture
def sensing(driven: Bench) -> Bench:
    """Ana drives and may read the heat; Rui may read the smoke and nothing else."""
    driven.robot.sensors = (m.Sensor("heat_flux", "kW/m2"), m.Sensor("smoke", "1/m"))
    driven.say(DVA, m.PermissionGrant(ANA, "teleoperation", 8, None, ("heat_flux",)))
    driven.say(ANA, m.StartTeleOp(), session=8)
    assert driven.say(DVA, m.PermissionGrant(RUI, "sensors", 9, None, ("smoke",))).code == m.OK
    return driven


@pytest.mark.invariant("S5")
@pytest.mark.parametrize(
    ("who", "session", "sensor", "code"),
    [
        (ANA, 8, "heat_flux", m.OK),
        (RUI, 9, "smoke", m.OK),
        (ANA, 8, "smoke", m.NOT_PERMITTED),
        (RUI, 9, "heat_flux", m.NOT_PERMITTED),
        (DVA, 9, "smoke", m.NOT_PERMITTED),
        (ANA, 7, "heat_flux", m.BAD_SESSION),
        (RUI, 8, "smoke", m.BAD_SESSION),
        (ANA, 8, "radar", m.UNKNOWN_SENSOR),
    ],
)
def test_each_sensor_is_permitted_by_name(sensing, who, session, sensor, code):
    assert sensing.say(who, m.DevSub(sensor, 2.0), session=session).code == code


def test_who_may_read_sensors_takes_the_robot_from_nobody(sensing):
    assert sensing.robot.owner == ANA
    assert sensing.say(RUI, m.StartTeleOp(), session=9).code == m.NOT_PERMITTED
    sensing.say(DVA, m.PermissionRevocation(ROBOT, RUI, 9))
    assert sensing.say(RUI, m.DevSub("smoke", 1.0), session=9).code == m.NOT_PERMITTED
    assert sensing.robot.owner == ANA


def test_a_robot_tells_everybody_which_sensors_it_has(sensing):
    body = sensing.say("02:00:00:00:00:99", m.GetSensorInfo(), session=0).content
    assert body is not None
    assert [sensor.name for sensor in body.sensors] == ["heat_flux", "smoke"]


def test_a_robot_knows_nothing_of_the_sensors_of_others(sensing):
    assert sensing.say(ANA, m.GetSensorInfo(RUI)).code == m.UNKNOWN_DEVICE


@pytest.mark.invariant("S2")
def test_a_revocation_that_overtakes_what_the_dva_answered_holds(bench):
    """The answer left the DVA before the session ended, and comes by another connection."""
    bench.confirms = False
    grant = m.PermissionGrant(ANA, "both", 7)
    bench.say(DVA, grant)
    assert bench.robot.inquiry.next(0.0) == m.GetGrant()
    bench.say(DVA, m.PermissionRevocation(ROBOT, ANA, 7))
    assert hear(bench.robot, confirmation(grant)).waits
    assert bench.say(ANA, m.StartTeleOp()).code == m.NOT_PERMITTED
    assert bench.robot.inquiry.next(0.0) == m.GetGrant()  # it is asked once more
    hear(bench.robot, confirmation(None))
    assert bench.robot.grant is None


def test_a_session_told_again_renews_the_address_and_stops_nothing(driven):
    again = m.PermissionGrant(ANA, "teleoperation", 7, "192.168.1.77")
    assert driven.say(DVA, again).code == m.OK
    assert driven.robot.owner == ANA
    assert driven.robot.grant == again


def test_starting_again_makes_older_orders_and_commands_old(driven):
    assert driven.say(ANA, m.StartTeleOp(), number=60).set_point is None
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.0), number=59).code == m.OUT_OF_ORDER
    assert driven.say(ANA, m.StopTeleOp(), number=58).code == m.OUT_OF_ORDER
    assert driven.robot.mode is Mode.TELEOPERATION


HERE = m.Position(38.66, -9.2)
MESSAGES = {
    "StartTeleOp": m.StartTeleOp(),
    "SetTeleOp": m.SetTeleOp(0.3, 0.1),
    "StopTeleOp": m.StopTeleOp(),
    "GoTo": m.GoTo((HERE,)),
    "Patrol": m.Patrol((HERE, HERE), 0),
    "Inspect": m.Inspect(3, "fire", HERE),
    "ReturnToBase": m.ReturnToBase(),
    "CancelMission": m.CancelMission(),
    "GetMissionStatus": m.GetMissionStatus(),
    "GetSensorInfo": m.GetSensorInfo(),
    "Emergency": m.Emergency(),
}
BEGINS = ("GoTo", "Patrol", "Inspect", "ReturnToBase")
LETTERS = {"I": Mode.IDLE, "M": Mode.MISSION, "T": Mode.TELEOPERATION}
CODES = {
    "ok": m.OK,
    "perm": m.NOT_PERMITTED,
    "mode": m.WRONG_MODE,
    "busy": m.BUSY,
}
# Each cell: the reply, and the mode afterwards. Columns: what Ana may do; with none or sensors
# alone, Rui holds the robot with the level both and it is Rui's teleoperation or mission.
TABLE = """
mode message           none     sensors  teleoperation missions both
I    StartTeleOp       perm I   perm I   ok T          perm I   ok T
I    SetTeleOp         perm I   perm I   mode I        perm I   mode I
I    StopTeleOp        perm I   perm I   ok I          perm I   ok I
I    begins            perm I   perm I   perm I        ok M     ok M
I    CancelMission     perm I   perm I   perm I        ok I     ok I
I    GetMissionStatus  ok I     ok I     ok I          ok I     ok I
I    GetSensorInfo     ok I     ok I     ok I          ok I     ok I
I    Emergency         ok I     ok I     ok I          ok I     ok I
M    StartTeleOp       perm M   perm M   -             perm M   busy M
M    SetTeleOp         perm M   perm M   -             perm M   mode M
M    StopTeleOp        perm M   perm M   -             perm M   ok M
M    begins            perm M   perm M   -             busy M   busy M
M    CancelMission     perm M   perm M   -             ok I     ok I
M    GetMissionStatus  ok M     ok M     -             ok M     ok M
M    GetSensorInfo     ok M     ok M     -             ok M     ok M
M    Emergency         ok I     ok I     -             ok I     ok I
T    StartTeleOp       perm T   perm T   ok T          -        ok T
T    SetTeleOp         perm T   perm T   ok T          -        ok T
T    StopTeleOp        perm T   perm T   ok I          -        ok I
T    begins            perm T   perm T   perm T        -        busy T
T    CancelMission     perm T   perm T   perm T        -        ok T
T    GetMissionStatus  ok T     ok T     ok T          -        ok T
T    GetSensorInfo     ok T     ok T     ok T          -        ok T
T    Emergency         ok I     ok I     ok I          -        ok I
"""


def cells() -> list[tuple[str, str, str, str, str]]:
    """Mode, message, level, reply, mode afterwards; states that cannot occur are left out."""
    heading, *rows = TABLE.strip().splitlines()
    levels = heading.split()[2:]
    found = []
    for row in rows:
        mode, what, *rest = row.split()
        for level in levels:
            code = rest.pop(0)
            if code == "-":
                continue
            after = rest.pop(0)
            names = BEGINS if what == "begins" else (what,)
            found += [(mode, name, level, code, after) for name in names]
    return found


def in_mode(mode: Mode, level: str) -> Bench:
    """Ana has that permission, and the robot is in that mode for who holds it."""
    bench = Bench()
    holder, held = (RUI, "both") if level in ("none", "sensors") else (ANA, level)
    bench.say(DVA, m.PermissionGrant(holder, held, 7))
    if level == "sensors":
        bench.say(DVA, m.PermissionGrant(ANA, "sensors", 7, None, ("smoke",)))
    if mode is not Mode.IDLE:
        begin = m.StartTeleOp() if mode is Mode.TELEOPERATION else m.GoTo((HERE,))
        assert bench.say(holder, begin).code == m.OK
    assert bench.robot.mode is mode
    return bench


@pytest.mark.invariant("S5")
@pytest.mark.parametrize(("mode", "what", "level", "code", "after"), cells())
def test_every_mode_answers_every_message_by_the_permission_held(mode, what, level, code, after):
    bench = in_mode(LETTERS[mode], level)
    decision = bench.say(ANA, MESSAGES[what], now=1.0)
    assert decision.code == CODES[code]
    assert bench.robot.mode is LETTERS[after]
    if LETTERS[mode] is not Mode.IDLE and after == "I":
        assert decision.set_point == STANDSTILL  # what ends a motion says so to the motors
    if decision.code != m.OK:
        assert decision.set_point is None
    assert (bench.robot.owner is None) == (after == "I")


def test_the_table_has_every_mode_and_message():
    assert {(mode, what) for mode, what, *_ in cells()} == {
        (mode, what) for mode in LETTERS for what in MESSAGES
    }


@pytest.mark.invariant("S2")
@pytest.mark.parametrize("name", BEGINS)
def test_a_mission_begins_only_at_a_standstill(bench, name):
    bench.say(DVA, m.PermissionGrant(ANA, "missions", 7))
    assert bench.say(ANA, MESSAGES[name], moving=True).code == m.BUSY
    assert bench.say(ANA, MESSAGES[name], moving=False).code == m.OK


@pytest.mark.parametrize("name", BEGINS)
def test_a_mission_that_was_sent_before_an_emergency_does_not_begin_after_it(bench, name):
    bench.say(DVA, m.PermissionGrant(ANA, "missions", 7))
    bench.say(RUI, m.Emergency(), now=2.0)
    assert bench.say(ANA, MESSAGES[name], now=2.1, arrived=1.9).code == m.STALE
    bench.release(2.15)
    assert bench.say(ANA, MESSAGES[name], now=2.2, arrived=1.9).code == m.STALE
    assert bench.say(ANA, MESSAGES[name], now=2.3, arrived=2.2).code == m.OK


def mission_state(bench: Bench) -> tuple[str, int, str]:
    status = bench.say(RUI, m.GetMissionStatus(), session=0).content
    assert isinstance(status, m.MissionStatus)
    return status.mission_state, status.waypoints_left, status.reason


def test_how_a_mission_stands_is_told_to_everybody_who_asks(bench):
    assert mission_state(bench) == ("none", 0, "")
    bench.say(DVA, m.PermissionGrant(ANA, "missions", 7))
    bench.say(ANA, m.Patrol((HERE, HERE, HERE), 2), number=41)
    assert mission_state(bench) == ("under_way", 3, "")
    assert bench.robot.mission_status.mission_id == 41
    assert bench.robot.mission_changed("waiting", 2, "jammed")
    assert not bench.robot.mission_changed("waiting", 2, "jammed")
    assert mission_state(bench) == ("waiting", 2, "jammed")
    assert bench.robot.mission_changed("failed", 2, "no way")
    assert mission_state(bench) == ("failed", 2, "no way")
    assert bench.robot.mode is Mode.IDLE


@pytest.mark.parametrize(
    ("source", "body", "reason"),
    [
        (ANA, m.CancelMission(), "cancelled"),
        (RUI, m.Emergency(), "emergency"),
        (DVA, m.PermissionRevocation(ROBOT, ANA, 7), "revoked"),
        (DVA, m.PermissionGrant(RUI, "both", 8), "revoked"),
    ],
)
def test_a_mission_that_somebody_ends_has_failed_and_says_why(bench, source, body, reason):
    bench.say(DVA, m.PermissionGrant(ANA, "missions", 7))
    bench.say(ANA, m.GoTo((HERE,)))
    assert bench.say(source, body, now=1.0).set_point == STANDSTILL
    assert mission_state(bench) == ("failed", 1, reason)


def test_what_a_robot_says_of_a_mission_that_is_over_is_no_news(bench):
    bench.say(DVA, m.PermissionGrant(ANA, "missions", 7))
    bench.say(ANA, m.GoTo((HERE,)))
    bench.say(ANA, m.CancelMission())
    assert not bench.robot.mission_changed("done", 0, "")
    assert mission_state(bench) == ("failed", 1, "cancelled")


# --- what is forged, or cannot be ------------------------------------------------------

LAST = 2**64 - 1
DAY = 345_600 << 32


def test_a_tick_that_the_robots_clock_has_not_reached_is_refused_and_counted(driven):
    now = driven.robot.tick(1.0)
    for tick in (2**53 - 1, now + 1):
        assert driven.say(ANA, m.SetTeleOp(0.4, 0.1, tick), now=1.0).code == m.STALE
    assert driven.robot.future_ticks == 2
    assert driven.say(ANA, m.SetTeleOp(0.4, 0.1, now), now=1.0).code == m.OK


def test_a_day_of_sessions_is_no_jump(driven):
    assert driven.say(DVA, m.PermissionGrant(RUI, "both", DAY)).set_point == STANDSTILL
    assert driven.say(RUI, m.StartTeleOp(), session=DAY).code == m.OK


@pytest.mark.invariant("S2")
@pytest.mark.parametrize("session", [1, LAST, 7 + DAY + (1 << 32)])
def test_no_forged_session_leaves_a_floor_behind(driven, session):
    """Whatever was claimed, the next grant that the DVA confirms holds."""
    driven.confirms = False
    driven.say(DVA, m.PermissionGrant(RUI, "both", session))
    driven.say(DVA, m.PermissionRevocation(ROBOT, "", session))
    assert driven.robot.inquiry.next(0.0) == m.GetGrant()
    hear(driven.robot, confirmation(m.PermissionGrant(ANA, "teleoperation", 7)))
    assert driven.robot.owner == ANA
    driven.confirms = True
    assert driven.say(DVA, m.PermissionGrant(RUI, "both", 8)).set_point == STANDSTILL
    assert driven.say(RUI, m.StartTeleOp(), session=8).code == m.OK


@pytest.mark.invariant("S2", "S5")
def test_what_the_dva_answers_about_a_stranger_holds(bench):
    """Its order has overtaken the grant, or the robot has forgotten it."""
    assert bench.say(ANA, m.StartTeleOp()).waits
    assert bench.robot.inquiry.next(0.0) == m.GetGrant()
    hear(bench.robot, confirmation(m.PermissionGrant(ANA, "teleoperation", 7)))
    assert bench.say(ANA, m.StartTeleOp()).code == m.OK


@pytest.mark.invariant("S2", "S5")
def test_an_idle_robot_that_hears_a_forged_grant_stands(bench):
    bench.confirms = False
    bench.say(DVA, m.PermissionGrant(RUI, "both", 1 << 33))
    for reply in (None, confirmation(None)):
        if reply is not None:
            hear(bench.robot, reply)
        assert bench.say(RUI, m.StartTeleOp(), session=1 << 33).code == m.NOT_PERMITTED
        assert bench.say(RUI, m.SetTeleOp(0.5, 0.0), session=1 << 33).code == m.NOT_PERMITTED


@pytest.mark.invariant("S2")
def test_that_nobody_holds_it_ends_no_drive(driven):
    """A DVA that has lost its memory says so; its next grant ends the drive."""
    driven.confirms = False
    driven.say(DVA, m.PermissionGrant(RUI, "both", 8))
    driven.robot.inquiry.next(0.0)
    assert hear(driven.robot, confirmation(None)).set_point is None
    assert driven.robot.owner == ANA


@pytest.mark.invariant("S2")
def test_a_forged_revocation_stops_the_driver_who_keeps_the_robot(driven):
    driven.say(ANA, m.StartTeleOp(), number=60)
    assert driven.say(DVA, m.PermissionRevocation(ROBOT, ANA, 7)).set_point == STANDSTILL
    assert driven.robot.inquiry.next(0.0) == m.GetGrant()
    assert driven.robot.take_by_hand("somebody", 0.1, moving=False).code == m.BUSY
    hear(driven.robot, confirmation(m.PermissionGrant(ANA, "teleoperation", 7)))
    # What somebody has recorded before moves nothing.
    assert driven.say(ANA, m.StartTeleOp(), number=60).code == m.OUT_OF_ORDER
    assert driven.say(ANA, m.StartTeleOp(), number=61).code == m.OK


@pytest.mark.invariant("S2")
def test_a_changed_address_of_the_holder_counts_when_the_dva_has_confirmed_it(driven):
    driven.confirms = False
    driven.say(DVA, m.PermissionGrant(ANA, "teleoperation", 7, "192.168.1.66"))
    assert driven.robot.inquiry.next(0.0) == m.GetGrant()
    assert driven.robot.grant is not None
    assert driven.robot.grant.address is None


@pytest.mark.invariant("S5")
def test_who_may_read_is_asked_when_it_subscribes(bench):
    bench.robot.sensors = (m.Sensor("smoke", "1/m"),)
    bench.confirms = False
    grant = m.PermissionGrant(RUI, "sensors", 9, None, ("smoke",))
    assert bench.say(DVA, grant).code == m.OK
    assert bench.robot.inquiry.next(0.0) is None
    assert bench.say(RUI, m.DevSub("smoke", 1.0), session=9).waits
    assert bench.robot.inquiry.next(0.0) == m.GetGrant(RUI, "sensors")
    hear(bench.robot, confirmation(grant))
    assert bench.say(RUI, m.DevSub("smoke", 1.0), session=9).code == m.OK
    newer = bench.say(RUI, m.DevSub("smoke", 1.0), session=10)
    assert (newer.code, newer.waits) == (m.BAD_SESSION, True)  # the DVA may have given a new one
    assert bench.robot.inquiry.next(10.0) == m.GetGrant(RUI, "sensors")
    hear(bench.robot, confirmation(None))
    assert bench.say(RUI, m.DevSub("smoke", 1.0), session=9).code == m.NOT_PERMITTED
    assert bench.robot.inquiry.next(20.0) == m.GetGrant(RUI, "sensors")
    hear(bench.robot, confirmation(grant))
    bench.say(DVA, m.PermissionRevocation(ROBOT, RUI, 9))
    assert bench.say(RUI, m.DevSub("smoke", 1.0), session=9).code == m.NOT_PERMITTED
