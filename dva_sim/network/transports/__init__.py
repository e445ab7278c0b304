"""Published transports of teleoperation beside TCP, UDP and ZeroMQ on one congested link.

UDP, TCP and ZeroMQ are the project's own models of them; the others are configurations of
datagrams in the manner of their papers, as `config.Datagrams` says.
"""

from dva_sim.network.transports.competition import Contest, ContestConfig, Fates, play

__all__ = ["Contest", "ContestConfig", "Fates", "play"]
