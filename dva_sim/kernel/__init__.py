"""Foundations: clock, random streams, recorder, configuration, plug-ins, errors.

The package imports no other package. Begin reading at `clock` and `streams`, then at `config`.
"""
