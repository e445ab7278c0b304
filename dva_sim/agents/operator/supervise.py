"""Supervisory control: the operator gives the goal, the robot acts, the operator judges.

References:
    T. B. Sheridan: Telerobotics, Automation, and Human Supervisory Control. MIT Press, 1992.
"""

from __future__ import annotations

from dva_sim.agents.camera import Observation
from dva_sim.agents.inspection import IN_VIEW
from dva_sim.agents.operator.work import Work
from dva_sim.protocol import messages as m

ASK_PERIOD = 2.0  # how often the operator asks how the mission stands [s]


class Supervise(Work):
    """One inspection that a robot makes by itself, watched through its camera.

    The same pictures, perceived as late and judged with the same errors, decide as in `Drive`:
    only who steers differs.
    """

    level, verb, wish = "missions", "watches", "send"

    def beginning(self) -> m.Body:
        """What to ask the robot for."""
        return m.Inspect(self.order.event_id, self.order.kind, self.order.position)

    def ending(self) -> m.Body:
        """What to tell the robot when it is over."""
        return m.CancelMission()

    def begin(self) -> None:
        """The robot is on its way: watch the picture, and ask now and then how it stands."""
        super().begin()
        self._clock.call_after(ASK_PERIOD, self._ask)

    def _see(self, observation: Observation) -> None:
        """A frame is on the screen; who looks at that perceives it a little later."""
        if self._seat.attention.looks_at(self):
            delay = self._seat.person.perceptual_delay
            self._clock.call_after(delay, self._perceive, observation)

    def _perceive(self, observation: Observation) -> None:
        if self.over:
            return
        now, judged = self._clock.now, self._seat.judge(observation)
        self._device.recorder.view(now, self.robot, judged.x, judged.y, judged.heading)
        found = self._looking.look(now, judged)
        if found is not None:
            self.end(*found)

    def _ask(self) -> None:
        """How does the mission stand? The next time is when this was answered."""
        if self.over:
            return

        def answered(reply: m.Reply) -> None:
            status = reply.content
            if self.over or not isinstance(status, m.MissionStatus):
                return
            if status.mission_state in ("done", "failed"):
                self.end("gave up", f"the robot: {status.reason or status.mission_state}")
                return
            self._note(status)
            self._clock.call_after(ASK_PERIOD, self._ask)

        body = m.GetMissionStatus()
        self._device.ask(self.robot, body, answered, self.link_lost, self.session)

    def _note(self, status: m.MissionStatus) -> None:
        """A robot that says what is in view is there, and waits for the judgement."""
        if self.waits_since is None and status.reason.endswith(IN_VIEW):
            self.waits_since = self.log.waits_from = self._clock.now
