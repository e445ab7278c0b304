"""Experiments: a study is asked, run, kept, analysed and reported, a room for each step.

A room may import those before it (`study`, `results`, `execution`, `analysis`, `report`), and what
simulates. Begin reading at `runner.run_study`, which goes from a study's file to its report.
"""
