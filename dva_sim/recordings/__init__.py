"""Runs kept as MCAP files: written, read back, taken to ROS 2.

Names come from the modules, so that who keeps an audit log does not load the simulation.
"""
