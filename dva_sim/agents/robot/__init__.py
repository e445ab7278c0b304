"""The robot: its controller, what waits for it, its sensors, and how it drives by itself."""
