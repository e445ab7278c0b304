"""Operators against people: exact answers, and published experiments played again."""
