"""The evidence: what is simulated beside what is known.

`dispatch` plays worlds whose answer is known exactly, `operators` the tasks of published
experiments; both are told, written and drawn in the same way.
"""
