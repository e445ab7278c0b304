import pytest

from dva_sim.console.run.sliders import changed
from dva_sim.console.wire.actions import ACTIONS
from dva_sim.console.wire.kinds import BadMessage
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.link import LinkConfig


def test_sliders_keep_what_they_do_not_change():
    link = LinkConfig(delay_s=0.2, loss=0.1, queue_bytes=9_000, up={"delay_s": 0.4})
    made = changed(link, {"delay_s": 0.3})
    assert (made.loss, made.queue_bytes) == (0.1, 9_000)
    assert made.toward("up").delay_s == made.toward("down").delay_s == 0.3


def test_jitter_takes_the_place_of_a_law_and_loss_that_of_bursts():
    law = {"law": "normal", "sd_s": 0.01}
    made = changed(LinkConfig(delay_s=0.2, delay_law=law), {"jitter_s": 0.1})
    assert (made.delay_law, made.jitter_s) == (None, 0.1)
    made = changed(LinkConfig(loss=0.1, bursts={"mean_s": 1.0}), {"loss": 0.2})
    assert (made.bursts, made.loss) == (None, 0.2)


def test_a_delay_that_a_law_cannot_have_is_refused_in_a_line():
    law = {"law": "normal", "sd_s": 0.05}
    with pytest.raises(ConfigError) as error:
        changed(LinkConfig(delay_s=0.2, delay_law=law), {"delay_s": 0.01})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("given", [{"delay_s": 5.1}, {"loss": "much"}, {"rate_bps": True}])
def test_numbers_beyond_the_sliders_are_refused(given):
    with pytest.raises(BadMessage, match=next(iter(given))):
        ACTIONS["link"].read(given)
