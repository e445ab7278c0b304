"""What is kept: the tables of a study, its manifest, and what their columns mean.

It may import `study` and concludes nothing; `analysis` does. Begin reading at `results.py`, then
`tables.py` (how tables are written) and `manifest.py`.
"""
