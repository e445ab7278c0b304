"""Experiments: a study is asked, run, kept, analysed and reported, a room for each step.

A room may import those before it (`study`, `results`, `execution`, `analysis`, `report`), and what
simulates. Begin reading at `study/study.py`; `api.run` shows the steps in order.
"""
