"""Places where people raise events: on floor that a robot reaches, or refused with the reason."""

import pytest

from dva_sim.console.asking.refusal import Refused
from dva_sim.console.events.decisions import place_of
from dva_sim.worlds.site import Site, load_site


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site("caparica")


def test_an_event_lies_where_it_was_raised_if_there_is_floor(site):
    assert place_of({"x_m": 20.0, "y_m": 12.0}, site) == (20.0, 12.0)


def test_an_event_at_a_desk_lies_on_the_floor_before_it(site):
    for solid in site.solids:
        middle_x, middle_y = solid.mean(axis=0)
        x, y = place_of({"x_m": middle_x, "y_m": middle_y}, site)
        assert site.is_free(x, y, 0.30)
        assert site.room_at(x, y) == site.room_at(middle_x, middle_y)


@pytest.mark.parametrize("x_m", [-0.1, 100.0])
def test_an_event_outside_the_site_is_refused(site, x_m):
    with pytest.raises(Refused, match=r"outside the site, where nobody can go"):
        place_of({"x_m": x_m, "y_m": 12.0}, site)


def test_an_event_may_be_anywhere_where_no_site_is_known():
    assert place_of({"x_m": -500.0, "y_m": 12.0}, None) == (-500.0, 12.0)
