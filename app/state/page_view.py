"""The part of the session that one page shows: its layers and the sizes of its panes.

Two windows on one session may show different layers, so this is no part of the `State`. A page sends it on connecting
and whenever it changes (docs/protocol.md).
"""

from dataclasses import dataclass
from typing import Literal, get_args

PictureLayer = Literal["image", "silhouette", "distance", "parts"]
PICTURES: tuple[PictureLayer, ...] = get_args(PictureLayer)
"""Layers that are sent as pictures."""
Layer = Literal[
    "image", "silhouette", "distance", "parts", "faces", "accepted", "rejected", "contours", "hidden", "part_edges",
    "skeleton", "joints", "observability", "errors", "imported", "alternatives", "epipolar", "axes",
]  # fmt: skip
LAYERS: tuple[Layer, ...] = get_args(Layer)
"""Every layer: pictures, then those that are sent as line segments and joints."""
EVIDENCE = frozenset(("silhouette", "distance", "accepted", "rejected"))
"""Layers that need the evidence of the frame."""


@dataclass(frozen=True)
class View:
    """Layers and panes that one page shows."""

    layers: frozenset[str]
    """Names of the layers shown."""
    reductions: tuple[float, ...]
    """By camera: image pixels per picture pixel along either side; 0 for a pane that is not visible."""
    by_part: bool = False
    """Whether contours have the colours of parts instead of those of people."""

    @property
    def cameras(self) -> frozenset[int]:
        """Indices of the cameras whose panes are visible."""
        return frozenset(camera for camera, reduction in enumerate(self.reductions) if reduction)

    @property
    def pictures(self) -> tuple[PictureLayer, ...]:
        """The layers shown that are pictures."""
        return tuple(name for name in PICTURES if name in self.layers)
