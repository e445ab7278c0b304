"""A map as ROS writes it: an image of grey values, and its keys."""

import numpy as np
from PIL import Image


def write_map(folder, pixels, **changes):
    """A ROS map of some grey values; `changes` replace or (None) remove keys."""
    Image.fromarray(np.asarray(pixels, np.uint8)).save(folder / "map.pgm")
    keys = {
        "image": "map.pgm",
        "resolution": 0.5,
        "origin": "[0, 0, 0]",
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
        **changes,
    }
    text = "".join(f"{key}: {value}\n" for key, value in keys.items() if value is not None)
    (folder / "map.yaml").write_text(text)
    return folder / "map.yaml"
