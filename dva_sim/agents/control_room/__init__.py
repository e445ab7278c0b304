"""Control rooms: what somebody there sees of the events, and a person who decides by a script.

They know the DVA by its messages alone. Begin with `control_room.ControlRoomAgent`.
"""
