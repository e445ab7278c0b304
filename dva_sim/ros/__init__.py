"""Robots and clients of ROS, by the rosbridge protocol."""
