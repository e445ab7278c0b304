"""dva-sim: a test bench for surveillance teams of people and teleoperated robots."""

__version__ = "0.6.0"
