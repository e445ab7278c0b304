"""Published transports of teleoperation beside TCP, UDP and ZeroMQ on one congested link.

| transport | what it is here |
|---|---|
| UDP, TCP, ZeroMQ | the project's own models of them |
| trinomial | in the manner of it: a rate of three terms, law and numbers not the paper's |
| RTNP | in the manner of it: priority in the queue of the end hosts |
| IRTP | in the manner of it: crucial messages again until they arrive, rate control for the rest |
| BTP | in the manner of it: two joined flows, as often as the least round trip allows |

For none of the four was the law itself available, only abstracts and descriptions by others; what
is known, what is missing and what was left out stands with each, in `config` and `laws`.
"""

from dva_sim.network.transports.competition import Contest, ContestConfig, Fates, play

__all__ = ["Contest", "ContestConfig", "Fates", "play"]
