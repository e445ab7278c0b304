"""Samples of a real part take the way of simulated ones, to the last bit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dva_sim.agents.population import Population, median_person
from dva_sim.agents.tilt import Phone, PhoneProfile, TiltSources
from dva_sim.agents.tilt.accelerometer import GRAVITY
from dva_sim.agents.tilt.measured import MeasuredTilt


class Recorded(Phone):
    """A simulated phone that keeps what its part measures, and when."""

    def __init__(self, profile, seed):
        person = replace(median_person(Population()), hand_lag=0.15, motor_noise=0.05)
        self.stream = []
        super().__init__(profile, person, np.random.default_rng(seed))
        measure, interval = self._accelerometer.sample, self._interval

        def sample(pitch, roll):
            xyz = measure(pitch, roll)
            self.stream.append((self._due_at, xyz))
            return xyz

        def next_interval():
            step = interval()
            self._due_at += step
            return step

        self._due_at = 0.0
        self._accelerometer.sample, self._interval = sample, next_interval
        self.pick_up(0.0)


def commands(app, feed, ask):
    """Commands of an app in ten seconds, read whenever it asks to be."""
    now, reports = 0.0, []
    while now < 10.0:
        feed(now)
        ask(now)
        command = app.look(now)
        if command is not None:
            reports.append((now, command.speed, command.turn_rate))
        now = round(app.next_look(now, 10.0), 6)
    return reports


@pytest.mark.parametrize("pipeline", ["default", "one_pole", "dissertation"])
@pytest.mark.parametrize("mapping", ["absolute", "differential", "leaky", "slew"])
def test_a_recorded_stream_gives_the_commands_of_the_simulated_phone(pipeline, mapping):
    more = {"filter": "median20-copy", "send": "on_change"} if pipeline == "dissertation" else {}
    more = {"filter": "one_pole"} if pipeline == "one_pole" else more
    # At 32 Hz all times are whole ticks, so that sums and differences of them are exact.
    profile = PhoneProfile(mapping=mapping, sample_rate_hz=32.0, **more)
    phone = Recorded(profile, 3)
    phone._due_at = phone._sample_at

    def ask(now):
        phone.ask(now, 0.25 + 0.2 * math.sin(now), 0.3 * math.cos(now))

    wanted = commands(phone, lambda now: None, ask)
    real = MeasuredTilt(profile, phone._app.reference, 1.0 / profile.sample_rate_hz)
    real.pick_up(0.0)
    waiting = list(reversed(phone.stream))

    def feed(now):
        while waiting and waiting[-1][0] <= now + 1e-9:
            real.sample(*waiting.pop())

    looks = iter(wanted)
    reported = []
    if profile.send == "on_change":
        # When it is looked at is for whoever sends: the same moments here.
        for now, *_ in looks:
            feed(now)
            command = real.look(now)
            reported.append((now, command.speed, command.turn_rate))
    else:
        reported = commands(real, feed, lambda now: None)
    assert len(wanted) > 10
    assert reported == wanted


def test_a_batch_that_is_late_does_not_make_it_look_without_end():
    app = MeasuredTilt(
        PhoneProfile(filter="median20-copy", send="on_change"), (0.0, 0.0, GRAVITY), 0.02
    )
    app.pick_up(0.0)
    now, looks = 0.0, 0
    while now < 2.0:
        app.look(now)
        later = app.next_look(now, 10.0)
        assert later > now
        now, looks = later, looks + 1
    assert looks < 500


def test_what_was_measured_before_a_drive_begins_does_not_count_in_it():
    app = MeasuredTilt(PhoneProfile(filter="none"), (0.0, 0.0, GRAVITY), 0.02)
    app.pick_up(1.0)
    app.sample(0.99, (3.5, 0.0, GRAVITY))
    assert app.look(1.1).speed == 0.0
    app.sample(1.01, (3.5, 0.0, GRAVITY))
    assert app.look(1.2).speed == pytest.approx(0.5)


def test_the_newest_source_acts_and_nothing_of_the_other_is_left():
    both = TiltSources(PhoneProfile(), (0.0, 0.0, GRAVITY), 0.02, 100.0)
    both.pick_up(0.0)
    for n in range(1, 20):
        both.sample(0.02 * n, (3.5, 0.0, GRAVITY))
    assert both.look(0.4).speed == pytest.approx(0.5)
    both.ask(0.4, 0.1, 0.0)
    both.sample(0.42, (3.5, 0.0, GRAVITY))
    assert both.look(0.6).speed == pytest.approx(0.1)
    assert not both.is_tilted
    both.sample(0.72, (1.75, 0.0, GRAVITY))
    assert both.is_tilted
    assert both.look(0.73).speed == pytest.approx(0.25)
