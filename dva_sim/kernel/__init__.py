"""What everybody stands on: clock, random streams, recorder, configuration, errors."""
