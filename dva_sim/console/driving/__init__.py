"""Driving from pages: seats, robots in hand, input, and all that ends a drive."""
