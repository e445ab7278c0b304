"""Being told no: by whatever pattern commands travel, the app finds out, and says so."""

import pytest
from helpers.dva.scripted_dva import OPERATOR, OTHER_ROBOT, ROBOT, PretendedDva, driving
from helpers.wording import counted

from dva_sim.agents.operator.refusals import (
    LATE_FOR,
    PASSES,
    REFUSALS_IN_A_ROW,
    SAYS_LATE_FOR,
    Refusals,
)
from dva_sim.agents.robot.controller import LEASE_S, Mode
from dva_sim.kernel.recorder import DriveLog
from dva_sim.protocol import messages as m
from dva_sim.simulation.full.stage import id_of

EXAMPLE = "acknowledged_pub_sub.py:AcknowledgedPubSub"
PATTERNS = ("req-rep", "latest-wins", EXAMPLE)
ME, OTHER = id_of("operator", 1), id_of("operator", 2)

# --- the decider -------------------------------------------------------------------------


@pytest.fixture
def refusals() -> Refusals:
    return Refusals(ME)


@pytest.mark.parametrize("code", m.OBEYS_NO_MORE)
def test_a_refusal_that_will_last_ends_it_at_once(refusals, code):
    assert refusals.answered(m.OK, 0.0) == ""
    assert refusals.answered(code, 0.1).endswith(f": {m.CODE_NAMES[code]}")
    assert (refusals.last, refusals.codes) == (code, {code: 1})


def test_commands_that_come_late_are_counted_and_no_more(refusals):
    for now in range(100):
        assert not refusals.answered(m.STALE, float(now))
        assert not refusals.answered(m.OUT_OF_ORDER, now + 0.5)
        assert now % 9 or not refusals.answered(m.OK, now + 0.6)  # now and then one is in time
    assert refusals.codes == {m.STALE: 100, m.OUT_OF_ORDER: 100}


@pytest.mark.parametrize("code", PASSES)
def test_commands_of_which_all_come_late_end_it_after_the_stated_time(refusals, code):
    refusals.answered(m.OK, 0.0)
    reports = [refusals.answered(code, 1.0 + 0.1 * n) for n in range(102)]
    assert [bool(why) for why in reports].index(True) == LATE_FOR / 0.1
    assert reports[100].endswith(f": {m.CODE_NAMES[code]} for 10 s")
    assert refusals.last == code


def test_word_that_all_come_late_counts_only_while_commands_are_sent(refusals):
    assert not any(refusals.held(ME, m.STALE, float(now), sent=1) for now in range(60))
    assert not refusals.held(ME, None, 60.0, sent=2)
    reports = [bool(refusals.held(ME, m.STALE, 61.0 + n, sent=3 + n)) for n in range(41)]
    assert reports == [False] * 40 + [True]
    assert refusals.late
    assert SAYS_LATE_FOR > LEASE_S
    assert refusals.codes == {m.STALE: 1}


@pytest.mark.parametrize("code", [None, m.BUSY, m.BAD_MESSAGE, 999])
def test_any_other_answer_ends_it_when_it_comes_three_times_in_a_row(refusals, code):
    answers = [code, code, m.OK, code, m.STALE, code, code]
    assert [bool(refusals.answered(a, 0.0)) for a in answers] == [False] * 6 + [True]
    assert REFUSALS_IN_A_ROW == 3


def test_word_of_a_holder_counts_once_the_robot_was_ours(refusals):
    assert not refusals.held(None, m.WRONG_MODE, 0.0, 0)  # from before the start
    assert not refusals.held(ME, None, 1.0, 1)
    assert not refusals.held(ME, m.STALE, 2.0, 2)
    assert "somebody else" in refusals.held(OTHER, None, 3.0, 3)


def test_word_that_never_says_it_is_ours_counts_the_third_time(refusals):
    reports = [bool(refusals.held(ME, m.WRONG_MODE, float(n), n)) for n in range(3)]
    assert reports == [False, False, True]


# --- a drive -----------------------------------------------------------------------------


