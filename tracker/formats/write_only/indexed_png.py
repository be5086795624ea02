"""Indexed PNG: each pixel is the number of a label, and a palette shows it in the label's colour."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def write_indexed_png(path: Path, labels: NDArray[np.uint8], colors: Mapping[int, str]) -> None:
    """Write labels as an indexed PNG.

    Args:
        path: the file.
        labels: (H, W).
        colors: `#rrggbb` by label; black for the others.

    Raises:
        OSError: the file cannot be written.
    """
    palette = np.zeros((256, 3), np.uint8)
    for label, color in colors.items():
        palette[label] = np.frombuffer(bytes.fromhex(color[1:]), np.uint8)
    picture = Image.fromarray(labels, "P")
    picture.putpalette(palette.ravel().tolist())
    picture.save(path, "PNG")
