"""The evidence: comparison of simulated with known values, for dispatch, operators and network.

Each kind judges by a rule of its own, which its `result_page` states, and puts its lines into
words; `frame` shows all of them alike. The room may import everything below `testing`, and prints
nothing. Begin reading at `frame`, then at `dispatch.checks`.
"""
