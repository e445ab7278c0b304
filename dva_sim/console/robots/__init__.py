"""Windows of a robot: its state, its station, reasons for standing, lateness of messages."""
