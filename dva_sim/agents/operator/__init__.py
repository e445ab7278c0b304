"""Operators: persons with a phone, who see delayed frames and tilt."""