def ends(dva: PretendedDva, log: DriveLog, within: float) -> None:
    before, sent = dva.now, log.sent
    dva.run_until(lambda: log.ended is not None, limit=within)
    assert log.ended is not None
    assert log.ended - before <= within
    assert log.sent - sent <= 10 * within + 1
    assert (log.outcome, log.alerts) == ("refused", 1)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_robot_that_refuses_every_command_is_given_up_with_an_alert(pattern):
    dva, log = driving(pattern)
    dva.field.robots[ROBOT].refuses = m.NOT_PERMITTED
    ends(dva, log, within=1.3)
    assert log.refused[m.NOT_PERMITTED] >= 1
    story = [moment.what for moment in dva.stage.recorder.timeline]
    assert any(what.startswith("is refused: ") and "not permitted" in what for what in story)


@pytest.mark.parametrize("code", PASSES)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_robot_to_which_every_command_comes_late_is_given_up_with_an_alert(pattern, code):
    dva, log = driving(pattern)
    dva.field.robots[ROBOT].refuses = code
    if pattern not in ("pub-sub", "latest-wins"):
        ends(dva, log, within=LATE_FOR + 2.5)
        assert log.refusal == code
        dva.run_for(5.0)
        assert dva.progress(1)[-1] == "failed"
        return
    dva.run_for(LATE_FOR + 2.5)
    recorder = dva.stage.recorder
    assert counted(recorder.counters, "alerts", "late") == 1
    assert any("comes late" in moment.what for moment in recorder.timeline)
    dva.run_until(lambda: "failed" in dva.progress(1), limit=SAYS_LATE_FOR)
    assert "failed" in dva.progress(1)  # sooner by the person, who sees that it stands


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_permission_that_is_over_is_noticed_though_the_dvas_word_is_lost(pattern):
    dva, log = driving(pattern)
    session = dva.sessions.pop(ROBOT).session
    dva.say(ROBOT, m.PermissionRevocation(ROBOT, OPERATOR, session))
    ends(dva, log, within=1.3)


@pytest.mark.parametrize("pattern", PATTERNS)
def test_who_finds_the_robot_taken_stops_nobody_elses_drive(pattern):
    dva, log = driving(pattern)
    other = dva.stage.device("operator", 2)
    other.serve(lambda message: m.Reply(message.message_id, m.OK, ""))
    grant = m.PermissionGrant(OTHER, "teleoperation", 1 << 33)
    dva.sessions[ROBOT] = grant
    assert dva.say(ROBOT, grant) == m.OK
    dva.run_for(0.5)
    codes: list[int] = []
    for _ in range(4):
        other.ask(ROBOT, m.StartTeleOp(), lambda r: codes.append(r.code), session=grant.session)
        dva.run_for(1.0)
    assert codes[-1] == m.OK
    dva.run_for(10.0)
    assert log.outcome == "refused"
    assert dva.field.robots[ROBOT].controller.owner == OTHER


@pytest.mark.parametrize("pattern", PATTERNS)
def test_after_somebody_elses_emergency_nobody_starts_again_by_himself(pattern):
    dva, log = driving(pattern)
    dva.say(ROBOT, m.Emergency())
    ends(dva, log, within=1.3)
    dva.run_for(20.0)
    assert dva.progress(1)[-1] == "failed"
    assert len(dva.stage.recorder.drives) == 1
    assert dva.field.robots[ROBOT].controller.mode is Mode.IDLE


@pytest.mark.parametrize("pattern", ["req-rep", "latest-wins"])
def test_who_is_refused_for_its_session_asks_the_dva_and_drives_on(pattern):
    dva, _ = driving(pattern)
    session = dva.sessions.pop(ROBOT).session
    dva.say(ROBOT, m.PermissionRevocation(ROBOT, OPERATOR, session))
    dva.run_until(lambda: "arrived" in dva.progress(1))
    first, again = dva.stage.recorder.drives
    assert (first.outcome, again.event) == ("refused", 1)
    assert "failed" not in dva.progress(1)


def test_who_is_refused_again_and_again_tells_the_dva_in_the_end():
    dva, _ = driving("req-rep")
    dva.field.robots[ROBOT].refuses = m.NOT_PERMITTED
    dva.run_until(lambda: "failed" in dva.progress(1))
    assert [log.outcome for log in dva.stage.recorder.drives] == ["refused"] * 2
    assert dva.stage.recorder.drives[1].sent <= 3


def test_nobody_listens_to_who_holds_the_robot_where_commands_are_answered():
    for pattern, heard in (("req-rep", False), ("latest-wins", True)):
        dva, _ = driving(pattern)
        assert dva.network.ready(ROBOT, "holder|", 1) is heard
        assert dva.network.ready(OTHER_ROBOT, "holder|", 1) is False
