"""Analysis of a study's runs: effects, tests, robustness, and the answer in sentences.

Imports statistics, results and execution, and never the report, which prints what is found here.
Begin with `run_grid`, where runs become a grid, then `study_view` and `answer`.
"""
