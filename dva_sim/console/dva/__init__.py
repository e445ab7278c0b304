"""The DVA under people's hands: its devices, its port, and devices that are not there."""
