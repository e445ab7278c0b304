"""A phone that is tilted exactly as asked, and an app that is fed samples from outside."""

import math

import pytest

from dva_sim.agents.tilt import GivenTilt, PhoneProfile, TiltApp
from dva_sim.agents.tilt.accelerometer import GRAVITY

TURN = math.radians(30)


def settled(app, start=0.0):
    """The command after two seconds of looking at it."""
    made = None
    for n in range(1, 201):
        made = app.look(start + n / 100) or made
    return made


@pytest.mark.parametrize("mapping", ["absolute", "differential", "leaky", "slew"])
@pytest.mark.parametrize(("speed", "turn"), [(0.5, 0.0), (0.2, TURN / 2), (0.0, -TURN), (0.0, 0.0)])
def test_what_is_asked_comes_out_of_every_mapping(mapping, speed, turn):
    app = GivenTilt(PhoneProfile(mapping=mapping, sample_rate_hz=100))
    app.pick_up(0.0)
    app.ask(0.0, speed, turn)
    made = settled(app)
    assert made.speed == pytest.approx(speed, abs=0.005)
    assert made.turn_rate == pytest.approx(turn, abs=0.03)


def test_the_filter_delays_it_by_half_its_window_and_half_a_sample():
    app = GivenTilt(PhoneProfile(sample_rate_hz=250))
    app.pick_up(0.0)
    app.look(1.0)
    app.ask(1.0, 0.5, 0.0)
    first = next(n for n in range(1, 100) if app.look(1.0 + n / 1000).speed > 0.4)
    assert first == 12


def test_more_than_a_phone_can_ask_is_its_most():
    app = GivenTilt(PhoneProfile())
    app.pick_up(0.0)
    app.ask(0.0, 9.0, 9.0)
    made = settled(app)
    assert (made.speed, made.turn_rate) == (pytest.approx(0.5), pytest.approx(TURN))


def test_a_new_drive_begins_at_a_stand_whatever_was_asked_before():
    app = GivenTilt(PhoneProfile())
    app.pick_up(0.0)
    app.ask(0.0, 0.5, 0.0)
    settled(app)
    app.pick_up(2.0)
    assert settled(app, 2.0).speed == 0.0


def test_an_ideal_phone_passes_it_on_at_once():
    app = GivenTilt(PhoneProfile(ideal=True))
    app.pick_up(0.0)
    app.ask(0.5, 0.3, 0.1)
    made = app.look(0.5)
    assert (made.speed, made.turn_rate) == (pytest.approx(0.3), pytest.approx(0.1))
    assert made.sample_age == 0.0


def test_samples_from_outside_take_the_same_way():
    """Samples arrive as from a real phone: raw, each with its own time."""
    app = TiltApp(PhoneProfile(), (0.0, 0.0, GRAVITY), 0.02)
    app.pick_up(0.0)
    for n in range(1, 20):
        app.sample(0.02 * n, (5 * 0.35, 10 * 0.12, GRAVITY))
    made = app.look(0.4)
    assert made.speed == pytest.approx(0.25)
    assert made.turn_rate == pytest.approx(math.radians(10))
    assert made.sample_age == pytest.approx(0.06)


def test_a_filter_that_works_in_batches_gets_its_batches_from_outside_too():
    profile = PhoneProfile(filter="median20-copy", send="on_change", max_delay_s=0.5)
    app = TiltApp(profile, (0.0, 0.0, GRAVITY), 0.02)
    app.pick_up(0.0)
    for n in range(1, 41):
        app.sample(0.02 * n, (3.5, 0.0, GRAVITY))
    assert (app.samples, app.values) == (40, 2)
    assert app.look(0.81).speed == pytest.approx(0.5)
    assert app.look(0.82) is None
