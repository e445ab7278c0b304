"""Lines for people hold nothing up, however slowly they are read."""

import threading

from helpers.processes.patience import PATIENCE_S

from dva_sim.live import ros_robot
from dva_sim.live.ros_robot import LineWriter


def test_lines_are_said_in_their_order():
    said = []
    lines = LineWriter(said.append)
    for number in range(5):
        lines(str(number))
    lines.close()
    assert said == ["0", "1", "2", "3", "4"]


def test_an_output_that_nobody_reads_stops_nobody(monkeypatch):
    monkeypatch.setattr(ros_robot, "LAST_LINES", 0.01)
    goes_on = threading.Event()
    lines = LineWriter(lambda _: goes_on.wait(PATIENCE_S))
    for number in range(2 * ros_robot.MAX_WAITING):
        lines(str(number))
    lines.close()
    goes_on.set()


def test_an_output_that_is_gone_is_no_error():
    def say(_):
        raise BrokenPipeError

    lines = LineWriter(say)
    lines("one")
    lines("two")
    lines.close()
