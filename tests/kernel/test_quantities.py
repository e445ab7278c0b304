"""Numbers with a unit, as people write them."""

from dva_sim.kernel.quantities import as_number


def test_a_number_with_a_unit_is_read_only_where_the_unit_is_clear():
    assert as_number("delay_s", "500 ms") == "0.5"
    assert as_number("speed_mps", "3.6 km/h") == "1"
    assert as_number("queue_bytes", "2 kB") == "2000"
    assert as_number("delay_s", "500 m") == ""
    assert as_number("loss", "half") == ""
    assert as_number("loss", "") == ""
