"""People on foot: guards who handle events, bystanders who leave, and how both walk.

They may import what all agents stand on, never a robot, an operator or the core. Begin with
`guard` and `bystander`; `walking` moves both, `evacuation` takes both out of danger.
"""
