"""Two devices under one id: the first keeps it while it is heard, and both sides say so once."""

from helpers.wording import counted

from dva_sim.simulation import scenario as scenarios
from dva_sim.simulation.full.run import Run
from dva_sim.simulation.full.stage import id_of

ROBOT = id_of("robot", 1)
ELSEWHERE = "10.0.0.66:5600"


def test_the_second_robot_of_an_id_is_refused_and_that_is_told_once_at_each_side():
    run = Run(scenarios.build(scenarios.load("drive-to-event"), {"horizon_s": 120}), 1)
    run.clock.run(10.0)
    second = run.stage.device("robot", 1)
    second.address = ELSEWHERE
    second.register()
    run.run()
    story = [moment for moment in run.recorder.timeline if "regist" in moment.what]
    assert [moment.who for moment in story] == ["dva", "robot-1"]
    assert all(f"{ELSEWHERE}" in s.what or "under this id" in s.what for s in story)
    assert run.dva.core.registry.entries[ROBOT].device.address != ELSEWHERE
    assert run.recorder.drives[0].outcome == "confirmed"
    assert counted(run.dva.core.counters, "id in use") > 10
