"""Foundations: clock, random streams, recorder, configuration, plug-ins, errors.

It imports no other room. Begin reading at `clock` and `streams`, then at `config`.
"""
