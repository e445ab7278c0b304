"""What is asked: the keys of a study's file, its design, and the runs that follow from them.

It may import what simulates, but nothing that runs a study or reads its results. Begin reading at
`study.py`, then `loading.py` (how it is read) and `plan.py` (what running it means).
"""
