"""Pages of any system: the lines that show it, and the actions of the people there.

A run beside the console (`world`) and a DVA elsewhere (`remote`) add what only they can.
"""
