"""Studies: the keys of their files, their designs, and the runs that follow.

It may import what simulates, but nothing that runs a study or reads its results. Begin reading at
`study.py`, then `loading.py` (how it is read) and `plan.py` (what running it means).
"""
