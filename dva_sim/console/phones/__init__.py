"""Phones at a console: what their pages say, their seats, and all of them together."""
