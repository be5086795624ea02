"""What the 3-D view shows, as one frozen value, and how it is kept with the session."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal

MOST_TRAIL_FRAMES = 250
"""Longest trail, frames to either side of the shown one."""


@dataclass(frozen=True)
class View3d:
    """The layers of the 3-D view."""

    bodies: bool = True
    """Whether the bodies are drawn."""
    colors: Literal["parts", "people"] = "parts"
    """By what the bodies are coloured."""
    opacity: float = 1.0
    """Of the bodies, 0 to 1."""
    cameras: bool = True
    """Whether the cameras are drawn as frusta."""
    images: bool = True
    """Whether the frusta show the images of the shown frame."""
    floor: bool = True
    """Whether the grid on the floor is drawn."""
    gizmos: bool = True
    """Whether the handles are drawn by which bodies and joints are turned in space."""
    ghost: bool = False
    """Whether the prediction of the shown frame is drawn."""
    trail_points: frozenset[str] = frozenset()
    """Points of the bodies whose way is drawn."""
    trail_frames: int = 25
    """Length of a trail, frames to either side of the shown one."""


def kept(view: View3d) -> dict[str, Any]:
    """A view as JSON holds it; the inverse of `restored`."""
    return asdict(view) | {"trail_points": sorted(view.trail_points)}


def restored(data: object, usual: View3d | None = None) -> View3d:
    """The view that was kept; what is missing or makes no sense is as it is for a session that is new.

    Args:
        data: as `kept` made it, or whatever a file holds.
        usual: how it is for a session that is new.
    """
    usual = usual or View3d()
    if not isinstance(data, Mapping):
        return usual
    are_switches = [f.name for f in fields(View3d) if isinstance(getattr(usual, f.name), bool)]
    switches = {name: data[name] for name in are_switches if isinstance(data.get(name), bool)}
    view = replace(usual, **switches)
    if data.get("colors") in ("parts", "people"):
        view = replace(view, colors=data["colors"])
    opacity, frames, points = data.get("opacity"), data.get("trail_frames"), data.get("trail_points")
    if isinstance(opacity, int | float) and 0 < opacity <= 1:
        view = replace(view, opacity=float(opacity))
    if isinstance(frames, int) and not isinstance(frames, bool) and 1 <= frames <= MOST_TRAIL_FRAMES:
        view = replace(view, trail_frames=frames)
    if isinstance(points, list) and all(isinstance(p, str) for p in points):
        view = replace(view, trail_points=frozenset(points))
    return view
