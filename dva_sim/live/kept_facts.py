"""Facts of a run for its recording: team, events and positions."""

from __future__ import annotations

from collections.abc import Callable

from dva_sim.core.events import EventTable
from dva_sim.live.recording import LiveRecorder
from dva_sim.recordings.writing import SENT
from dva_sim.simulation.full.observations import FactLog, motion_of, page_of
from dva_sim.simulation.full.physical_world import Field
from dva_sim.simulation.full.run import FILM_PERIOD, WATCH_PERIOD, Run


def keep_events(recorder: LiveRecorder, events: EventTable) -> None:
    """Record the states of all open events and of the last closed ones."""
    for e in (*events.closed.values(), *events.open.values()):
        at = [e.position.latitude, e.position.longitude]
        sent = {role: getattr(e, role) for role in SENT}
        facts = e.number, e.kind, at, e.state.value, dict(e.times), e.severity, sent
        recorder.put_new("event", *facts, key=f"event {e.number}")


def keep_team(recorder: LiveRecorder, labels: dict[str, str], field: Field) -> None:
    """Record the team and the contained hazards."""
    radii = {name: robot.body.spec.radius for name, robot in field.robots.items()}
    recorder.put_new("team", dict(labels), radii, key="team")
    for number, when in field.contained.items():
        recorder.put_new("contains", number, when, key=f"contained {number}")


def keep_places(recorder: LiveRecorder, field: Field, now: float) -> None:
    """Record all positions."""
    recorder.put("at", now, [(name, *point[1:]) for name, point in field.whereabouts(now)])


def keep_run(run: Run, recorder: LiveRecorder) -> Callable[[], None]:
    """Record all facts of a run in this process, from now on.

    Returns:
        Function that records the changes since the last second, for the end of the run.
    """
    field = run.field
    clock = run.clock

    def facts() -> None:
        keep_team(recorder, run.stage.labels, field)
        keep_events(recorder, run.dva.core.events)

    log = FactLog(
        recorder.observe,
        robots=field.robots,
        look=lambda robot: motion_of(field.robots[robot]),
        page=lambda _: page_of(run.dva),
        keeps_sent=False,
    )
    facts()
    run.observe(log)
    clock.every(FILM_PERIOD, lambda: keep_places(recorder, field, clock.now))
    clock.every(WATCH_PERIOD, lambda: log.places(clock.now, field.places()))
    clock.every(1.0, facts)
    return facts
