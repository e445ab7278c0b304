"""Windows of a robot: its state, its station, why it stands and how late messages reach it."""
