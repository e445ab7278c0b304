"""Phones at a console: messages of their pages, their seats, and all of them together."""
