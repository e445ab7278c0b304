"""The figures of a report: each one object, drawn wherever its tables and columns are there.

Reads a study's results and what `analysis` makes of them; draws in the look of `style`, in the
colours of `palette`. Begin with `style.ReportFigure`, then `registry`, which holds all figures in
their order.
"""
