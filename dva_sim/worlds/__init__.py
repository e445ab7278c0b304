"""Worlds of runs: sites, maps, physics, hazards, and the views of robots' cameras.

It knows no agents, no network and no DVA; of messages it knows the words alone. Begin with
`site.py`, what a site is and sites by name, and `site_parts.py`, what it is made of.
"""
