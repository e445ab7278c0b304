"""The report of a study: its page, its tables, its figures, on screen and on paper.

Imports analysis, execution and results, and nothing above; no model of a run but in its page
(`results_reading.page_of`). Begin with `report`, whose `blocks_of` is the order of a page, then
`summary`.
"""
