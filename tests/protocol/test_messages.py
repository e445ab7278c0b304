"""Messages as values: in virtual time sender and receiver have the same one."""

import dataclasses

import pytest

from dva_sim.protocol import control_room, messages, missions, places

KINDS = {
    kind
    for module in (messages, control_room, missions, places)
    for kind in vars(module).values()
    if dataclasses.is_dataclass(kind)
}


@pytest.mark.parametrize("kind", sorted(KINDS, key=lambda kind: kind.__name__))
def test_what_a_message_holds_never_changes_and_takes_little_room(kind):
    made = object.__new__(kind)
    for name in [field.name for field in dataclasses.fields(kind)] or ["anything"]:
        with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
            setattr(made, name, 1)
    assert not hasattr(made, "__dict__")


def test_all_kinds_of_messages_are_looked_at():
    assert len(KINDS) > 60
