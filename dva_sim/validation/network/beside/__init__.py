"""Predictions for commands over real middleware: the study's runs, played in virtual time.

Only what is known before a run goes in: the scenario, the seed of the link, the transports'
specifications. Begin reading at `predictions`, then at `virtual_run` and `carriers`.
"""
