"""Operators against people: exact answers, and published experiments played again.

It may import operators and tasks, but not the other kinds of evidence. Begin reading at
`experiments`, then at `verdicts`.
"""
