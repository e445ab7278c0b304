"""Results of a study: tables, manifest, and the meaning of columns.

It may import `study` and concludes nothing; `analysis` does. Begin reading at `results.py`, then
`tables.py` (how tables are written) and `manifest.py`.
"""
