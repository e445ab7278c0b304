"""Devices that no DVA lists any more: who is kept, and who is forgotten."""

from helpers.console.simulated_phone import PhonePage

from dva_sim.agents.device import do_nothing
from dva_sim.console.bench import BenchView
from dva_sim.console.system.system_state import MAX_LOST, SystemState
from dva_sim.protocol import messages as m
from dva_sim.protocol.devices import FORGET_AFTER, GUARD, OPERATOR
from dva_sim.simulation.full.stage import DVA, id_of


def test_of_the_lost_the_latest_with_a_position_are_kept(monkeypatch):
    page = PhonePage(monkeypatch, bystander__count=0)
    state = SystemState(page.world.system.device, {}, tuple, BenchView(), do_nothing)
    guards = [id_of("fake", number) for number in range(MAX_LOST + 3)]
    mute = id_of("fake", MAX_LOST + 3)
    phone = id_of("phone", 1)
    state.list(
        [
            *(m.Device(id_tag, id_tag, GUARD, "192.0.2.1:5600") for id_tag in [*guards, mute]),
            m.Device(phone, "phone", OPERATOR, "192.0.2.2:5600"),
        ],
        DVA,
    )
    for id_tag in guards:
        state.devices[id_tag].published = m.PersonStatus("Patrols", m.Position(0.0, 0.0))
    page.let(FORGET_AFTER)
    state.list([], DVA)
    assert [*state.devices] == [*guards, mute, phone]
    page.let(1.0)
    state.list([], DVA)
    assert [*state.devices] == guards[3:]
