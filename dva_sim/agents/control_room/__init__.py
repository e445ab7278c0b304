"""Control rooms: their view of the events, and a simulated person who decides by a script.

They know the DVA by its messages alone. Begin with `control_room.ControlRoomAgent`.
"""
